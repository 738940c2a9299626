"""The tables of the gallery, `gallery.toml` in a folder of examples: what of its programs is shown.

title = "Contact and control"
about = "One sentence."
order = 2                              # among the chapters

[[curve]]                              # a function of one number and its derivative, as two curves
title = "A cart is parked"
program = "parking"                    # parking.po in this folder
function = '\\s . place(2, s)'          # a name of the program, or an expression
over = "when the engine is turned"     # what the number is
range = [0.1, 1.9]

[[picture]]                            # a function of a place, as `potto render` draws it
title = "A triangle"
program = "scene"
function = "pixel"
given = { shader = "depth", q = "0.2" }
wrt = ["q"]                            # derivatives by these, each a picture
size = [256, 256]
quick = [8, 8]                         # the size of a quick pass
box = [-1, 1, -1, 1]
pixel = "h"                            # the name of the program that is the width of a pixel
options = ["--tone", "srgb"]           # more of the options of `potto render`

[[driver]]                             # what takes Python: `pictures(folder, quick)` of a file in this folder
title = "A mesh is fitted"             # gives dicts with `file`, `caption`, and `seconds`, `error`, `evaluations`
file = "fit.py"                        # where these are known
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


class TableError(ValueError):
    """A table that is not as it should be; says which and why."""


@dataclass(frozen=True)
class Curve:
    title: str
    program: str
    function: str
    over: str
    range: tuple[float, float]
    about: str = ""


@dataclass(frozen=True)
class Picture:
    title: str
    program: str
    function: str
    size: tuple[int, int] = (256, 256)
    quick: tuple[int, int] = (8, 8)
    box: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0)
    given: tuple[tuple[str, str], ...] = ()
    pixel: str = ""
    wrt: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    about: str = ""


@dataclass(frozen=True)
class Driver:
    title: str
    file: str
    about: str = ""


Entry = Curve | Picture | Driver
KINDS: dict[str, type[Curve] | type[Picture] | type[Driver]] = {"curve": Curve, "picture": Picture, "driver": Driver}


@dataclass(frozen=True)
class Chapter:
    folder: Path
    title: str
    about: str
    order: float
    entries: tuple[Entry, ...]

    @property
    def name(self) -> str:
        return self.folder.name


def chapters(root: Path, names: Sequence[str] = ()) -> list[Chapter]:
    """The chapters of the folders named, or of all that have a table, in order. Raises TableError."""
    folders = [root / name for name in names] or [file.parent for file in root.glob("*/gallery.toml")]
    return sorted(map(chapter, folders), key=lambda c: (c.order, c.name))


def chapter(folder: Path) -> Chapter:
    file = folder / "gallery.toml"
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise TableError(f"{folder} has no gallery.toml") from None
    except tomllib.TOMLDecodeError as error:
        raise TableError(f"{file}: {error}") from None
    entries = [_entry(file, kind, item) for kind in KINDS for item in table.pop(kind, [])]
    title, about, order = table.pop("title", folder.name), table.pop("about", ""), table.pop("order", 100)
    if table:
        raise TableError(f"{file}: `{next(iter(table))}` is none of title, about, order, {', '.join(KINDS)}")
    return Chapter(folder, title, about, order, tuple(entries))


def _entry(file: Path, kind: str, item: dict[str, Any]) -> Entry:
    try:
        found: Entry = KINDS[kind](**{name: _frozen(value) for name, value in item.items()})
    except TypeError as error:
        raise TableError(f"{file}: a [[{kind}]] is not right: {str(error).partition(' ')[2]}") from None
    needed = file.parent / (found.file if isinstance(found, Driver) else f"{found.program}.po")
    if not needed.exists():
        raise TableError(f"{file}: there is no {needed.name} beside it")
    return found


def _frozen(value: Any) -> Any:
    if isinstance(value, dict):
        return tuple((name, str(text)) for name, text in value.items())
    return tuple(value) if isinstance(value, list) else value
