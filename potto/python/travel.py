"""Functions and modules on their way to another process or machine: what travels is content.

Owns `Travelling`, by which they pickle: the texts of their file and of all that it imports, and what was asked for in
the language itself. Nothing of ours that could change between versions is in a pickle, and no code is. Where they
arrive, equal texts are one world, so that what was compiled for a tile serves the next one.
"""

from __future__ import annotations

import hashlib
import os
import threading
from collections import OrderedDict
from functools import cached_property
from typing import Any

from msgspec import Struct

from potto.evaluating.world import World
from potto.modules.graph import imported_files
from potto.projects.settings import Settings
from potto.syntax import nodes, print_expression

MOST_WORLDS = 64


class Content(Struct, frozen=True, dict=True):
    """The texts of programs under the paths of their files, where modules are looked for, and how numbers are asked
    for where nobody says."""

    texts: tuple[tuple[str, str], ...]
    roots: tuple[str, ...]
    settings: Settings

    @cached_property
    def digest(self) -> str:
        return hashlib.blake2b(repr((self.texts, self.roots, self.settings)).encode(), digest_size=16).hexdigest()

    def placed(self, path: str) -> str:
        """A path where it arrives: in a folder of its own that is on no disk, so that no other text gets in its way."""
        return os.path.join(os.sep, f"<pickled {self.digest[:12]}>", os.path.splitdrive(path)[1].lstrip(os.sep))


def content_of(world: World, file: str) -> Content:
    """What a file is made of. Raises PottoError if that cannot be read any more."""
    todo, texts = [file], dict[str, str]()
    while todo:
        at = todo.pop()
        if at not in texts:
            text = world.source(at)
            texts[at] = "" if text is None else text.text
            todo += imported_files(world.db, at)
    return Content(tuple(sorted(texts.items())), tuple(world.files.roots), world.settings(file))


class Arrived(World):
    """The world of texts that came from elsewhere."""

    def __init__(self, content: Content) -> None:
        super().__init__([content.placed(root) for root in content.roots])
        self._settings = content.settings
        for path, text in content.texts:
            self.own(content.placed(path), text)

    def settings(self, file: str) -> Settings:
        return self._settings


_worlds: OrderedDict[str, Arrived] = OrderedDict()
_lock = threading.Lock()


def world_of(content: Content) -> Arrived:
    """The world of these texts, the same one each time while it is among those used last."""
    with _lock:
        world = _worlds.get(content.digest)
        if world is None:
            world = _worlds[content.digest] = Arrived(content)
        _worlds.move_to_end(content.digest)
        if len(_worlds) > MOST_WORLDS:
            _worlds.popitem(last=False)
    return world


class Travelling:
    """Pickles by content. Of a function its expression travels as text, with the arguments that it was given."""

    _world: World
    _file: str

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        asked: tuple[Any, ...] = ()
        expr: nodes.Expr | None = getattr(self, "_expr", None)
        if expr is not None:
            asked = print_expression(expr), vars(self)["_given"]
        return _arrive, (type(self), content_of(self._world, self._file), self._file, *asked)


def _arrive(kind: Any, content: Content, file: str, text: str | None = None, given: tuple[Any, ...] = ()) -> Any:
    world, file = world_of(content), content.placed(file)
    if text is None:
        return kind(world, file)
    tree, type = world.typed(file, text)
    for _ in given:
        type = type.result  # type: ignore[union-attr]  # a group of arguments was given, so it is a function's
    return kind(world, file, tree, type, given)
