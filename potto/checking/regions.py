"""The integrals of a function as regions that can be drawn: bounds, integrand, and what its surfaces do.

Owns `regions` and `indices`. Everything is a term over the function's parameters, indices and the variables of
integration, so that numbers come from whoever evaluates programs. What a surface gains is its jump, from its negative
to its positive side, times its rate: how fast its condition grows as the chosen parameter does.
"""

from __future__ import annotations

import re

from msgspec import Struct

from potto.calculus.differentiation.boundary_terms import jumps
from potto.calculus.differentiation.dual import Differentiator
from potto.calculus.explanation.continuity import continuous
from potto.calculus.explanation.notation import Notation
from potto.calculus.explanation.plain_names import apart, plainly_named
from potto.calculus.solving.pivots import Roots
from potto.checking.written_out import carried_out
from potto.core.simplify import simplify
from potto.core.terms import (
    ONE,
    ZERO,
    App,
    Array,
    Branch,
    Delta,
    If,
    Integral,
    Lam,
    Proj,
    Sum,
    Term,
    Tuple,
    branch,
    children,
    if_,
    lam,
    postorder,
    proj,
    stem,
    sub,
    substitute,
    transform,
    var,
    with_integrand,
)
from potto.elaborate import core
from potto.query import Database

_COPY = re.compile(r"'\d+")  # the mark of a copy of a bound variable


class RegionSurface(Struct, frozen=True):
    """A surface: its equation, and as functions its condition, its rate, how that grows along each variable, and the
    jump of the integrand where the condition turns positive; that is None where a delta is, whose height has no end."""

    equation: str
    level: Lam
    rate: Lam
    slopes: tuple[Lam, ...]
    jump: Lam | None


class OuterIndex(Struct, frozen=True):
    """An index around an integral, and its first and last number, functions of the parameters and earlier indices."""

    name: str
    first: Lam
    last: Lam


class DrawnIntegral(Struct, frozen=True):
    """An integral of a number: all terms are functions of `names`, the parameters and indices and then the variables.

    bounds, rates: of each variable from and to, and how fast these move. A bound may depend on the variables before it.
    whole, interior: functions of parameters and indices alone, the integral and what it gains while surfaces and bounds
    stand still. integrand: without deltas.
    """

    names: tuple[str, ...]
    variables: tuple[str, ...]
    bounds: tuple[tuple[Lam, Lam], ...]
    rates: tuple[tuple[Lam, Lam], ...]
    integrand: Lam
    whole: Lam
    interior: Lam
    surfaces: tuple[RegionSurface, ...]
    unseen: bool  # whether there are others, of conditions in sums


def regions(db: Database, term: Term, wrt: str, notation: Notation) -> tuple[DrawnIntegral, ...]:
    """The outermost integrals of a function, in order; `wrt` is the parameter that moves. Of one that is a tuple there
    is a region for each number; surfaces are told in the `notation`.

    One in a sum or an array is a region for each choice of its `indices`. What depends on the state of a fold is left
    out. Raises PottoError where an integrand has no derivative in symbols.
    """
    params, found, around = _outermost(db, term)
    work = Differentiator(lambda g: core(db, g.module, g.name).term, wanted=Roots.ALL)
    names = (*params, *(index.name for index in around))
    return tuple(_region(part, names, work, wrt, notation) for node in found for part in _numbers(node))


def indices(db: Database, term: Term) -> tuple[OuterIndex, ...]:
    """The indices that the integrals of a function depend on, outer ones first."""
    return _outermost(db, term)[2]


