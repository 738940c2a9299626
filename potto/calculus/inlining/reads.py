"""What integrands and steps of folds read of arrays at plain places, found once beside the integral or the fold.

Owns `hoisted` and `beside`.
"""

from __future__ import annotations

from functools import lru_cache

from msgspec import Struct

from potto.calculus.inlining.arrays import ARRAYS, bound
from potto.core.terms import (
    ZERO,
    App,
    Branch,
    Holding,
    If,
    Index,
    Integral,
    Proj,
    Sum,
    Term,
    Var,
    children,
    fresh,
    if_,
    index,
    postorder,
    prim,
    transform,
    var,
)


class Access(Struct, frozen=True):
    """What is found beside an integral: the name under which the integrand has it, and the term."""

    name: str
    term: Term


@lru_cache(maxsize=1024)
def hoisted(term: Integral) -> tuple[Integral, tuple[Access, ...]]:
    """The integral with what it reads of arrays at plain places under names of its own.

    What stands on one side of a plain condition is read only where that holds.
    """
    found, accesses = beside(term, frozenset())
    assert isinstance(found, Integral)
    return found, accesses


@lru_cache(maxsize=1024)
def beside(term: Term, varying: frozenset[str]) -> tuple[Term, tuple[Access, ...]]:
    """A term with what it reads of arrays under names of its own, where these places hold nothing that varies, and
    nothing that is bound in it."""
    inside, arrays = varying | frozenset(bound(term)), Holding(*ARRAYS)
    guards: dict[Term, list[tuple[Term, ...]]] = {}
    _gather(term, (), inside, arrays, guards)
    called = {node.function for node in postorder(term) if isinstance(node, App)}
    names, taken = dict[Term, Term](), set(term.free | inside)
    accesses: list[Access] = []
    for node, ways in guards.items():
        name = fresh(_stem(node), taken)
        taken.add(name)
        names[node] = var(name)
        accesses.append(Access(name, _guarded(node, ways, node in called)))
    found = transform(
        term, lambda node, new: names.get(node, new), lambda node: () if node in names else children(node)
    )
    return found, tuple(accesses)


def _gather(
    root: Term, guard: tuple[Term, ...], inside: frozenset[str], arrays: Holding,
    found: dict[Term, list[tuple[Term, ...]]],
) -> None:  # fmt: skip
    """Note what is read under these conditions. Recursion only at plain conditionals."""
    waiting, seen = [root], set[Term]()
    while waiting:
        node = waiting.pop()
        if node in seen or not arrays(node):
            continue
        seen.add(node)
        plain = inside.isdisjoint(node.free)
        if plain and isinstance(node, (*ARRAYS, Proj, Sum, If, Branch)):
            found.setdefault(node, []).append(guard)
        elif isinstance(node, If | Branch) and (condition := _condition(node, inside)) is not None:
            _gather(node.then, (*guard, condition), inside, arrays, found)
            _gather(node.orelse, (*guard, prim("not", condition)), inside, arrays, found)
            waiting += children(node)[:-2]
        else:
            waiting += children(node)


def _condition(node: If | Branch, inside: frozenset[str]) -> Term | None:
    """The plain condition under which the first side is taken, if it is plain."""
    if isinstance(node, If):
        return node.condition if inside.isdisjoint(node.condition.free) else None
    if not inside.isdisjoint(node.surface.free):
        return None
    return prim("lt" if node.strict else "le", ZERO, node.surface)


def _guarded(node: Term, ways: list[tuple[Term, ...]], called: bool) -> Term:
    """What is read where it is needed; elsewhere 0, or the first function of those that one is called of."""
    if () in ways:
        return node
    conditions = [way[0] if len(way) == 1 else prim("and", *way) for way in ways]
    needed = conditions[0] if len(conditions) == 1 else prim("or", *conditions)
    if not called:
        return if_(needed, node, ZERO)

    def guarded(_: Term, new: Term) -> Term:
        return index(new.array, if_(needed, new.index, ZERO)) if isinstance(new, Index) else new

    return transform(node, guarded)


def _stem(node: Term) -> str:
    """What a read is called: after the array."""
    while not isinstance(node, Var):
        below = children(node)
        if not below:
            return "data"
        node = below[0]
    return node.name.split("@")[0]
