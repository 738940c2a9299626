"""From pieces to points: how u in [0, 1] runs through a segment between two cuts.

Owns `Segments` and `points`. A segment whose end is a turning point (or has one just beyond it) is run through so
that square roots there become smooth; infinite ends are pulled in. A point's label says by which share it moves with
the segment's two ends when these move.
"""

from __future__ import annotations

import numpy as np

from potto.integrate.columns import Columns, distinct
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Ints

LINEAR, LEFT, RIGHT, BOTH, UP, DOWN, WHOLE = range(7)
# Powers by which a piece at the end of its segment is graded once it has shown itself not to be smooth there: so that
# what is like x^a becomes like t^(GRADE - 1).
GRADE, STEEPEST = 6, 120
# How near to an infinite end points come: the square of its inverse is still a number.
FARTHEST = 1e-150
# What part of a bound of its rounding a turning point is off: bounds add up what in truth cancels.
TYPICAL = 0.25


class Segments(Columns):
    """Stretches between neighbouring cuts, for a batch of integrals.

    owner: (S,) index of the integral. a, b: (S,) ends, a < b. ta, tb: (k, S) how they move. kind: (S,) the map.
    left, right: (S,) turning points that the map resolves (where `kind` says so).
    ea, eb: (S,) how far off the ends may be by rounding. da, db: (k, S) the same of their speeds.
    rank: (S,) what lies at the left end: 2 a jump, 1 a place where something further in changes, 0 neither.
    blur: (2, S) within which distance of the ends other cuts lie that rounding does not tell apart from these.
    pace: (S,) how fast an infinite stretch is run through at its finite end: dx/du there.
    """

    owner: Ints
    a: Array
    b: Array
    ta: Array
    tb: Array
    kind: Ints
    left: Array
    right: Array
    rank: Ints
    ea: Array
    eb: Array
    blur: Array
    da: Array
    db: Array
    pace: Array

    @property
    def turning(self) -> Bools:
        """Whose map resolves a turning point, (S,)."""
        return np.isin(self.kind, (LEFT, RIGHT, BOTH))


def choose(a: Array, b: Array, left: Array, right: Array) -> Ints:
    """The map for each segment; a turning point further away than the segment is long needs no care."""
    kind = np.zeros(a.shape, dtype=np.int64)
    width = b - a
    if ((a - left > width) & (right - b > width) & (width < np.inf)).all():
        return kind
    low, high = np.isinf(a), np.isinf(b)
    near_left, near_right = (a - left <= width) & ~low, (right - b <= width) & ~high
    kind[near_left] = LEFT
    kind[near_right] = RIGHT
    kind[near_left & near_right] = BOTH
    kind[high] = UP
    kind[low] = DOWN
    kind[low & high] = WHOLE
    return kind


def points(seg: Segments, u: Array, rest: Array | None = None) -> tuple[Array, Array, Array]:
    """x, dx/du and the label of each point; `u` is (P, n), row by row in the segments of `seg`, or one row for all.

    rest: 1 - u, where it is known better than it can be got from u.
    """
    if not seg.kind.any():
        return _along(seg, u, rest), (seg.b - seg.a)[:, None], u
    u = np.broadcast_to(u, (seg.a.size, u.shape[1]))
    rest = 1.0 - u if rest is None else rest
    x, slope, label = np.empty_like(u), np.empty_like(u), np.empty_like(u)
    for kind in distinct(seg.kind):
        rows = np.nonzero(seg.kind == kind)[0]
        part = seg.pick(rows)
        x[rows], slope[rows], label[rows] = _MAPS[int(kind)](part, u[rows], rest[rows])
    return x, slope, label


def off_the_ends(seg: Segments, x: Array) -> Array:
    """Points that crowd at an end, none of them rounded onto it: there an integrand may be infinite."""
    low, high = np.nextafter(seg.a, seg.b)[:, None], np.nextafter(seg.b, seg.a)[:, None]
    return np.where(x <= seg.a[:, None], low, np.where(x >= seg.b[:, None], high, x))


