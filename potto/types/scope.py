"""Names in scope: what a name means inside a definition.

Owns `Local` (what is bound inside), `Outside` (what the file and the builtins provide, fetched before anything is
inferred, so that chains of definitions do not pile inference upon inference) and what is said of a name that is not
defined. Local names come first, then the file's definitions and imports, then builtins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Literal

from msgspec import Struct

from potto.diagnostics import Diagnostic, Related, Replacement, Suggestion
from potto.measures import MEASURES
from potto.modules.builtins import CONSTANTS, PROJECTIONS, SPECIALS, VECTORS, is_builtin
from potto.modules.hints import called_here, elsewhere, known_elsewhere
from potto.modules.lookup import DefinitionBinding, DefinitionTarget, find_module, meaning, preludes, resolve_module
from potto.modules.texts import definition, imports, names
from potto.primitives import PRIMITIVES
from potto.query import Database, query
from potto.reports.near import did_you_mean, instead, near_names
from potto.source import Span
from potto.syntax import nodes
from potto.types.interfaces import Interface
from potto.types.kinds import NOT_DEFINED
from potto.types.reasons import Reasons
from potto.types.types import Meta, Type, place_of

LocalKind = Literal["parameter", "local", "variable", "index", "loop", "size"]


@dataclass(eq=False, repr=False, slots=True)
class Local:
    """A name that is bound inside a definition. `known`: its value is a function whose parameters have names.

    `value` is what a local name was bound to (the whole right side), for messages and for names of conditions.
    `of_lambda`: a parameter of a lambda, not of a definition.
    """

    name: str
    span: Span
    kind: LocalKind
    type: Type
    generic: tuple[Meta, ...] = ()
    known: bool = False
    value: nodes.Expr | None = None
    used: bool = False
    of_lambda: bool = False


class InterfaceName(Struct, frozen=True):
    """Another definition, through its interface."""

    target: DefinitionTarget
    interface: Interface


class RecursiveName(Struct, frozen=True):
    """A definition of the group that is inferred right now: recursion."""

    target: DefinitionTarget


class BuiltinName(Struct, frozen=True):
    """A builtin, a constant or one of the special forms."""

    name: str


class ModuleName(Struct, frozen=True):
    """A module's name, which is not a value."""

    name: str


Meaning = Local | InterfaceName | RecursiveName | BuiltinName | ModuleName


@dataclass(eq=False, repr=False)
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
            return _builtin(name)
        return found


@cache
def _builtin(name: str) -> BuiltinName:
    return BuiltinName(name)


def builtin_names() -> tuple[str, ...]:
    """All builtin names that programs may write."""
    return (*CONSTANTS, *SPECIALS, *PROJECTIONS, *VECTORS, *(p.name for p in PRIMITIVES.values() if p.surface))


