"""Integrals over level sets: of f delta(psi), where psi = 0 has no closed form along any variable.

Owns `level_set` (what such an integral is made of), `spread` (how numbers integrate it) and `transported` (how it moves
with the parameters). Along a variable p the integral is the sum of f/|dpsi/dp| over the roots of psi in p, which is
infinite where the level set turns back along p. So each variable p gets the part (dpsi/dp)^2/|grad psi|^2 of it: the
parts add up to all of it, and each vanishes where its variable is the wrong one (a partition of unity by the normal).

The derivative follows from that of the delta, delta'(psi) = grad psi . grad delta(psi)/|grad psi|^2, by parts:

    D int f delta(psi) = int (D f - div(f v)) delta(psi) + sum of int [f] (D phi - v.grad phi) delta(phi) delta(psi)

with v = D psi grad psi/|grad psi|^2, summed over the surfaces phi at which f jumps, the bounds among them; where psi
has a kink v jumps as well, and [f (D phi - v.grad phi)] counts. It is the implicit function theorem: -v is how the
level set moves along its normal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache

from msgspec import Struct

from potto.calculus.algebra.ranges import range_of
from potto.calculus.differentiation.between import finite, scaled
from potto.calculus.differentiation.boundary_terms import Rate, jumps, remaining
from potto.calculus.differentiation.derivative import NotSmooth, partial, total, vanishes, zero_like
from potto.calculus.solving.enclosable import searchable
from potto.calculus.solving.pivots import NoClosedForm
from potto.calculus.solving.solve import Sections, sections
from potto.calculus.surfaces.branch_assignment import box_of
from potto.core.terms import (
    ONE,
    ZERO,
    Delta,
    Integral,
    Term,
    Var,
    add,
    const,
    delta,
    div,
    fresh,
    integral,
    mul,
    neg,
    postorder,
    pow_,
    prim,
    reordered,
    replaced,
    sub,
    substitute,
    var,
    with_integrand,
)

Slope = Callable[[Term, str], Term]


class LevelSet(Struct, frozen=True):
    """The integral of `factor` over `surface = 0`, along `shares[0]` if numbers are to integrate it.

    shares: the variables among which it is divided.
    """

    factor: Term
    surface: Term
    shares: tuple[str, ...] = ()

    @property
    def weight(self) -> Term:
        """What is added up over the roots along `shares[0]`: of the factor this variable's part, over the slope."""
        slopes = [partial(self.surface, name) for name in self.shares]
        size = prim("abs", slopes[0])
        if len(slopes) == 1:
            return scaled(self.factor, div(ONE, size))
        return scaled(self.factor, div(size, _squared(slopes)))

    def standing(self, node: Integral, rate: Rate) -> list[Term]:
        """The derivative of the integral where the level set stands still."""
        moved = rate(self.factor)
        return [] if vanishes(moved) else [with_integrand(node, scaled(moved, delta((self.surface,))))]


def steep(surface: Term) -> Delta:
    """The derivative of the delta of a surface."""
    return delta((surface, ZERO))


def is_steep(what: Delta) -> bool:
    return what.coordinates[1:] == (ZERO,)


def _squared(slopes: list[Term]) -> Term:
    return add(*(pow_(slope, const(2.0)) for slope in slopes))


def deltas_over(node: Integral) -> list[Delta]:
    """The deltas in an integrand that an integral's own variables place."""
    own = frozenset(node.variables)
    parts = postorder(node.body)
    inside = frozenset().union(*(part.variables for part in parts if isinstance(part, Integral)))
    return [
        part
        for part in parts
        if isinstance(part, Delta) and part.coordinates[0].free & own and not part.coordinates[0].free & inside
    ]


def coefficient(body: Term, what: Term) -> tuple[Term, Term] | None:
    """f and g of f what + g; None where it is not linear in what, a delta or a sum of such. Raises NoClosedForm."""
    hidden = fresh("delta", {n for t in postorder(body) for n in t.free})
    opened = replaced(body, {what: var(hidden)})
    try:
        factor = partial(opened, hidden)
    except NotSmooth as problem:
        raise NoClosedForm("a delta is given to a function that is not known") from problem
    return None if hidden in factor.free else (factor, substitute(opened, {hidden: ZERO}))


@lru_cache(maxsize=4096)
def level_set(node: Integral) -> LevelSet | None:
    """What an integral is made of whose integrand is something times one delta."""
    found = deltas_over(node)
    if len(found) != 1 or is_steep(found[0]):
        return None
    try:
        parts = coefficient(node.body, found[0])
    except NoClosedForm:
        return None
    if parts is None or not vanishes(parts[1]):
        return None
    surface, *marks = found[0].coordinates
    shares = tuple(mark.name for mark in marks[1:] if isinstance(mark, Var)) if marks and marks[0] is ONE else ()
    return LevelSet(parts[0], surface, shares)


