"""Names in scope: what a name means inside a definition.

Owns `Local` (what is bound inside), `Outside` (what the file and the builtins provide, fetched before anything is
inferred, so that chains of definitions do not pile inference upon inference) and what is said of a name that is not
defined. Local names come first, then the file's definitions and imports, then builtins.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal

from potto.diagnostics import Diagnostic
from potto.modules.graph import refer
from potto.modules.lookup import DefinitionTarget, ModuleTarget, find_module, preludes, resolve_module
from potto.modules.texts import imports, names
from potto.primitives import PRIMITIVES
from potto.query import Database
from potto.source import Span
from potto.syntax import nodes
from potto.types.interface import Interface
from potto.types.kinds import NOT_DEFINED
from potto.types.reasons import Reasons
from potto.types.types import Meta, Type

LocalKind = Literal["parameter", "local", "variable", "index", "loop"]
CONSTANTS = ("pi", "inf")
SPECIALS = ("deriv", "delta")
PROJECTIONS = ("fst", "snd")


@dataclass(eq=False, slots=True)
class Local:
    """A name that is bound inside a definition. `known`: its value is a function whose parameters have names.

    `value` is what a local name was bound to (the whole right side), for messages and for names of conditions.
    """

    name: str
    span: Span
    kind: LocalKind
    type: Type
    generic: tuple[Meta, ...] = ()
    known: bool = False
    value: nodes.Expr | None = None
    used: bool = False


@dataclass(frozen=True, slots=True)
class Global:
    """Another definition, through its interface."""

    target: DefinitionTarget
    interface: Interface


@dataclass(frozen=True, slots=True)
class Member:
    """A definition of the group that is inferred right now: recursion."""

    target: DefinitionTarget


@dataclass(frozen=True, slots=True)
class Builtin:
    """A builtin, a constant or one of the special forms."""

    name: str


@dataclass(frozen=True, slots=True)
class Module:
    """A module's name, which is no value."""

    name: str


Meaning = Local | Global | Member | Builtin | Module


@dataclass
class Outside:
    """What a file provides to the definition that is looked at: `known` by `(path or None, name)`.

    `reasons` tells why parameters of another definition must not vary; asked only when a message needs it.
    """

    db: Database
    file: str
    reasons: Callable[[DefinitionTarget], Reasons]
    known: dict[tuple[str | None, str], Meaning] = field(default_factory=dict)

    def find(self, path: str | None, name: str) -> Meaning | None:
        found = self.known.get((path, name))
        if found is None and path is None and is_builtin(name):
            return Builtin(name)
        return found


def is_builtin(name: str) -> bool:
    """Whether a name means a builtin where nothing else is in scope."""
    if name in CONSTANTS or name in SPECIALS or name in PROJECTIONS:
        return True
    primitive = PRIMITIVES.get(name)
    return primitive is not None and primitive.surface


def builtin_names() -> tuple[str, ...]:
    """All builtin names that programs may write."""
    return (*CONSTANTS, *SPECIALS, *PROJECTIONS, *(p.name for p in PRIMITIVES.values() if p.surface))


class Scope:
    """The local names in scope, innermost first."""

    def __init__(self) -> None:
        self._names: dict[str, Local] = {}

    def find(self, name: str) -> Local | None:
        return self._names.get(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    @contextmanager
    def inside(self) -> Iterator[None]:
        """What is bound in the block is forgotten at its end."""
        before = self._names
        self._names = dict(before)
        try:
            yield
        finally:
            self._names = before

    def bind(self, local: Local) -> None:
        self._names[local.name] = local

    def unbind(self, name: str) -> None:
        self._names.pop(name, None)


def undefined(outside: Outside, scope: Iterable[str], node: nodes.Name) -> Diagnostic:
    """What is said of a name that means nothing here."""
    name = node.id
    if name == "print":
        return NOT_DEFINED(
            node.span,
            "`print` is a statement, not a function",
            label="only at the top of a script",
            help="print at the top of a script, in a line of its own",
        )
    near = near_names(name, (*scope, *_file_names(outside), *builtin_names()))
    modules = () if near else modules_with(outside, name)
    helps = []
    if near:
        helps.append("did you mean " + " or ".join(f"`{other}`" for other in near) + "?")
    if modules:
        helps.append(f"it is defined in the module `{modules[0]}`: add `from {modules[0]} import {name}`")
    return NOT_DEFINED(node.span, f"`{name}` is not defined", label="not defined here", help="; ".join(helps))


def undefined_member(outside: Outside, scope: Scope, node: nodes.Member) -> Diagnostic:
    """What is said of `module.name` where there is no such module, or nothing of that name in it."""
    written = f"{node.path}.{node.name}"
    head = node.path.partition(".")[0]
    module = None if scope.find(head) else resolve_module(outside.db, outside.file, node.path)
    if module is not None:
        near = near_names(node.name, names(outside.db, module))
        help = "did you mean " + " or ".join(f"`{node.path}.{other}`" for other in near) + "?" if near else ""
        return NOT_DEFINED(
            node.name_span, f"the module `{node.path}` defines no `{node.name}`", label="not defined there", help=help
        )
    if find_module(outside.db, outside.file, node.path) is not None:
        help = f"add `import {node.path}`"
    elif scope.find(node.name) or scope.find(head) or node.path.isidentifier():
        help = f"for a function of `{node.path}` write blanks around the dot: `\\{node.path} . {node.name}`"
    else:
        help = ""
    what = f"`{head}` is no module" if scope.find(head) else f"there is no module `{node.path}` here"
    return NOT_DEFINED(node.path_span, f"{what}, so `{written}` is not defined", label="not a module", help=help)


def near_names(name: str, candidates: Iterable[str], count: int = 2) -> tuple[str, ...]:
    """The names that `name` may have been meant to be, the likeliest first."""
    known = dict.fromkeys(candidate for candidate in candidates if candidate != name)
    exact = [candidate for candidate in known if candidate.casefold() == name.casefold()]
    if exact or len(name) < 2:
        return tuple(exact[:count])
    cutoff = 0.6 if len(name) > 3 else 0.5
    return tuple(difflib.get_close_matches(name, list(known), n=count, cutoff=cutoff))


def modules_with(outside: Outside, name: str) -> tuple[str, ...]:
    """The modules that this file already imports something of and that define `name`."""
    found = []
    for item in imports(outside.db, outside.file):
        module = find_module(outside.db, outside.file, item.module)
        if module is not None and name in names(outside.db, module):
            found.append(item.module)
    return tuple(dict.fromkeys(found))


def _file_names(outside: Outside) -> tuple[str, ...]:
    """The names at the top of a file, and behind an entry of a prompt those of the entries before."""
    found: list[str] = []
    for file in (outside.file, *preludes(outside.db, outside.file)):
        found += names(outside.db, file)
        for item in imports(outside.db, file):
            if isinstance(item, nodes.Import):
                found.append(item.alias or item.module)
            else:
                found.extend(imported.alias or imported.name for imported in item.names)
    return tuple(found)


__all__ = ["DefinitionTarget", "ModuleTarget", "refer"]