def trembling(seg: Segments, x: Array, power: float, blur: Array | None) -> Array:
    """How much values next to a turning point change as points are rounded, relatively: (P, n), 0 on other segments.

    Values like this negative power of the distance, and half a unit of the last place, or as far as the point itself
    may be off: the integrand, too, knows it no better. blur: (2, P) how far off the integrand
    sees turning points, if that is known.
    """
    least = 0.5 * EPS * np.abs(x)
    found = np.zeros(x.shape)
    seen = (0.0, 0.0) if blur is None else (blur[0][:, None], blur[1][:, None])
    for kinds, turn, end, off, own in (
        ((LEFT, BOTH), seg.left, seg.a, seg.ea, seen[0]), ((RIGHT, BOTH), seg.right, seg.b, seg.eb, seen[1])
    ):  # fmt: skip
        rounded = np.fmax(least, np.where((turn == end) & np.isfinite(off), TYPICAL * off, 0.0)[:, None]) + own
        near = np.where(np.isin(seg.kind, kinds)[:, None], np.abs(x - turn[:, None]), np.inf)
        found = np.maximum(found, power * rounded / np.maximum(near, 2 * least))
    return np.minimum(found, 1.0)


def displaced(seg: Segments, x: Array, label: Array) -> tuple[Array, Array]:
    """How far rounded points of linear segments are from where they should be, in lengths of the segment, and their
    labels as they are. Exact as long as the segment is far from 0 for its length."""
    actual = (x - seg.a[:, None]) / (seg.b - seg.a)[:, None]
    off = ((x - seg.a[:, None]) - (seg.b - seg.a)[:, None] * label) / (seg.b - seg.a)[:, None]
    return off, actual


def label(seg: Segments, x: Array) -> Array:
    """By which share points move with the right end of their segment; all of an infinite one moves alike."""
    a, b = seg.a[:, None], seg.b[:, None]
    with np.errstate(invalid="ignore"):
        return np.where(seg.kind[:, None] < UP, (x - a) / (b - a), 0.0)


def _along(seg: Segments, u: Array, rest: Array | None) -> Array:
    """Points by their distance from the end that is nearer to 0, around which doubles are as close as one likes."""
    a, b = seg.a[:, None], seg.b[:, None]
    x: Array = a + (b - a) * u
    if rest is None or not (from_above := np.abs(seg.b) < np.abs(seg.a)).any():
        return x
    return np.where(from_above[:, None], b - (b - a) * rest, x)


def _linear(seg: Segments, u: Array, rest: Array) -> tuple[Array, Array, Array]:
    return _along(seg, u, rest), (seg.b - seg.a)[:, None] * np.ones_like(u), u


def _left(seg: Segments, u: Array, rest: Array) -> tuple[Array, Array, Array]:
    """x = c + q², q linear in u: square roots at c <= a become smooth."""
    c = seg.left[:, None]
    q0, q1 = np.sqrt(seg.a[:, None] - c), np.sqrt(seg.b[:, None] - c)
    q = q0 + (q1 - q0) * u
    x = c + q * q
    return x, 2 * q * (q1 - q0), label(seg, x)


def _right(seg: Segments, u: Array, rest: Array) -> tuple[Array, Array, Array]:
    """The same from the right: what is left of u, so that q next to c, however small, has all its digits."""
    c = seg.right[:, None]
    q0, q1 = np.sqrt(c - seg.a[:, None]), np.sqrt(c - seg.b[:, None])
    q = q1 + (q0 - q1) * rest
    x = c - q * q
    return x, -2 * q * (q1 - q0), label(seg, x)