class Scope:
    """The local names in scope, innermost first."""

    def __init__(self) -> None:
        self.names: dict[str, Local] = {}

    def find(self, name: str) -> Local | None:
        return self.names.get(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def inside(self) -> Inside:
        """What is bound in a `with` block is forgotten at its end."""
        return Inside(self)

    def bind(self, local: Local) -> None:
        self.names[local.name] = local

    def unbind(self, name: str) -> None:
        self.names.pop(name, None)


class Inside:
    """A block of a scope; a class of its own, as one that is made of a generator takes three times as long."""

    __slots__ = ("_before", "_scope")

    def __init__(self, scope: Scope) -> None:
        self._scope, self._before = scope, scope.names

    def __enter__(self) -> None:
        self._scope.names = dict(self._before)

    def __exit__(self, *raised: object) -> None:
        self._scope.names = self._before


def undefined(outside: Outside, scope: Iterable[str], node: nodes.Name) -> Diagnostic | None:
    """What is said of a name that means nothing here; nothing if an import that fails has been reported for it."""
    name = node.id
    if meaning(outside.db, outside.file, name) is not None:
        return None
    if name == "print":
        return NOT_DEFINED(
            node.span,
            "`print` is a statement, not a function",
            label="only at the top of a script",
            help="write `print(…)` at the top of a script, in a line of its own",
        )
    near = near_names(name, (*scope, *_near_at_top(outside.db, outside.file, name)))
    told_of_name = _as_measure(name) or _as_type(name) or known_elsewhere(name)
    help = told_of_name or did_you_mean(near)
    module = elsewhere(outside.db, outside.file, name)
    if module is not None:
        help = f"the module `{module}` defines it: add `from {module} import {name}`"
    told = bool(told_of_name) or module is not None
    meant = called_here(name) or (() if told else near)
    return NOT_DEFINED(
        node.span, f"`{name}` is not defined", label="not defined here", help=help,
        suggestions=instead(node.span, meant),
    )  # fmt: skip


def _as_measure(name: str) -> str:
    """What to write where a measure stands for a number, or for a function."""
    if name not in MEASURES:
        return ""
    return f"a measure stands among the bounds of an integral: `integral (x ~ {name}(…)) body d(x)`"


def _as_type(name: str) -> str:
    """Where a type goes, of one that stands where a number is expected: `def f(c): Real`."""
    if name not in ("Real", "Dist", "Diffeo"):
        return ""
    return f"`{name}` is a type; that of a result stands after an arrow: `def f(c: Real) -> Real`"


def undefined_member(outside: Outside, scope: Scope, node: nodes.Member) -> Diagnostic | None:
    """What is said of `module.name` where there is no such module, or nothing of that name in it."""
    head, db, file = node.path.partition(".")[0], outside.db, outside.file
    found = scope.find(head)
    if found is not None and found.kind == "parameter" and node.path == head:
        meant = _records_with(outside, node.name) or ([] if found.of_lambda else _tuples_with(node.name))
        if meant:
            return _not_annotated(node, found, meant)
    local = found is not None
    module = None if local else resolve_module(db, file, node.path)
    if module is not None:
        near = near_names(node.name, names(db, module))
        message = f"the module `{node.path}` defines no `{node.name}`"
        return NOT_DEFINED(
            node.name_span, message, label="not defined there",
            help=did_you_mean([f"{node.path}.{name}" for name in near]), suggestions=instead(node.name_span, near),
        )  # fmt: skip
    bound = None if local else (meaning(db, file, node.path) or meaning(db, file, head))
    if isinstance(bound, DefinitionBinding):
        return _no_module(node, f"`{head}` is a definition, not a module")
    if bound is not None:
        return None
    if find_module(db, file, node.path) is not None and not local:
        return _no_module(node, f"the module `{node.path}` is not imported", f"add `import {node.path}`")
    return _no_module(node, f"`{head}` is not a module" if local else f"there is no module `{node.path}` here")


def _records_with(outside: Outside, field: str) -> list[str]:
    """The records of the file that have a field of this name."""
    found = []
    for name in names(outside.db, outside.file):
        item = definition(outside.db, outside.file, name)
        result = item.result if isinstance(item, nodes.Definition) else None
        if isinstance(result, nodes.NamedType) and result.name == name and isinstance(item, nodes.Definition):
            found += [name] * any(parameter.name == field for group in item.groups for parameter in group)
    return found


def _tuples_with(part: str) -> list[str]:
    """The shortest tuple that has a part of this name, as a type."""
    place = place_of(part)
    return [] if place is None else [f"({', '.join(['Real'] * max(place + 1, 2))})"]


def _not_annotated(node: nodes.Member, local: Local, types: list[str]) -> Diagnostic:
    """What is said of a part of a parameter that may be anything. types: what it may be meant to be. In a
    lambda that is written in parentheses, which may not be there."""
    behind = Span(local.span.end, local.span.end)
    edits = [Suggestion(f"Write `{node.path}: {type}`", (Replacement(behind, f": {type}"),)) for type in types]
    written = f"{node.path}: {types[0]}"
    what = "how many parts `{}` has" if types[0].startswith("(") else "which record `{}` is"
    return NOT_DEFINED(
        node.path_span,
        f"it is not known {what.format(node.path)}, so `{node.path}.{node.name}` is not defined",
        label="any number", related=(Related(local.span, "said here with its type"),),
        help=f"say what it is: `\\({written}) . …`" if local.of_lambda else f"say what it is: `{written}`",
        suggestions=() if local.of_lambda else tuple(edits),
    )  # fmt: skip


def _no_module(node: nodes.Member, what: str, help: str = "") -> Diagnostic:
    if not help and is_builtin(node.name) and not what.startswith(f"`{node.path}`"):
        help = f"`{node.name}` is a builtin: write it without `{node.path}.`"
    if not help and what.startswith(f"`{node.path}`"):
        help = known_elsewhere(node.name)
    if not help and "." not in node.path:
        help = f"for a further parameter of a function, put blanks around the dot: `{node.path} . {node.name}`"
    message = f"{what}, so `{node.path}.{node.name}` is not defined"
    return NOT_DEFINED(node.path_span, message, label="not a module", help=help)


@query(keep=256)
def _near_at_top(db: Database, file: str, name: str) -> tuple[str, ...]:
    """The names at the top of a file, and the builtins, that `name` may have been meant to be. A query, since an import
    that goes leaves the same name undefined in many definitions."""
    return near_names(name, (*names_at_top(db, file), *builtin_names()))


def names_at_top(db: Database, top: str) -> tuple[str, ...]:
    """The names at the top of a file, and behind an entry of a prompt those of the entries before."""
    found: list[str] = []
    for file in (top, *preludes(db, top)):
        found += names(db, file)
        for item in imports(db, file):
            if isinstance(item, nodes.Import):
                found.append(item.alias or item.module)
            else:
                found.extend(imported.alias or imported.name for imported in item.names)
    return tuple(found)
