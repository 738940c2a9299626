"""What is looked up between the places of a lattice: a sum of elements, each times a tent around its place.

Owns `middle` and `by_cells`. Tents bend at every place, and there are many. Between two places only two of them are
not 0, and what is looked up is a polynomial. So an integral along which a look-up walks from place to place becomes a
sum of integrals, each from one place to the next: as a rule few of all, and without kinks.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from msgspec import Struct

from potto.calculus.algebra.affine import affine
from potto.core.binders import apart
from potto.core.terms import (
    ONE,
    ZERO,
    Integral,
    Prim,
    Sum,
    Term,
    add,
    apply,
    array,
    bound_names,
    const,
    div,
    fresh,
    if_,
    index,
    integral,
    mul,
    neg,
    postorder,
    prim,
    sub,
    substitute,
    sum_,
    transform,
    var,
)

REACH = 4  # places around the middle of tents, beyond which they are 0, however that is rounded


@lru_cache(maxsize=4096)
def middle(term: Sum) -> Term | None:
    """Around which place the tent stands that the terms of a sum are in proportion to; None if there is none."""
    body = term.body
    for factor in body.args if isinstance(body, Prim) and body.op == "mul" else (body,):
        if isinstance(factor, Prim) and factor.op == "tent":
            found = substitute(factor.args[0], {term.variable: ZERO})
            if sub(found, var(term.variable)) is factor.args[0]:
                return found
    return None


class Walk(Struct, frozen=True):
    """A look-up along a variable: at the place `slope * x + start`, kept between 0 and `last`."""

    middle: Term
    variable: str
    slope: Term
    start: Term
    last: Term

    def place(self, x: Term) -> Term:
        return add(mul(self.slope, x), self.start)

    def cell(self, place: Term) -> Term:
        """The number of a cell; that before the first and that behind the last have no end."""
        return apply("clamp", place, const(-1), self.last)


def by_cells(term: Integral) -> Term:
    """An equal term: sums over the cells of lattices, around integrals over each, where bounds and lattices let that
    be. Otherwise the integral as it is."""
    varying = frozenset(name for node in postorder(term) for name in bound_names(node))
    found = transform(term, lambda _, new: _by_cells(new, varying) if isinstance(new, Integral) else new)
    return found if found is term else apart(found)


def _by_cells(term: Integral, varying: frozenset[str]) -> Term:
    walk = _walk(term, varying)
    if walk is None:
        return term
    step = fresh("cell", varying | term.free)
    number = term.variables.index(walk.variable)
    low, high = term.bounds[number]
    rising, count, begin = _course(walk, low, high)
    cell = _exact(add(begin, if_(rising, var(step), neg(var(step)))), walk.last)

    def border(up: Term) -> Term:
        return div(sub(add(cell, up), walk.start), walk.slope)

    first, last = prim("eq", var(step), ZERO), prim("eq", var(step), count)
    bounds = list(term.bounds)
    bounds[number] = (
        if_(first, low, border(if_(rising, ZERO, ONE))),
        if_(last, high, border(if_(rising, ONE, ZERO))),
    )
    inside = integral(term.variables, tuple(bounds), _inside(term.body, walk, cell), term.hints)
    return sum_(step, ZERO, count, _by_cells(inside, varying | {step}))


def _course(walk: Walk, low: Term, high: Term) -> tuple[Term, Term, Term]:
    """Whether places rise on the way, how many borders between cells are crossed, and the cell that it begins in."""
    ends = [(walk.cell(apply("floor", place)), walk.cell(sub(apply("ceil", place), ONE)))
            for place in (walk.place(low), walk.place(high))]  # fmt: skip
    (above, below), (above_last, below_last) = ends  # of a place on a border the cell above it, and that below
    rising = prim("le", above, above_last)
    up, down = sub(below_last, above), sub(below, above_last)
    return rising, apply("max", ZERO, if_(rising, up, down)), if_(rising, above, below)


def _exact(place: Term, last: Term) -> Term:
    """A whole number from -1 to `last`, without what rounding may have done to what it was found from."""
    slot = fresh("i", place.free | last.free)
    return index(array(slot, add(last, const(2)), sub(var(slot), ONE)), add(place, ONE))


def _walk(term: Integral, varying: frozenset[str]) -> Walk | None:
    """A look-up in an integrand along a variable with plain bounds, at places in proportion to it."""
    for node in postorder(term.body):
        if not isinstance(node, Sum) or node.lo is not ZERO:
            continue
        at = middle(node)
        if not isinstance(at, Prim) or at.op != "clamp" or at.args[1:] != (ZERO, node.hi):
            continue
        own = at.free & varying
        if len(own) != 1 or not own <= set(term.variables):
            continue
        (variable,) = own
        low, high = term.bounds[term.variables.index(variable)]
        if not varying.isdisjoint(low.free | high.free):
            continue
        found = affine(at.args[0], (variable,))
        if found is not None:
            return Walk(at, variable, found.coefficients[0], found.rest, node.hi)
    return None


def _inside(body: Term, walk: Walk, cell: Term) -> Term:
    """An integrand where the look-up is in one cell: between its two elements."""
    near, far = apply("max", cell, ZERO), apply("min", add(cell, ONE), walk.last)
    into = sub(walk.place(var(walk.variable)), cell)

    def change(_: Term, new: Term) -> Term:
        if not isinstance(new, Sum) or middle(new) is not walk.middle or new.hi is not walk.last:
            return new
        read = _read(new)
        return add(read(near), mul(into, sub(read(far), read(near))))

    return transform(body, change)


def _read(term: Sum) -> Callable[[Term], Term]:
    """What stands beside the tent, at a place."""
    body = term.body
    factors = body.args if isinstance(body, Prim) and body.op == "mul" else (body,)
    rest = mul(*(f for f in factors if not (isinstance(f, Prim) and f.op == "tent" and term.variable in f.free)))
    return lambda place: substitute(rest, {term.variable: place})
