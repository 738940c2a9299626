"""Bounds that end in a root as conditions: an integral over [-sqrt(q), sqrt(q)] is one of [y^2 < q].

Owns `conditioned`. Where q = 0 such bounds turn and have no derivative, so that the boundary term of a boundary term is
infinite on either side. The rim of the condition is smooth there, and moves along its normal (`level_sets`). Bounds of
variables further out that lie where nothing is left of it, the ends of a disc, would touch that rim; they say nothing
that it does not, and go.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from potto.calculus.algebra.polynomial_in import in_powers
from potto.calculus.algebra.ranges import nonnegative
from potto.calculus.algebra.rational_form import as_term, is_zero, normal, shorter
from potto.calculus.decomposition.factors import factors
from potto.calculus.differentiation.derivative import partial
from potto.calculus.surfaces.domains import ends_of_domain
from potto.core.terms import (
    HALF,
    INF,
    ONE,
    TWO,
    ZERO,
    Branch,
    Const,
    Integral,
    Term,
    add,
    branch,
    const,
    div,
    integral,
    mul,
    neg,
    pow_,
    sub,
    substitute,
    var,
)

Bounds = tuple[Term, Term]


def conditioned(term: Integral) -> Integral:
    """An equal integral, wherever that has a value, with a condition for bounds that turn; the same one where none do,
    or where it is not certain that these have a value up to where the bounds further out end."""
    bounds = dict(zip(term.variables, term.bounds, strict=True))
    rims = [rim for factor in factors(term.body) if (rim := _positive_where(factor)) is not None]
    conditions: list[Term] = []
    due: set[Term] = set()  # shadows of rims of bounds, which have to be positive within the bounds further out
    for place in range(len(term.variables) - 1, -1, -1):
        name, outer = term.variables[place], term.variables[:place]
        open_ends = _within_rims(name, bounds[name], rims)
        if any(rim in due and not _positive_within(rim, name, bounds[name]) for rim in rims if name in rim.free):
            return term
        if open_ends is not bounds[name]:
            bounds[name] = open_ends
        elif any(end.free.intersection(outer) for bound in bounds[name] for end in ends_of_domain(bound)):
            found = _as_condition(name, bounds[name])
            if found is None:
                return term
            rim, bounds[name] = found
            conditions.append(rim)
            rims.append(rim)
            due.add(rim)
        shadows = {rim: _shadow(rim, name) for rim in rims}
        if any(shadows[rim] is None for rim in due):
            return term
        rims = [shadow for shadow in shadows.values() if shadow is not None]
        due = {shadow for rim in due if (shadow := shadows[rim]) is not None}
    if tuple(bounds.values()) == term.bounds:
        return term
    body = term.body
    for rim in conditions:
        body = branch((rim,), True, body, ZERO)
    return integral(term.variables, tuple(bounds.values()), body, term.hints)


def _positive_where(factor: Term) -> Term | None:
    """What is positive where a factor is not 0."""
    match factor:
        case Branch(surface=surface, then=then, orelse=orelse) if orelse is ZERO and then is ONE:
            return surface
        case Branch(surface=surface, then=then, orelse=orelse) if then is ZERO and orelse is ONE:
            return neg(surface)
    return None


def _as_condition(name: str, bounds: Bounds) -> tuple[Term, Bounds] | None:
    """What is positive between two bounds, without the roots in them, and what bounds are left."""
    lo, hi = bounds
    width = shorter(sub(hi, lo))
    if not nonnegative(width):
        return None
    middle, nowhere = mul(HALF, add(lo, hi)), const(-math.inf)
    for center, reach, left in (
        (middle, mul(HALF, width), (nowhere, INF)),
        (lo, width, (lo, INF)),
        (hi, width, (nowhere, hi)),
    ):
        form = normal(sub(pow_(reach, TWO), pow_(sub(var(name), center), TWO)))
        rim = as_term(form.top) if form is not None and form.whole else None
        if rim is not None and not ends_of_domain(rim) and not any(map(ends_of_domain, left)):
            return rim, left
    return None


def _within_rims(name: str, bounds: Bounds, rims: Sequence[Term]) -> Bounds:
    """The bounds, but those beyond which some concave rim is negative anyway, as it is 0 there and falls."""
    lo, hi = bounds
    for rim in rims:
        if name in rim.free and _concave(rim, name):
            if _is_zero_at(rim, name, lo) and nonnegative(_slope_at(rim, name, lo)):
                lo = const(-math.inf)
            if _is_zero_at(rim, name, hi) and nonnegative(neg(_slope_at(rim, name, hi))):
                hi = INF
    return bounds if (lo, hi) == bounds else (lo, hi)


def _positive_within(rim: Term, name: str, bounds: Bounds) -> bool:
    """Whether a concave rim is known not to be negative at either bound, and so between them."""
    lo, hi = bounds
    zero = _is_zero_at(rim, name, lo), _is_zero_at(rim, name, hi)
    falls = zero[1] and nonnegative(neg(_slope_at(rim, name, lo)))
    rises = zero[0] and nonnegative(_slope_at(rim, name, hi))
    low = zero[0] or falls or nonnegative(substitute(rim, {name: lo}))
    high = zero[1] or rises or nonnegative(substitute(rim, {name: hi}))
    return _concave(rim, name) and low and high


def _is_zero_at(rim: Term, name: str, at: Term) -> bool:
    return not (isinstance(at, Const) and math.isinf(at.value)) and is_zero(substitute(rim, {name: at}))


def _slope_at(rim: Term, name: str, at: Term) -> Term:
    return shorter(substitute(partial(rim, name), {name: at}))


def _concave(rim: Term, name: str) -> bool:
    """Whether a rim is a parabola along a variable that is open below."""
    powers = in_powers(rim, name, 2)
    return powers is not None and nonnegative(neg(powers[0]))


def _shadow(rim: Term, name: str) -> Term | None:
    """What is positive wherever a rim is for some value of a variable: the greatest value of a parabola."""
    if name not in rim.free:
        return rim
    powers = in_powers(rim, name, 2)
    if powers is None or powers[0] is ZERO or not nonnegative(neg(powers[0])):
        return None
    top = normal(sub(powers[2], div(pow_(powers[1], TWO), mul(TWO, TWO, powers[0]))))
    return as_term(top.top) if top is not None and top.whole else None