# For numbers


def spread(node: Integral, known: LevelSet) -> list[Integral]:
    """The integral as several, each along its innermost variable. Raises NoClosedForm."""
    ways = [way for name in node.variables if name in known.surface.free for way in _along(node, known, name)]
    if not ways:
        raise NoClosedForm("its surface can be searched for along none of the variables of integration")
    names = tuple(way.variables[-1] for way in ways)
    marked: list[Integral] = []
    for name, way in zip(names, ways, strict=True):
        others = [other for other in names if other != name]
        inner = level_set(way)
        assert inner is not None
        body = scaled(inner.factor, delta((known.surface, ONE, *map(var, (name, *others)))))
        marked.append(with_integrand(way, body))
    return marked


def _along(node: Integral, known: LevelSet, name: str) -> Iterator[Integral]:
    """The integral with a variable innermost along which the level set can be found, if there is a way."""
    if not _found_along(node, known.surface, name):
        return
    position = node.variables.index(name)
    order = [*range(position), *range(position + 1, len(node.variables)), position]
    if not any(name in bound.free for pair in node.bounds[position + 1 :] for bound in pair):
        yield reordered(node, order)
    elif not known.surface.free & frozenset(node.variables[position + 1 :]):
        later, here = slice(position + 1, None), slice(position + 1)
        inner = integral(node.variables[later], node.bounds[later], known.factor, node.hints[later])
        body = scaled(inner, delta((known.surface,)))
        yield integral(node.variables[here], node.bounds[here], body, node.hints[here])


def _found_along(node: Integral, surface: Term, name: str) -> bool:
    try:
        slope = partial(surface, name)
    except NotSmooth:
        return False
    found = sections(surface, name)
    bounds = range_of(slope, box_of(node))
    closed = isinstance(found, Sections) and found.complete
    return closed or searchable(surface, name) or bounds.positive or bounds.negative


# How they move


def transported(node: Integral, known: LevelSet, rate: Rate, slope: Slope) -> list[Term]:
    """The derivative of an integral over a level set.

    rate: the tangent of a term as the parameters move. slope: that as one variable of integration does.
    """
    surface, factor = known.surface, known.factor
    own = [name for name in node.variables if name in surface.free]
    slopes = {name: slope(surface, name) for name in own}
    speed = div(rate(surface), _squared(list(slopes.values())))
    velocity = {name: mul(speed, slopes[name]) for name in own}

    def swept(term: Term) -> Term:
        """How fast a surface crosses the level set: the rate of a term along with it."""
        along = (mul(slope(term, name), v) for name, v in velocity.items() if name in term.free)
        return sub(rate(term), add(*along))

    here = delta((surface,))
    inside = [rate(factor), *(_negative(slope(scaled(factor, v), name)) for name, v in velocity.items())]
    whole = total([part for part in inside if not vanishes(part)], zero_like(factor))
    found: list[Term] = [] if vanishes(whole) else [with_integrand(node, scaled(whole, here))]
    for item in jumps(factor, node.variables, swept, tuple(velocity.values())):
        found.append(with_integrand(node, scaled(item.contribution, here)))
    if len(node.variables) > 1:
        found += _at_bounds(node, scaled(factor, here), swept, velocity)
    return found


def by_parts(node: Integral, what: Delta, factor: Term) -> list[Term]:
    """The integral of a factor times the derivative of a delta: how that of f delta(psi + s) moves with s."""
    step = fresh("step", {n for t in postorder(node) for n in t.free} | set(node.variables))
    surface = add(what.coordinates[0], var(step))

    def rate(term: Term) -> Term:
        return partial(term, step)

    moved = transported(node, LevelSet(factor, surface), rate, partial)
    return [substitute(term, {step: ZERO}) for term in moved]


def _negative(term: Term) -> Term:
    return scaled(term, neg(ONE))


def _at_bounds(node: Integral, body: Term, swept: Rate, velocity: Mapping[str, Term]) -> Iterator[Term]:
    """What the level set gains and loses where it meets the bounds."""
    for name, (lo, hi) in zip(node.variables, node.bounds, strict=True):
        for bound, sign in ((hi, ONE), (lo, neg(ONE))):
            crossing = add(swept(bound), velocity.get(name, ZERO))
            if finite(bound) and crossing is not ZERO:
                gain = substitute(scaled(body, mul(sign, crossing)), {name: bound})
                yield remaining(node, name, bound, gain)


@lru_cache(maxsize=4096)
def placed_along(node: Integral) -> LevelSet | None:
    """A level set that `spread` has made ready for numbers."""
    known = level_set(node)
    return known if known is not None and known.shares else None
