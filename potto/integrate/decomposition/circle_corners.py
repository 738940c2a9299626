"""Crossings of circles with each other and with lines, as far as they may be corners of a region.

Owns `circle_corners`, `mixed_corners` and `moving`, how they move. Two circles cross on a line, their radical axis. In
an intersection a crossing counts unless it lies outside of one of the other lines and circles for certain; in what is
made of unions as well, wherever what both bound is not 0 on the sides of the others where it lies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from potto.calculus.decomposition.side_polynomials import LEAST, MOST
from potto.calculus.decomposition.surface_cuts import side
from potto.core.terms import Lam
from potto.integrate.decomposition.meetings import as_array, tangents
from potto.integrate.levels import Corners
from potto.integrate.pieces import gather
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints, Value, pad

BESIDE = 2.0**-24  # of its size: how far outside of a region a place still counts
CLEAR = 16 * EPS  # of the sizes of its summands: how far off what tells that is
TOUCHING = 2.0**-20  # the sine of the angle below which lines and circles touch rather than cross
MOST_NEAR = 20  # lines and circles at a crossing: the least of products of their sides is still told from rounding
CANCELLED = 2.0**-40  # of its summands: what a mixed difference is at most where it is 0
MOST_NUMBERS = 1 << 18  # that are looked at at once
STEPS = 2  # of Newton's method, from a place that has half of its digits or more


def circle_corners(lines: Sequence[Array], circles: Sequence[Array]) -> tuple[Ints, Ints, Ints, Array, Array]:
    """Which two cross, circles before lines, of which member, where, (2, P), and how far off that may be.

    lines, circles: numbers (3, n, B) and (4, m, B) of half planes and of discs, and how far off they are.
    """
    with np.errstate(all="ignore"):
        v, e = (_joined(of, more) for of, more in zip(lines, circles, strict=True))
        _, count, batch = v.shape
        first, second = np.triu_indices(count, 1)
        round_too = first < circles[0].shape[1]
        p, q = (np.repeat(of[round_too], batch) for of in (first, second))
        owner = np.tile(np.arange(batch), p.size // batch)
        place, off = _crossings(v, e, p, q, owner)
        p, q, owner = (np.concatenate((of, of)) for of in (p, q, owner))
        there: Bools = np.asarray(np.isfinite(place).all(axis=0))
        for number in range(count):
            some = np.nonzero(there)[0]
            there[some] = _holds(v[:, number, owner[some]], e[:, number, owner[some]], place[:, some], off[some])
    return p[there], q[there], owner[there], place[:, there], off[there]


def mixed_corners(
    lines: Sequence[Array], circles: Sequence[Array], polynomial: Lam, machine: Any
) -> tuple[Ints, Ints, Ints, Array, Array]:
    """The same where an integrand is a polynomial in the sides of all, also of which two lines cross."""
    with np.errstate(all="ignore"):
        v, e = (_joined(of, more) for of, more in zip(lines, circles, strict=True))
        _, count, batch = v.shape
        p, q = (np.repeat(of, batch) for of in np.triu_indices(count, 1))
        owner = np.tile(np.arange(batch), p.size // batch)
        round_too = p < circles[0].shape[1]
        parts = [_crossings(v, e, p[round_too], q[round_too], owner[round_too]),
                 _straight_crossings(v, e, p[~round_too], q[~round_too], owner[~round_too])]  # fmt: skip
        place, off = (np.concatenate(of, axis=-1) for of in zip(*parts, strict=True))
        p, q, owner = (np.concatenate((of[round_too], of[round_too], of[~round_too])) for of in (p, q, owner))
        some = np.nonzero(np.isfinite(place).all(axis=0))[0]
        each = max(1, MOST_NUMBERS // count)
        chunks = [some[i : i + each] for i in range(0, some.size, each)]
        kept = [c[_bounds_both(v, e, p[c], q[c], owner[c], place[:, c], off[c], polynomial, machine)] for c in chunks]
        there = np.concatenate((*kept, some[:0]))
    return p[there], q[there], owner[there], place[:, there], off[there]


def _bounds_both(
    v: Array, e: Array, p: Ints, q: Ints, owner: Ints, place: Array, off: Array, polynomial: Lam, machine: Any
) -> Bools:
    """Whether there may be something at places that both surfaces p and q bound."""
    over, under = ([_holds(sign * v[:, n, owner], e[:, n, owner], place, off) for n in range(v.shape[1])]
                   for sign in (1.0, -1.0))  # fmt: skip
    above: Bools = np.stack(over)
    near, at = above & np.stack(under), np.arange(p.size)
    near[p, at] = near[q, at] = False
    drawn = np.random.default_rng(0).uniform(LEAST, MOST, (v.shape[1], 1))
    sides = np.where(near, drawn, np.where(above, 1.0, 0.0))
    corners = []
    for first, second in ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)):
        sides[p, at], sides[q, at] = first, second
        env = {name: Cell(sides[n]) for n in range(v.shape[1]) if (name := side(n)) in polynomial.params}
        corners.append(as_array(machine.with_directions(0).evaluate(polynomial, env, None).v, p.size))
    one, other, third, none = corners
    mixed = np.abs(one - other - third + none)
    still = mixed <= CANCELLED * np.abs(np.stack(corners)).max(axis=0)
    found: Bools = ~still | (near.sum(axis=0) > MOST_NEAR)
    return found


def _straight_crossings(v: Array, e: Array, p: Ints, q: Ints, owner: Ints) -> tuple[Array, Array]:
    """Where lines cross, (2, P), and how far off that is, (P,)."""
    (_, a, b, c), (_, d, f, g) = v[:, p, owner], v[:, q, owner]
    (_, ea, eb, ec), (_, ed, ef, eg) = e[:, p, owner], e[:, q, owner]
    below = a * f - b * d
    place = np.stack((b * g - c * f, c * d - a * g)) / below
    x, y = np.abs(place)
    first = ea * x + eb * y + ec + CLEAR * (np.abs(a) * x + np.abs(b) * y + np.abs(c))
    second = ed * x + ef * y + eg + CLEAR * (np.abs(d) * x + np.abs(f) * y + np.abs(g))
    off = (first * (np.abs(d) + np.abs(f)) + second * (np.abs(a) + np.abs(b))) / np.abs(below)
    return place, off


def _joined(lines: Array, circles: Array) -> Array:
    """Circles, then lines, which have no square."""
    return np.concatenate((circles, np.concatenate((np.zeros_like(lines[..., :1, :, :]), lines), axis=-3)), axis=-2)


def _crossings(v: Array, e: Array, p: Ints, q: Ints, owner: Ints) -> tuple[Array, Array]:
    """Both crossings of circles p with circles or lines q, (2, 2P), nan where there are none, and how far off (2P,)."""
    one, other, doubt = v[:, p, owner], v[:, q, owner], e[:, p, owner]
    a, b, c = (other[0] * one[n] - one[0] * other[n] for n in (1, 2, 3))  # their radical axis
    middle = -0.5 * one[1:3] / one[0]
    square = (middle**2).sum(axis=0) - one[3] / one[0]
    size = np.hypot(a, b)
    way = np.stack((a, b)) / size
    gap = (a * middle[0] + b * middle[1] + c) / size
    least = square - gap**2
    hidden = CLEAR * ((middle**2).sum(axis=0) + np.abs(one[3] / one[0]) + gap**2 + np.abs(c * gap / size))
    hidden += 2 * (doubt[3] + (np.abs(middle) * doubt[1:3]).sum(axis=0) + square * doubt[0]) / np.abs(one[0])
    half = np.where(least < -hidden, np.nan, np.sqrt(np.maximum(least, 0.0)))
    foot = middle - gap * way
    places = [foot + sign * half * np.stack((-way[1], way[0])) for sign in (1.0, -1.0)]
    off = np.minimum(hidden / half, np.sqrt(hidden)) + CLEAR * (np.abs(middle).sum(axis=0) + np.abs(gap))
    return np.concatenate(places, axis=1), np.concatenate((off, off))


def _at(v: Array, place: Array) -> tuple[Array, Array, Array]:
    """Surfaces (4, P) at places (2, P), their summands without regard to sign added up, and their gradients (2, P)."""
    x, y = place
    parts = np.stack((v[0] * (x * x + y * y), v[1] * x, v[2] * y, v[3]))
    return parts.sum(axis=0), np.abs(parts).sum(axis=0), 2 * v[0] * place + v[1:3]


def _value(v: Array, place: Array) -> Array:
    x, y = place
    found: Array = v[0] * (x * x + y * y) + v[1] * x + v[2] * y + v[3]
    return found


def _doubt(e: Array, place: Array) -> Array:
    """How far off surfaces are at places as their numbers are."""
    return _value(e, np.abs(place))


def _holds(v: Array, e: Array, place: Array, off: Array) -> Array:
    """Whether places may be on the side of surfaces where something is."""
    value, size, slopes = _at(v, place)
    reach = off + BESIDE * np.abs(place).sum(axis=0)
    found: Array = ~(value < -(CLEAR * size + _doubt(e, place) + np.abs(slopes).sum(axis=0) * reach))
    return found


def _parts(cell: Cell, count: int, directions: int) -> tuple[Array, Array, Array, Array]:
    """A number, how far off it is, its tangents, and how far off these are."""
    v, e = (as_array(0.0 if x is None else x, count) for x in (cell.v, cell.e))
    return v, e, tangents(cell.t, count, directions), tangents(cell.et, count, directions)


def moving(
    region: Corners, variable: str, env: dict[str, Value], p: Ints, q: Ints, owner: Ints, place: Array, off: Array,
    machine: Any,
) -> tuple[Ints, Array, Array, Array, Array]:  # fmt: skip
    """Whose the crossings are, where along the variable by Newton's method, how far off, their speeds (k, P) by
    the implicit function theorem, and how far off these are."""
    k, function, which = machine.directions, region.surfaces, np.arange(owner.size)
    here = {name: pad(value, k + 2) for name, value in gather(env, owner).items() if name in function.params}
    tracked = machine.with_directions(k + 2).tracking()

    def at(place: Array) -> list[list[Array]]:
        """Both surfaces at places, with tangents and gradients (k + 2, P), and how far off all of that is."""
        for n, name in enumerate((variable, region.further_in)):
            here[name] = Cell(place[n], None, (*(None,) * k, *(1.0 if n == m else None for m in range(2))))
        cells = tracked.evaluate(function, {name: here[name] for name in function.params}, None)
        assert isinstance(cells, tuple)
        rows = [_parts(cell, which.size, k + 2) for cell in cells if isinstance(cell, Cell)]
        parts = [np.stack(of, axis=-2) for of in zip(*rows, strict=True)]
        return [[part[..., line, which] for part in parts] for line in (p, q)]

    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            (f, _, g, _), (h, _, s, _) = at(place)
            step = np.stack((s[-1] * f - g[-1] * h, g[-2] * h - s[-2] * f)) / (g[-2] * s[-1] - g[-1] * s[-2])
            fine = np.isfinite(step).all(axis=0) & (np.abs(step).max(axis=0) <= 2 * off)
            place = place - np.where(fine, step, 0.0)
        (f, e, g, eg), (h, eh, s, es) = at(place)
        below = g[-2] * s[-1] - g[-1] * s[-2]
        error = (np.abs(s[-1]) * (np.abs(f) + e) + np.abs(g[-1]) * (np.abs(h) + eh)) / np.abs(below)
        error = np.fmin(error + EPS * np.abs(place[0]), off)
        speed = (g[-1] * s[:k] - s[-1] * g[:k]) / below
        steep = np.abs(g[-2] * s[-1]) + np.abs(g[-1] * s[-2])
        unsure = np.abs(s[-1]) * (eg[:k] + EPS * np.abs(g[:k])) + np.abs(g[-1]) * (es[:k] + EPS * np.abs(s[:k]))
        unsure = (unsure + CLEAR * np.abs(speed) * steep) / np.abs(below)
        known = np.abs(below) > TOUCHING * steep  # else it is all the same how nodes move
    return owner, place[0], error, np.where(known, speed, 0.0), np.where(known, unsure, 0.0)
