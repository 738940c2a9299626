"""What is looked up between the places of a lattice: a sum of elements, each times a tent around its place.

Owns `middle`, `looks_up` and `by_cells`. Tents bend at every place, and there are many. Between two places only two of
them are not 0, and what is looked up is a polynomial. So an integral along which a look-up walks from place to place
becomes a sum of integrals, each from one place to the next: as a rule few of all, and without kinks.
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
    Branch,
    Index,
    Integral,
    Prim,
    Proj,
    Sum,
    Term,
    add,
    apply,
    array,
    bound_names,
    branch,
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
    factor = _factor(term, "tent")
    if factor is None:
        return None
    place, found = var(term.variable), substitute(factor.args[0], {term.variable: ZERO})
    if sub(found, place) is factor.args[0]:
        return found
    return neg(found) if add(place, found) is factor.args[0] else None  # it is even


class LatticeWalk(Struct, frozen=True):
    """A look-up along a variable: at the place `slope * x + start` of a lattice.

    cells: of a place on a border the cell above, and that below it. border: between a cell and the one before it, by
    its number; behind: the number of the last cell, which has no end, as that before the first, -1, has none. look: a
    sum over the lattice, where the place is in a cell; None for other sums.
    """

    variable: str
    slope: Term
    start: Term
    cells: Callable[[Term], tuple[Term, Term]]
    border: Callable[[Term], Term]
    behind: Term
    look: Callable[[Sum, Term, Term], Term | None]

    def place(self, x: Term) -> Term:
        return add(mul(self.slope, x), self.start)


def by_cells(term: Integral) -> Term:
    """An equal term: sums over the cells of lattices, around integrals over each, where bounds and lattices let that
    be. Otherwise the integral as it is."""
    varying = frozenset(name for node in postorder(term) for name in bound_names(node))
    found = transform(term, lambda _, new: _by_cells(new, varying) if isinstance(new, Integral) else new)
    return found if found is term else apart(found)


def looks_up(term: Sum) -> bool:
    """Whether a sum is one over a lattice, of what lies around a place."""
    return _factor(term, "tent") is not None or _way(term) is not None


def _by_cells(term: Integral, varying: frozenset[str]) -> Term:
    walk = _walk(term, varying)
    if walk is None:
        return term
    step = fresh("cell", varying | term.free)
    number = term.variables.index(walk.variable)
    low, high = term.bounds[number]
    rising, count, begin = _course(walk, low, high)
    cell = _exact(add(begin, if_(rising, var(step), neg(var(step)))), walk.behind)

    def border(up: Term) -> Term:
        return div(sub(walk.border(add(cell, up)), walk.start), walk.slope)

    first, last = prim("eq", var(step), ZERO), prim("eq", var(step), count)
    bounds = list(term.bounds)
    bounds[number] = (
        if_(first, low, border(if_(rising, ZERO, ONE))),
        if_(last, high, border(if_(rising, ONE, ZERO))),
    )
    inside = integral(term.variables, tuple(bounds), _inside(term.body, walk, cell), term.hints)
    return sum_(step, ZERO, count, _by_cells(inside, varying | {step}))


def _course(walk: LatticeWalk, low: Term, high: Term) -> tuple[Term, Term, Term]:
    """Whether places rise on the way, how many borders between cells are crossed, and the cell that it begins in."""
    (above, below), (above_last, below_last) = walk.cells(walk.place(low)), walk.cells(walk.place(high))
    rising = prim("le", above, above_last)
    up, down = sub(below_last, above), sub(below, above_last)
    return rising, apply("max", ZERO, if_(rising, up, down)), if_(rising, above, below)


def _exact(place: Term, last: Term) -> Term:
    """A whole number from -1 to `last`, without what rounding may have done to what it was found from."""
    slot = fresh("i", place.free | last.free)
    return index(array(slot, add(last, const(2)), sub(var(slot), ONE)), add(place, ONE))


def _walk(term: Integral, varying: frozenset[str]) -> LatticeWalk | None:
    """A look-up in an integrand along a variable with plain bounds, at places in proportion to it."""
    for node in postorder(term.body):
        if not isinstance(node, Sum) or node.lo is not ZERO:
            continue
        found = _pixels(node) or _table(node)
        own = found[0].free & varying if found else frozenset()
        if found is None or len(own) != 1 or not own <= set(term.variables):
            continue
        (variable,) = own
        low, high = term.bounds[term.variables.index(variable)]
        line = affine(found[0], (variable,))
        if line is not None and varying.isdisjoint(low.free | high.free):
            return LatticeWalk(variable, line.coefficients[0], line.rest, *found[1:])
    return None


def _inside(body: Term, walk: LatticeWalk, cell: Term) -> Term:
    """An integrand where the look-up is in one cell."""
    place = walk.place(var(walk.variable))

    def change(_: Term, new: Term) -> Term:
        found = walk.look(new, place, cell) if isinstance(new, Sum) else None
        return _without_opposites(new) if found is None else found

    return transform(body, change)


def _without_opposites(term: Term) -> Term:
    """A sum without what is read of arrays at plain places and taken away again: the first element of a table."""
    if not isinstance(term, Prim) or term.op != "add":
        return term
    kept = list(term.args)
    for arg in term.args:
        if isinstance(arg, Index | Proj) and neg(arg) in kept and arg in kept:
            kept.remove(arg)
            kept.remove(neg(arg))
    return add(*kept) if len(kept) < len(term.args) else term


# A place, its cells, their borders, the last one, and what a sum is in one
Lattice = tuple[
    Term, Callable[[Term], tuple[Term, Term]], Callable[[Term], Term], Term, Callable[[Sum, Term, Term], Term | None]
]


def _pixels(node: Sum) -> Lattice | None:
    """A lattice of whole numbers, from 0 to the last index of the sum: in a cell it is linear between two elements."""
    at, last = middle(node), node.hi
    if not isinstance(at, Prim) or at.op != "clamp" or at.args[1:] != (ZERO, last):
        return None

    def cells(place: Term) -> tuple[Term, Term]:
        ends = apply("floor", place), sub(apply("ceil", place), ONE)
        above, below = (apply("clamp", end, const(-1), last) for end in ends)
        return above, below

    def look(other: Sum, place: Term, cell: Term) -> Term | None:
        if middle(other) is not at or other.hi is not last:
            return None
        read = _beside(other, "tent")
        near, far = read(apply("max", cell, ZERO)), read(apply("min", add(cell, ONE), last))
        # In a cell at the edge both are one element; read twice, it would seem to be two, and their difference to move.
        ends = _inside_of(cell, last)
        return add(near, mul(ends, sub(place, cell), sub(far, near)))

    return at.args[0], cells, lambda cell: cell, last, look


def _table(node: Sum) -> Lattice | None:
    """A lattice of numbers that rise: in a cell a sum of rises is that of those behind, and a part of one."""
    way = _way(node)
    if way is None or node.variable in way.args[0].free:
        return None
    last, behind = node.hi, add(node.hi, ONE)

    def end(which: int, place: Term) -> Term:
        return substitute(way.args[which], {node.variable: place})

    def cells(place: Term) -> tuple[Term, Term]:
        slot = fresh("i", place.free | node.free)
        found = []
        for op in ("le", "lt"):
            before = sum_(slot, ZERO, last, if_(prim(op, end(1, var(slot)), place), ONE, ZERO))
            found.append(add(before, if_(prim(op, end(2, last), place), ONE, ZERO), const(-1)))
        return found[0], found[1]

    def border(cell: Term) -> Term:
        return if_(prim("le", cell, last), end(1, apply("min", cell, last)), end(2, last))

    def look(other: Sum, place: Term, cell: Term) -> Term | None:
        own = _way(other)
        if own is None or substitute(own, {other.variable: var(node.variable)}) is not way or other.hi is not last:
            return None
        parts = _through(other.body, own)
        if parts is None:
            return None
        rise, slope = (_at(other, part) for part in parts)
        inner = apply("clamp", cell, ZERO, last)

        def read(found: Term, otherwise: Term = ZERO) -> Term:
            """What is read of a cell; of one place there is none."""
            return if_(prim("lt", last, ZERO), otherwise, found)

        done = div(sub(place, read(end(1, inner))), read(sub(end(2, inner), end(1, inner)), ONE))
        walked = mul(_inside_of(cell, behind), add(mul(read(rise(inner)), done), read(slope(inner))))
        return add(_behind(rise, cell, behind), walked)

    return way.args[0], cells, border, behind, look


def _inside_of(cell: Term, end: Term) -> Term:
    """1 for the cells before the end, 0 for others: as a factor, so that surfaces are one for all cells."""
    return if_(prim("lt", cell, ZERO), ZERO, if_(prim("lt", cell, end), ONE, ZERO))


def _behind(rise: Callable[[Term], Term], cell: Term, last: Term) -> Term:
    """The sum of the rises in the cells before one: what it has risen to since the beginning, where they tell that."""
    slot = fresh("i", cell.free | rise(ZERO).free)
    each = rise(var(slot))
    parts = each.args if isinstance(each, Prim) and each.op == "add" and len(each.args) == 2 else ()
    for part in parts:
        before = neg(part)
        if slot in before.free and add(substitute(before, {slot: add(var(slot), ONE)}), part) is each:
            return sub(substitute(before, {slot: apply("max", cell, ZERO)}), substitute(before, {slot: ZERO}))
    return sum_(slot, ZERO, sub(apply("min", cell, last), ONE), each)


def _way(term: Sum) -> Prim | None:
    """How much of the way through a cell is done, in the terms of a sum over the cells of a table."""
    found = (node for node in postorder(term.body) if isinstance(node, Prim) and node.op == "between")
    own = next((node for node in found if term.variable in node.free), None)
    return None if own is None or _through(term.body, own) is None else own


def _through(term: Term, way: Prim) -> tuple[Term, Term] | None:
    """What a term is in proportion to: how much of the way through a cell is done, and 1 in the cell and 0 elsewhere,
    as the derivatives of that are. None where it is anything more."""
    match term:
        case _ if term is way:
            return ONE, ZERO
        case Branch(then=Branch(then=slope)) if term is _within(way, slope):
            return ZERO, slope
        case Prim(op="add", args=args):
            parts = [_through(arg, way) for arg in args]
            known = [part for part in parts if part is not None]
            return (add(*(a for a, _ in known)), add(*(b for _, b in known))) if len(known) == len(parts) else None
        case Prim(op="neg", args=(arg,)):
            return None if (part := _through(arg, way)) is None else (neg(part[0]), neg(part[1]))
        case Prim(op="mul", args=args):
            walked = [(place, part) for place, arg in enumerate(args) if (part := _through(arg, way)) is not None]
            if len(walked) != 1:
                return None
            ((place, (rise, slope)),) = walked
            rest = args[:place] + args[place + 1 :]
            return mul(*rest, rise), mul(*rest, slope)
        case _:
            return None


def _within(way: Prim, slope: Term) -> Term:
    """What its partial derivatives are: a slope in the cell, and 0 elsewhere."""
    x, start, end = way.args
    return branch((sub(x, start),), False, branch((sub(end, x),), True, slope, ZERO), ZERO)


def _factor(term: Sum, op: str) -> Prim | None:
    """What the terms of a sum are in proportion to: the factor that is this builtin of the index."""
    body = term.body
    for factor in body.args if isinstance(body, Prim) and body.op == "mul" else (body,):
        if isinstance(factor, Prim) and factor.op == op and term.variable in factor.free:
            return factor
    return None


def _beside(term: Sum, op: str) -> Callable[[Term], Term]:
    """The other factors of the terms of a sum, by the index."""
    own, body = _factor(term, op), term.body
    factors = body.args if isinstance(body, Prim) and body.op == "mul" else (body,)
    return _at(term, mul(*(factor for factor in factors if factor is not own)))


def _at(term: Sum, part: Term) -> Callable[[Term], Term]:
    """A part of the terms of a sum, by the index."""
    return lambda place: substitute(part, {term.variable: place})
