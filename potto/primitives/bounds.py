"""Rules of enclosure that several entries share.

Remainders bound what a function has beyond the linear part of its Taylor series in a disc of the complex plane, mostly
by the series itself with every coefficient replaced by its magnitude. They are worked out in doubles, not rounded
outwards: what cancels is made up for by `slack` or `rest`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from potto.primitives.registry import EPS, Elementwise, Ends, Quantity, WhereTrue

# How near to a singularity of a function a disc may come, as a part of its centre's distance from it.
NEAREST = 0.95

Remainder = Callable[[Elementwise, Quantity, Quantity], Quantity]


def slack(d: Quantity) -> Quantity:
    """More than the rounding of a difference of numbers of the size of d, where d is small: d^2 of the last places."""
    return 1e-15 * d + 1e-15 * d * d


def share(ops: Elementwise, distance: Quantity, d: Quantity) -> Quantity:
    """How far a disc reaches, as a part of its centre's distance from a singularity; nan where it comes too near."""
    q = ops.of("div")(d, abs(distance))
    part: Quantity = ops.where(q <= NEAREST, q, math.nan)
    return part


def clear(ops: Elementwise, distance: Quantity, d: Quantity) -> Quantity:
    """What a disc leaves of the distance between its centre and a singularity; nan where it comes too near."""
    left: Quantity = ops.where((distance > 0) & (d <= NEAREST * distance), distance - d, math.nan)
    return left


def exponential(ops: Elementwise, d: Quantity) -> Quantity:
    """exp(d) - 1 - d."""
    return ops.of("expm1")(d) - d + slack(d)


def even_and_odd(ops: Elementwise, d: Quantity) -> tuple[Quantity, Quantity]:
    """cosh d - 1 and sinh d - d."""
    half = ops.of("sinh")(0.5 * d)
    return 2 * half * half, ops.of("sinh")(d) - d + slack(d)


def waves(value: str, slope: str) -> Remainder:
    """Of sin, cos, sinh and cosh: the derivatives are the two of them by turns."""

    def run(ops: Elementwise, m: Quantity, d: Quantity) -> Quantity:
        even, odd = even_and_odd(ops, d)
        return abs(ops.of(value)(m)) * even + abs(ops.of(slope)(m)) * odd

    return run


def rising(op: str, slope: Callable[[Elementwise, Quantity], Quantity]) -> Remainder:
    """Of a function whose series at 0 has no negative coefficients and reaches to 1: each is largest at |m|."""

    def run(ops: Elementwise, m: Quantity, d: Quantity) -> Quantity:
        near, f = abs(m), ops.of(op)
        far = ops.where(near + d < 1, near + d, math.nan)
        return f(far) - f(near) - slope(ops, near) * d + 4 * EPS * f(far)

    return run


# Intervals


def magnitudes(ops: Elementwise, a: Ends) -> Ends:
    """Bounds of the magnitude of what lies within bounds."""
    lo, hi = abs(a[0]), abs(a[1])
    return ops.where((a[0] <= 0) & (a[1] >= 0), 0.0, ops.least(lo, hi)), ops.most(lo, hi)


def wave(shift: float) -> Callable[[Elementwise, Ends], Ends]:
    """sin(x + shift): 1 where a peak lies inside, -1 where a trough does, as far as their places are known."""

    def run(ops: Elementwise, a: Ends) -> Ends:
        lo, hi = a[0] + shift, a[1] + shift
        near = 2 * EPS * ops.most(abs(lo), abs(hi))
        sin, floor, turn = ops.of("sin"), ops.of("floor"), 2 * math.pi
        p, q = sin(lo), sin(hi)

        def meets(place: float) -> WhereTrue:
            return floor((hi + near - place) / turn) > floor((lo - near - place) / turn)

        whole = ops.where(ops.finite(lo) & ops.finite(hi), hi - lo >= turn, True)
        low = ops.where(whole | meets(-math.pi / 2), -1.0, ops.least(p, q) - near)
        high = ops.where(whole | meets(math.pi / 2), 1.0, ops.most(p, q) + near)
        return ops.most(low, -1.0), ops.least(high, 1.0)

    return run


def tangent(ops: Elementwise, a: Ends) -> Ends:
    lo, hi = a
    near = 2 * EPS * ops.most(abs(lo), abs(hi))
    floor, tan = ops.of("floor"), ops.of("tan")
    same = floor((hi + near) / math.pi + 0.5) == floor((lo - near) / math.pi + 0.5)
    within = ops.where(ops.finite(lo) & ops.finite(hi), same, False)
    p, q = tan(lo), tan(hi)
    return ops.where(within, p - near * (1 + p * p), -math.inf), ops.where(within, q + near * (1 + q * q), math.inf)


def angle(ops: Elementwise, y: Ends, x: Ends) -> Ends:
    """Of a rectangle that neither holds the origin nor meets the cut, the corners are the extremes."""
    corners = [ops.of("atan2")(b + 0.0, a) for b in y for a in x]  # -0 is 0: at it the function would jump too
    lo = hi = corners[0]
    for corner in corners[1:]:
        lo, hi = ops.least(lo, corner), ops.most(hi, corner)
    cut = (x[0] <= 0) & (y[0] < 0) & (y[1] >= 0)
    origin = (x[0] <= 0) & (x[1] >= 0) & (y[0] <= 0) & (y[1] >= 0)
    lo = ops.where(origin, 0.0, lo)
    return ops.where(cut, -math.pi, lo), ops.where(cut | origin, math.pi, hi)


def length(ops: Elementwise, x: Ends, y: Ends) -> Ends:
    a, b, hypot = magnitudes(ops, x), magnitudes(ops, y), ops.of("hypot")
    return hypot(a[0], b[0]), hypot(a[1], b[1])


def ends(op: str) -> Callable[..., Ends]:
    """Of what rises with every argument, though not strictly: its values at the lower and at the upper ends."""

    def run(ops: Elementwise, *args: Ends) -> Ends:
        f = ops.of(op)
        return f(*(a[0] for a in args)), f(*(a[1] for a in args))

    return run


def extreme(least: bool) -> Callable[..., Ends]:
    def run(ops: Elementwise, *args: Ends) -> Ends:
        pick = ops.least if least else ops.most
        lo, hi = args[0]
        for a in args[1:]:
            lo, hi = pick(lo, a[0]), pick(hi, a[1])
        return lo, hi

    return run


def between_turns(
    ops: Elementwise, op: str, within: tuple[float, float], turns: tuple[float, ...], a: Ends
) -> tuple[Quantity, Quantity, WhereTrue]:
    """A builtin of the part of an interval on which it is defined, by its values at the ends and where it turns."""
    f = ops.of(op)
    lo, hi = ops.least(ops.most(a[0], within[0]), within[1]), ops.least(ops.most(a[1], within[0]), within[1])
    p, q = f(lo), f(hi)
    low, high = ops.least(p, q), ops.most(p, q)
    for turn in turns:
        inside, value = (lo <= turn) & (turn <= hi), f(turn)
        low = ops.where(inside, ops.least(low, value), low)
        high = ops.where(inside, ops.most(high, value), high)
    return low, high, (a[1] < within[0]) | (a[0] > within[1])
