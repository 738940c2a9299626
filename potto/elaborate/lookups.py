"""What lies between the elements of arrays, as sums that are continuous where the elements are.

`interp` begins with the first value and adds, segment by segment, the slope times how far into the segment it goes:
beyond the ends it is what it is there. `image` weighs pixels by how near their centres are. The kinks are those of
`between`, `clamp` and `tent`, which the integrator knows.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from potto.core.terms import (
    HALF,
    ONE,
    ZERO,
    Term,
    add,
    apply,
    array,
    const,
    index,
    length,
    mul,
    proj,
    sub,
    sum_,
    var,
)
from potto.elaborate.arrays import element, shaped, together
from potto.elaborate.context import Elaboration
from potto.types.types import ArrayOf, TupleOf, Type, resolve

Read = Callable[[Term], Term]


def interp(elaboration: Elaboration, xs: Term, ys: Term, x: Term) -> Term:
    """Piecewise linear through `ys` at the places `xs`, which rise."""
    place = _number(elaboration)
    both = (xs, elaboration.shapes.of(xs)), (ys, elaboration.shapes.of(ys))
    size, after, first = length(xs), add(place, ONE), index(ys, ZERO)
    left, right = element(xs, place, size), element(xs, after, size)
    into = apply("between", x, left, right)

    def at(read: Read) -> Term:
        rise = mul(sub(read(element(ys, after, size)), read(element(ys, place, size))), into)
        return add(read(first), sum_(_name(place), ZERO, sub(together(*both, rising=True), const(2)), rise))

    return _by_numbers(elaboration, elaboration.shapes.of(first), first, at, _itself)


def image(elaboration: Elaboration, photo: Term, u: Term, v: Term) -> Term:
    """Bilinear between the centres of pixels: `u` along the rows, `v` down the columns, from 0 to 1."""
    row, column = _number(elaboration), _number(elaboration)
    rows, columns = length(photo, filled=True), length(index(photo, ZERO), filled=True)
    across, down = _near(u, columns, column), _near(v, rows, row)

    def at(read: Read) -> Term:
        along = sum_(_name(column), ZERO, sub(columns, ONE), mul(across, read(index(index(photo, row), column))))
        return sum_(_name(row), ZERO, sub(rows, ONE), mul(down, along))

    first = index(index(photo, ZERO), ZERO)
    return _by_numbers(elaboration, elaboration.shapes.of(first), first, at, _itself)


def _near(where: Term, count: Term, place: Term) -> Term:
    """How near to the centre of a pixel: 1 there, 0 from the centre of the next one on."""
    at = apply("clamp", sub(mul(where, count), HALF), ZERO, sub(count, ONE))
    return apply("tent", sub(at, place))


def _number(elaboration: Elaboration) -> Term:
    name = elaboration.fresh("k")
    elaboration.numbers.add(name)
    return var(name)


def _name(place: Term) -> str:
    (name,) = place.free
    return name


def _by_numbers(elaboration: Elaboration, shape: Type, first: Term, at: Callable[[Read], Term], read: Read) -> Term:
    """A number, or what has the shape of the elements, number by number. first: one of them. at: what there is in
    between, if that is told how to read its number of an element."""

    def part(type: Type, take: Read) -> Term:
        return _by_numbers(elaboration, resolve(type), first, at, lambda whole: take(read(whole)))

    if isinstance(shape, TupleOf):
        return shaped(elaboration, shape, [part(item, partial(_item, n)) for n, item in enumerate(shape.items)])
    if isinstance(shape, ArrayOf):
        place = _number(elaboration)
        return array(_name(place), length(read(first)), part(shape.item, lambda whole: index(whole, place)))
    return at(read)


def _item(place: int, whole: Term) -> Term:
    return proj(whole, place)


def _itself(whole: Term) -> Term:
    return whole
