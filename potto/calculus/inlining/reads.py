"""What is found once beside an integral or a fold: what integrands and steps read of arrays at plain places, and what
other integrals give.

Owns `hoisted`, `beside`, `found_once` and `with_numbers_named`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache

from msgspec import Struct

from potto.calculus.inlining.arrays import ARRAYS, bound
from potto.core.terms import (
    ZERO,
    App,
    Branch,
    Delta,
    Global,
    Holding,
    If,
    Index,
    Integral,
    Prim,
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
    inside, reads = varying | frozenset(bound(term)), (*ARRAYS, Proj, Sum, If, Branch)
    return _named(term, inside, Holding(*ARRAYS), lambda node: isinstance(node, reads))


def found_once(term: Integral, integrals: Callable[[Term], bool], everywhere: bool) -> tuple[Term, tuple[Access, ...]]:
    """An integral with the numbers under names of their own that other integrals give, and that its conditions compare
    something with: a surface has to be enclosed, or solved for a variable.

    integrals: whether a term leads to any. everywhere: those as well that the integrand is computed from wherever it
    is, since it is evaluated many times.
    """
    inside = frozenset(bound(term))
    numbers = set(_numbers(term.body)) if everywhere else set()
    numbers |= {
        part
        for node in postorder(term)
        if isinstance(node, Branch | Delta) and integrals(node)
        for coordinate in node.coordinates
        if not inside.isdisjoint(coordinate.free)
        for part in _numbers(coordinate)
    }
    return _named(term, inside, integrals, numbers.__contains__) if numbers else (term, ())


def with_numbers_named(surface: Term, variables: Iterable[str]) -> Term:
    """A condition's coordinate as its integral meets it: what does not vary with the variables of integration, and is
    found by calls or integrals, has a name."""
    inside = frozenset(variables).union(bound(surface))
    return _named(surface, inside, Holding(Integral, App, Global), set(_numbers(surface)).__contains__)[0]


def _numbers(coordinate: Term) -> Iterator[Term]:
    """A coordinate of a condition, and the numbers that it is computed from."""
    return iter(postorder(coordinate, below=lambda node: children(node) if isinstance(node, Prim) else ()))


def _named(
    term: Term, inside: frozenset[str], wanted: Callable[[Term], bool], takes: Callable[[Term], bool]
) -> tuple[Term, tuple[Access, ...]]:
    """A term with the largest parts under names of their own that are taken and don't vary with what is inside; wanted:
    whether there can be such below."""
    guards: dict[Term, list[tuple[Term, ...]]] = {}
    _gather(term, (), inside, wanted, takes, guards)
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
    root: Term, guard: tuple[Term, ...], inside: frozenset[str], wanted: Callable[[Term], bool],
    takes: Callable[[Term], bool], found: dict[Term, list[tuple[Term, ...]]],
) -> None:  # fmt: skip
    """Note what is taken under these conditions. Recursion only at plain conditionals."""
    waiting, seen = [root], set[Term]()
    while waiting:
        node = waiting.pop()
        if node in seen or not wanted(node):
            continue
        seen.add(node)
        if inside.isdisjoint(node.free) and takes(node):
            found.setdefault(node, []).append(guard)
        elif isinstance(node, If | Branch) and (condition := _condition(node, inside)) is not None:
            _gather(node.then, (*guard, condition), inside, wanted, takes, found)
            _gather(node.orelse, (*guard, prim("not", condition)), inside, wanted, takes, found)
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
    """What is found beside is called: after the array, or the name that it has."""
    while not isinstance(node, Var):
        if isinstance(node, Global):
            return node.name
        below = children(node)
        if not below:
            return "data"
        node = below[0]
    return node.name.split("@")[0]