def _outermost(db: Database, term: Term) -> tuple[tuple[str, ...], list[Integral], tuple[OuterIndex, ...]]:
    """The parameters of a function, its integrals that are in no other one, and the indices that these depend on. Where
    one number of a tuple is used, the integral is of this number. Indices with the same name and range are the same."""
    params, whole = carried_out(db, term)
    around: dict[tuple[str, Term, Term], str] = {}
    found: dict[Integral, None] = {}
    stack, seen = [whole], set[Term]()
    while stack:
        node = stack.pop()
        if node in seen:
            continue
        seen.add(node)
        of = node.term if isinstance(node, Proj) else node
        if isinstance(node, Proj) and isinstance(of, Integral):
            found[with_integrand(of, _part(of.body, node.index))] = None
        elif isinstance(node, Integral):
            found[node] = None
        elif isinstance(node, Sum | Array):
            low, high = (ZERO, sub(node.size, ONE)) if isinstance(node, Array) else (node.lo, node.hi)
            written = stem(node.variable)
            name = around.setdefault((written, low, high), apart(written, {*params, *around.values()}))
            stack += [substitute(node.body, {node.variable: var(name)}), high, low]
        else:
            stack.extend(reversed(children(node)))
    known = {*params, *around.values()}
    closed = [node for node in found if node.free <= known]
    needed = set[str]().union(*(node.free for node in closed))
    kept: list[OuterIndex] = []
    for (_, low, high), name in reversed(around.items()):
        if name in needed and low.free | high.free <= known:
            needed |= low.free | high.free
            before = (*params, *(n for n in around.values() if n in low.free | high.free))
            kept.append(OuterIndex(name, lam(before, low), lam(before, high)))
    names = {*params, *(index.name for index in kept)}
    return tuple(params), [node for node in closed if node.free <= names], tuple(reversed(kept))


def _numbers(node: Integral) -> list[Integral]:
    """An integral of a tuple as those of its numbers."""
    width = _width(node.body)
    return [with_integrand(node, _part(node.body, place)) for place in range(width)] if width else [node]


def _width(term: Term) -> int:
    """Of how many numbers a term is a tuple; 0 if it is a number."""
    while isinstance(term, If | Branch):
        term = term.then
    return len(term.items) if isinstance(term, Tuple) else 0


def _part(term: Term, place: int) -> Term:
    """A number of a tuple, taken inside of what decides between tuples."""
    if isinstance(term, If):
        return if_(term.condition, _part(term.then, place), _part(term.orelse, place))
    if isinstance(term, Branch):
        return branch(term.coordinates, term.strict, _part(term.then, place), _part(term.orelse, place))
    return proj(term, place)


def _region(
    node: Integral, params: tuple[str, ...], work: Differentiator, wrt: str, notation: Notation
) -> DrawnIntegral:
    node = plainly_named(node, params)
    names = (*params, *node.variables)

    def over(term: Term, names: tuple[str, ...] = names) -> Lam:
        return lam(names, simplify(term))

    def along(term: Term, name: str) -> Term:
        return work.dual(term, {name: ONE})[1]

    def surface(level: Term, jump: Lam | None) -> RegionSurface:
        where = _COPY.sub("", notation.equation(simplify(level), node.variables))
        slopes = tuple(over(along(level, name)) for name in node.variables)
        return RegionSurface(where, over(level), over(along(level, wrt)), slopes, jump)

    deltas = dict.fromkeys(part.coordinates[0] for part in postorder(node.body) if isinstance(part, Delta))
    drawn = with_integrand(node, transform(node.body, lambda _, new: ZERO if isinstance(new, Delta) else new))
    met = list(jumps(drawn.body, node.variables, lambda term: ONE))
    seen = [i for i in met if not i.sums and not any(isinstance(inner, App) for inner in postorder(i.surface))]
    found = [surface(i.surface, over(ZERO if continuous(i, node.variables) else i.jump)) for i in seen]
    return DrawnIntegral(
        names,
        node.variables,
        tuple((over(low), over(high)) for low, high in node.bounds),
        tuple((over(along(low, wrt)), over(along(high, wrt))) for low, high in node.bounds),
        over(drawn.body),
        over(node, params),
        over(with_integrand(drawn, along(drawn.body, wrt)), params),
        (*found, *(surface(level, None) for level in deltas)),
        len(seen) < len(met),
    )