def _both(seg: Segments, u: Array, rest: Array) -> tuple[Array, Array, Array]:
    """x = c + (d - c) sin²(φ/2), φ linear in u: square roots at both c <= a and d >= b become smooth."""
    c, d = seg.left[:, None], seg.right[:, None]
    legs = [(np.sqrt(end[:, None] - c), np.sqrt(d - end[:, None])) for end in (seg.a, seg.b)]
    half0, half1 = (np.arctan2(low, high) for low, high in legs)
    rest0, rest1 = (np.arctan2(high, low) for low, high in legs)
    half, other = half0 + (half1 - half0) * u, rest1 + (rest0 - rest1) * rest  # each from the end that it is 0 at
    sine, cosine = np.sin(half), np.sin(other)
    x = np.where(half < np.pi / 4, c + (d - c) * sine**2, d - (d - c) * cosine**2)
    return x, 2 * (d - c) * sine * cosine * (half1 - half0), label(seg, x)


def _up(seg: Segments, u: Array, rest: Array) -> tuple[Array, Array, Array]:
    """[a, inf): x = a + pace u/(1-u); moves with a."""
    rest, pace = np.maximum(rest, FARTHEST), seg.pace[:, None]
    return seg.a[:, None] + pace * (u / rest), pace / (rest * rest), np.zeros_like(u)


def _down(seg: Segments, u: Array, rest: Array) -> tuple[Array, Array, Array]:
    near, pace = np.maximum(u, FARTHEST), seg.pace[:, None]
    return seg.b[:, None] - pace * (rest / near), pace / (near * near), np.ones_like(u)


def _whole(seg: Segments, u: Array, rest: Array) -> tuple[Array, Array, Array]:
    """(-inf, inf): x = w/(1-w²), w = 2u - 1; nothing moves."""
    low = u < 0.5
    near = np.maximum(np.where(low, u, rest), FARTHEST)  # distance from the nearer end, exact near both
    w = np.where(low, 2 * near - 1, 1 - 2 * near)
    gap = 4 * near * (1 - near)
    return w / gap, 2 * (1 + w * w) / (gap * gap), np.zeros_like(u)


_MAPS = {LINEAR: _linear, LEFT: _left, RIGHT: _right, BOTH: _both, UP: _up, DOWN: _down, WHOLE: _whole}


def grade(u0: Array, u1: Array, end: Ints, t: Array) -> tuple[Array, Array, Array]:
    """u, 1 - u and du/dt for t (n,) in [0, 1] over pieces [u0, u1].

    `end` < 0 or > 0 crowds points at the left or right end; its magnitude is the power of t by which it does.
    """
    width = (u1 - u0)[:, None]
    u = u0[:, None] + width * t
    rest = (1.0 - u1)[:, None] + width * (1.0 - t)
    slope = width
    if end.any():
        slope = np.repeat(width, t.size, axis=1)
        power = np.abs(end).astype(float)[:, None]
        rows = np.nonzero(end < 0)[0]
        u[rows] = u0[rows, None] + width[rows] * t ** power[rows]
        rest[rows] = 1.0 - u[rows]
        slope[rows] = width[rows] * power[rows] * t ** (power[rows] - 1)
        rows = np.nonzero(end > 0)[0]
        s = 1.0 - t
        u[rows] = u1[rows, None] - width[rows] * s ** power[rows]
        rest[rows] = (1.0 - u1)[rows, None] + width[rows] * s ** power[rows]
        slope[rows] = width[rows] * power[rows] * s ** (power[rows] - 1)
    return u, rest, slope


def velocity(seg: Segments, label: Array, direction: int) -> tuple[Array, Array]:
    """(v, dv/dx) of the points in one direction: the ends' speeds, linear in between."""
    ta, tb = seg.ta[direction][:, None], seg.tb[direction][:, None]
    if seg.kind.max(initial=0) < UP:
        rise = tb - ta
        return ta + rise * label, rise / (seg.b - seg.a)[:, None]
    low, high = np.isinf(seg.a)[:, None], np.isinf(seg.b)[:, None]
    width = np.where(low | high, np.inf, (seg.b - seg.a)[:, None])
    ta = np.where(low, np.where(high, 0.0, tb), ta)
    tb = np.where(high, ta, tb)
    return ta + (tb - ta) * label, (tb - ta) / width
