"""What expressions elaborate to: core terms, and functions that are known so well that no term is made of them yet.

Owns `Value` and `Groups`. A `LocalFunction` is a local function: its text and the names around it, so that applying it
is elaborating its body, with no substitution and no capture. It becomes a `Lam` only where it is passed on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from potto.core.terms import ZERO, Term, const, index, length, proj, sub
from potto.syntax import nodes


class Slot(Struct, frozen=True):
    """One parameter as callers see it: its name, if it has one, and how many numbers make it if it is a tuple."""

    name: str | None
    dims: int | None = None


Groups = tuple[tuple[Slot, ...], ...]


class LocalFunction(Struct, frozen=True, eq=False):
    """A function written in the definition at hand. `scope` has the names around it and parameters already given.

    annotated: parameters whose types are written.
    """

    groups: tuple[tuple[str, ...], ...]
    bindings: tuple[nodes.Binding, ...]
    body: nodes.Expr
    scope: LocalNames
    annotated: tuple[nodes.Parameter, ...] = ()


class BuiltinValue(Struct, frozen=True):
    """A builtin or one of the special forms, not applied."""

    name: str


Value = Term | LocalFunction | BuiltinValue


class LocalNames(Struct, frozen=True, eq=False):
    """The local names, with what they stand for."""

    names: Mapping[str, Value]

    def bind(self, names: Mapping[str, Value]) -> LocalNames:
        return LocalNames({**self.names, **names})

    def find(self, name: str) -> Value | None:
        return self.names.get(name)


EMPTY = LocalNames({})


def annotated(groups: tuple[tuple[nodes.Parameter, ...], ...]) -> tuple[nodes.Parameter, ...]:
    """The parameters whose types are written."""
    return tuple(p for group in groups for p in group if p.annotation is not None)


def sizes(annotation: nodes.TypeExpr, value: Term) -> Iterator[tuple[str, Term]]:
    """The sizes that the type of a value names."""
    if isinstance(annotation, nodes.TupleType):
        for place, item in enumerate(annotation.items):
            yield from sizes(item, proj(value, place))
    elif isinstance(annotation, nodes.ArrayType):
        for size in annotation.sizes:
            if size.name:
                yield size.name, sub(length(value), const(float(size.offset)))
            value = index(value, ZERO)
        yield from sizes(annotation.item, value)


def counted(names: tuple[tuple[str, ...], ...]) -> Groups:
    """Groups of which only the names are known."""
    return tuple(tuple(Slot(name) for name in group) for group in names)
