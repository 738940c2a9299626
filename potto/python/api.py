"""Potto for Python: workspaces, modules, functions that are called with numbers, arrays and each other.

Owns `Workspace`, `Module`, `load` and `compile`; what a module's names stand for is in `functions`. All of it may be
called from several threads. What is wrong, with the program or with an argument, is a `PottoError`.
"""

from __future__ import annotations

import difflib
import itertools
import os
import warnings
from collections.abc import Sequence
from functools import partial
from typing import Any

from potto import store
from potto.diagnostics import Diagnostic, PottoError
from potto.evaluating.world import World
from potto.kernels.errors import wrong_call
from potto.modules import DefinitionTarget, ModuleTarget, find_module, names, resolve
from potto.modules.kinds import NO_MODULE
from potto.python.arguments import Batch
from potto.python.calls import Call
from potto.python.described import Doc
from potto.python.functions import Function
from potto.python.travel import Travelling
from potto.reports.render import ProgramError, display_name
from potto.runtime.answers.estimate import Estimate
from potto.source import NOWHERE
from potto.syntax import nodes
from potto.types import infer_expression
from potto.types.types import Diffeo
from potto.types.types import Function as FunctionType

_texts = itertools.count(1)
# Modules of texts that import nothing, by folder, name and text: what a cell of a notebook that is run again need not
# be checked for again.
MOST_KNOWN = 32
_known: dict[tuple[str, str | None, str], Module] = {}


class Workspace:
    """A folder of programs. Modules are found in it by their dotted names, and import each other from it.

    Raises PottoError if there is no such folder.
    """

    def __init__(self, root: str | os.PathLike[str] = ".", *, roots: Sequence[str | os.PathLike[str]] = ()) -> None:
        self.root = os.path.abspath(root)
        for folder in (self.root, *map(os.path.abspath, roots)):
            if not os.path.isdir(folder):
                what = "is a file, not a folder" if os.path.exists(folder) else "does not exist"
                raise PottoError([NO_MODULE(NOWHERE, f"the folder of a workspace {what}: {display_name(folder)}")])
        self._world = World([self.root, *roots])

    def module(self, name: str) -> Module:
        """The module of a dotted name. Raises PottoError if there is none, or as `load` does."""
        file = find_module(self._world.db, os.path.join(self.root, "<workspace>"), name)
        if file is None:
            problem = NO_MODULE(NOWHERE, f"there is no module `{name}` in {display_name(self.root)}")
            raise PottoError([problem])
        return _module(self._world, file, 3)

    def load(self, path: str | os.PathLike[str]) -> Module:
        """The module in a file. A relative path starts at the workspace's folder."""
        return _load(self._world, os.path.join(self.root, path))

    def compile(self, text: str, name: str | None = None) -> Module:
        """A module from text; it can import the workspace's modules."""
        return _compile(self._world, os.path.join(self.root, f"<{name or f'text {next(_texts)}'}>"), text)

    def reload(self) -> bool:
        """Read what has changed on disk; True if something had. Modules and functions that exist see the new texts."""
        return self._world.refresh()

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(Workspace, roots=self._world.files.roots[1:]), (self.root,)

    def __repr__(self) -> str:
        return f"potto.Workspace({display_name(self.root)!r})"


def load(path: str | os.PathLike[str]) -> Module:
    """The module in a file: `potto.load("renderer.po")`.

    Raises PottoError if nothing in it is without errors. If some of it is, `ProgramWarning` says what is not; using
    that raises PottoError.
    """
    return _load(World(["."]), os.fspath(path))


def compile(text: str, name: str | None = None) -> Module:
    """A module from text: `potto.compile("def f(t) integral [0, 1] [x < t] d(x)")`. Raises as `load` does."""
    folder = os.getcwd()
    known = _known.get((folder, name, text)) if isinstance(text, str) else None
    if known is not None and known._world.stands(known._file):
        return _module(known._world.again(), known._file, 3)
    found = _compile(World(["."]), os.path.join(folder, f"<{name or f'text {next(_texts)}'}>"), text)
    if found._world.stands(found._file):
        if len(_known) >= MOST_KNOWN:
            _known.clear()
        _known[folder, name, text] = found
        return Module(found._world.again(), found._file)  # what it evaluates goes with it
    return found


def _load(world: World, path: str) -> Module:
    key = world.key(path)
    world.must_exist(key)
    return _module(world, key)


def _compile(world: World, key: str, text: str) -> Module:
    if not isinstance(text, str):
        raise wrong_call(f"a program is a str, not a Python {type(text).__name__}")
    return _module(world, world.own(key, text))


def _module(world: World, file: str, level: int = 4) -> Module:
    """level: of the call that asks, counted from here; warnings name its place."""
    complaint = store.complaint()
    if complaint is not None:
        warnings.warn(complaint, stacklevel=level)  # told once for each place that loads
    wrong = world.errors(file)
    if wrong:
        error = ProgramError(wrong, world.source)
        if not world.has_sound(file):
            raise error
        warnings.warn(ProgramWarning(f"a definition has an error, the others can be used: {error}"), stacklevel=level)
    return Module(world, file)


class ProgramWarning(UserWarning):
    """A module is broken in part. What does not need the broken part can be used."""


class Module(Travelling):
    """The definitions of a file, as attributes. `__doc__` is the comment at its head."""

    __doc__ = Doc(__doc__)

    def __init__(self, world: World, file: str) -> None:
        self._world = world
        self._file = file

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        known: Function | None = self._world.memory.get((Module, self._file, name))
        if known is not None:
            return known
        target = resolve(self._world.db, self._file, name)
        if isinstance(target, DefinitionTarget):
            found = _member(self._world, self._file, nodes.Name(NOWHERE, name))
            if isinstance(found, Function):  # which knows what its calls have told: the same one while its texts stay
                self._world.memory[Module, self._file, name] = found
            return found
        if isinstance(target, ModuleTarget):
            return Module(self._world, target.file)
        near = difflib.get_close_matches(name, names(self._world.db, self._file), 1)
        hint = f"; did you mean `{near[0]}`?" if near else ""
        raise AttributeError(f"{self!r} defines no `{name}`{hint}")

    def __dir__(self) -> list[str]:
        return sorted(names(self._world.db, self._file))

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Everything that `potto check` says about the file."""
        return tuple(located.diagnostic for located in self._world.diagnostics(self._file))

    def eval(self, expression: str) -> Estimate:
        """The value of an expression with the module's names in scope."""
        return self._world.evaluate(self._file, expression).estimate

    def __repr__(self) -> str:
        return f"<Potto module {display_name(self._file)}>"


def _member(world: World, file: str, expr: nodes.Expr) -> Any:
    """What a name stands for: a function, a list of what its items stand for, or an estimate."""
    world.need(file, expr)
    type = infer_expression(world.db, file, expr).type
    if isinstance(type, FunctionType | Diffeo):
        return Function(world, file, expr, type)
    return Call(world, file, expr, ()).run((), Batch(None))


def expression(module: Module, text: str) -> Any:
    """What an expression in a module's names stands for: a function, or an estimate. Raises PottoError."""
    return _member(module._world, module._file, module._world.parse(text))
