"""Crossings of conics with each other and with lines, as far as they may be corners of a region.

Owns `Places`, `conic_corners`, `mixed_corners` and `moving`, how they move. In an intersection a crossing counts unless
it lies outside of one of the other lines and conics for certain; in what is made of unions as well, wherever what both
bound is not 0 on the sides of the others where it lies.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from potto.calculus.decomposition.side_polynomials import LEAST, MOST
from potto.calculus.decomposition.surface_cuts import side
from potto.core.terms import Lam
from potto.integrate.columns import Columns, joined
from potto.integrate.decomposition.balls import Ball
from potto.integrate.decomposition.conic_crossings import crossings
from potto.integrate.decomposition.meetings import as_array, tangents
from potto.integrate.levels import Corners
from potto.integrate.pieces import Evaluator, gather, number_at, numbers_at
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints, Value, pad

BESIDE = 2.0**-24  # of its size: how far outside of a region a place still counts
CLEAR = 16 * EPS  # of the sizes of its summands: how far off what tells that is
TOUCHING = 2.0**-20  # the sine of the angle below which lines and conics touch rather than cross
MOST_NEAR = 20  # lines and conics at a crossing: the least of products of their sides is still told from rounding
CANCELLED = 2.0**-40  # of its summands: what a mixed difference is at most where it is 0
MOST_NUMBERS = 1 << 18  # that are looked at at once
STEPS = 2  # of Newton's method, from a place that has half of its digits or more


class Places(Columns):
    """Where surfaces cross: which two, (P,), conics before lines, of which member, where, (2, P), how far off that may
    be, and whether each is one crossing, rather than where some may be."""

    p: Ints
    q: Ints
    owner: Ints
    place: Array
    off: Array
    sure: Bools


def conic_corners(lines: Sequence[Array], conics: Sequence[Array], span: tuple[Array, Array]) -> Places:
    """The crossings of conics, with each other and with lines, at which what all hold may have a corner.

    lines, conics: numbers (3, n, B) and (6, m, B) of half planes and of sides of conics, and how far off they are.
    span: the range of the variable that is cut.
    """
    with np.errstate(all="ignore"):
        v, e = (_joined(of, more) for of, more in zip(lines, conics, strict=True))
        p, q, owner = _pairs(v, e, span)
        bent = p < conics[0].shape[1]
        places = _conic_crossings(v, e, p[bent], q[bent], owner[bent], span)
        return _left(places, v, e, (-1,) * v.shape[1])


def mixed_corners(
    lines: Sequence[Array], conics: Sequence[Array], span: tuple[Array, Array], polynomial: Lam, covers: Sequence[int],
    machine: Evaluator,
) -> Places:  # fmt: skip
    """The same where an integrand is a polynomial in the sides of all, also of which two lines cross. covers: as of a
    `ConicRegion`. Of n in a union n^2/2 cross, and few of these are within none of the others."""
    with np.errstate(all="ignore"):
        v, e = (_joined(of, more) for of, more in zip(lines, conics, strict=True))
        p, q, owner = _pairs(v, e, span)
        bent = p < conics[0].shape[1]
        places = joined([_conic_crossings(v, e, p[bent], q[bent], owner[bent], span),
                         _straight_crossings(v[3:], e[3:], p[~bent], q[~bent], owner[~bent])])  # fmt: skip
        places = _left(places.pick(np.isfinite(places.place).all(axis=0)), v, e, covers)
        each = max(1, MOST_NUMBERS // v.shape[1])
        chunks = [slice(i, i + each) for i in range(0, places.p.size, each)]
        kept = [_bounds_both(v, e, places.pick(chunk), polynomial, machine) for chunk in chunks]
    return places.pick(np.concatenate((*kept, np.zeros(0, dtype=bool))))


def _left(places: Places, v: Array, e: Array, covers: Sequence[int]) -> Places:
    """The places that are not, for certain, where one of the other surfaces leaves nothing to them."""
    for n, way in enumerate(covers):
        if way:
            own = (places.p == n) | (places.q == n)
            held = _holds(-way * v[:, n, places.owner], e[:, n, places.owner], places.place, places.off)
            places = places.pick(own | held)
    return places


def _pairs(v: Array, e: Array, span: tuple[Array, Array]) -> tuple[Ints, Ints, Ints]:
    """Each two surfaces of each member that may cross in its box, and whose they are. What passes the box by is left
    out, most of a scene in a pixel; and what is 0 everywhere for certain, or defined nowhere, as what a primitive of a
    scene hides of itself may be. The last two are the bounds of what is further in."""
    _, count, batch = v.shape
    p, q = (np.repeat(of, batch) for of in np.triu_indices(count, 1))
    owner = np.tile(np.arange(batch), p.size // batch)
    passes = ((v == 0) & (e == 0)).all(axis=0) | (v != v).any(axis=0) | ~_met(v, e, _box(v, span))
    passes[-2:] = False
    there = ~(passes[p, owner] | passes[q, owner])
    return p[there], q[there], owner[there]


def _box(v: Array, span: tuple[Array, Array]) -> Array:
    """The least and the most of both variables, (4, B)."""
    low, high = (v[5, -2] / -v[4, -2], v[5, -1] / -v[4, -1])
    return np.stack((*span, np.minimum(low, high), np.maximum(low, high)))


def _met(v: Array, e: Array, box: Array) -> Bools:
    """Whether surfaces (n, B) may meet a box: from its middle on they change by their slopes there, and by squares."""
    (x, y), (w, h) = 0.5 * (box[1::2] + box[::2]), 0.5 * (box[1::2] - box[::2]) * (1 + BESIDE)
    w, h = w + BESIDE * np.abs(x), h + BESIDE * np.abs(y)
    parts = _summands(v, x, y)
    sizes = _summands(np.abs(v) * CLEAR + e, np.abs(x) + w, np.abs(y) + h)
    steep = np.abs(2 * v[0] * x + v[1] * y + v[3]) * w + np.abs(v[1] * x + 2 * v[2] * y + v[4]) * h
    bent = np.abs(v[0]) * w * w + np.abs(v[1]) * w * h + np.abs(v[2]) * h * h
    met: Bools = ~(np.abs(parts.sum(axis=0)) > steep + bent + sizes.sum(axis=0))
    return met


def _bounds_both(v: Array, e: Array, places: Places, polynomial: Lam, machine: Evaluator) -> Bools:
    """Whether there may be something at places that both surfaces p and q bound."""
    p, q, owner, place, off = places.p, places.q, places.owner, places.place, places.off
    above, near = np.empty((2, v.shape[1], p.size), dtype=bool)
    for n in range(v.shape[1]):
        value, doubt = _value(v[:, n, owner], e[:, n, owner], place, off)
        above[n], near[n] = ~(value < -doubt), ~(np.abs(value) > doubt)
    at = np.arange(p.size)
    near[p, at] = near[q, at] = False
    drawn = np.random.default_rng(0).uniform(LEAST, MOST, (v.shape[1], 1))
    sides = np.where(near, drawn, np.where(above, 1.0, 0.0))
    corners = []
    for first, second in ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)):
        sides[p, at], sides[q, at] = first, second
        env = {side(n): Cell(own) for n, own in enumerate(sides)}
        corners.append(as_array(number_at(polynomial, machine.with_directions(0), env).v, p.size))
    one, other, third, none = corners
    mixed = np.abs(one - other - third + none)
    still = mixed <= CANCELLED * np.abs(np.stack(corners)).max(axis=0)
    found: Bools = ~still | (near.sum(axis=0) > MOST_NEAR)
    return found


def _straight_crossings(v: Array, e: Array, p: Ints, q: Ints, owner: Ints) -> Places:
    """Where lines cross."""
    (a, b, c), (d, f, g) = v[:, p, owner], v[:, q, owner]
    (ea, eb, ec), (ed, ef, eg) = e[:, p, owner], e[:, q, owner]
    below = a * f - b * d
    place = np.stack((b * g - c * f, c * d - a * g)) / below
    x, y = np.abs(place)
    first = ea * x + eb * y + ec + CLEAR * (np.abs(a) * x + np.abs(b) * y + np.abs(c))
    second = ed * x + ef * y + eg + CLEAR * (np.abs(d) * x + np.abs(f) * y + np.abs(g))
    off = (first * (np.abs(d) + np.abs(f)) + second * (np.abs(a) + np.abs(b))) / np.abs(below)
    return Places(p, q, owner, place, off, np.ones(p.shape, dtype=bool))


def _joined(lines: Array, conics: Array) -> Array:
    """Conics, then lines, which have no squares."""
    squares = np.zeros((3, *lines.shape[-2:]))
    return np.concatenate((conics, np.concatenate((squares, lines), axis=-3)), axis=-2)


def _conic_crossings(v: Array, e: Array, p: Ints, q: Ints, owner: Ints, span: tuple[Array, Array]) -> Places:
    """Where conics p cross conics or lines q."""
    box = _box(v, span)[:, owner]
    found = crossings(Ball(v[:, p, owner], e[:, p, owner]), Ball(v[:, q, owner], e[:, q, owner]), box)
    at = found.pair
    return Places(p[at], q[at], owner[at], found.place, found.off, found.sure)


def _summands(v: Array, x: Array, y: Array) -> Array:
    """The summands of conics (6, P) at places."""
    return np.stack((v[0] * x * x, v[1] * x * y, v[2] * y * y, v[3] * x, v[4] * y, v[5]))


def _holds(v: Array, e: Array, place: Array, off: Array) -> Bools:
    """Whether places may be on the side of surfaces where something is."""
    value, doubt = _value(v, e, place, off)
    found: Bools = ~(value < -doubt)
    return found


def _value(v: Array, e: Array, place: Array, off: Array) -> tuple[Array, Array]:
    """Surfaces at places, and how far off that is where these may be off."""
    x, y = place
    parts = _summands(v, x, y)
    reach = off + BESIDE * np.abs(place).sum(axis=0)
    slopes = np.abs(2 * v[0] * x + v[1] * y + v[3]) + np.abs(v[1] * x + 2 * v[2] * y + v[4])
    beside = (slopes + np.abs(v[:3]).sum(axis=0) * reach) * reach
    doubt = CLEAR * np.abs(parts).sum(axis=0) + _summands(e, *np.abs(place)).sum(axis=0)
    return parts.sum(axis=0), doubt + beside


def _parts(cell: Cell, count: int, directions: int) -> tuple[Array, Array, Array, Array]:
    """A number, how far off it is, its tangents, and how far off these are."""
    v, e = (as_array(0.0 if x is None else x, count) for x in (cell.v, cell.e))
    return v, e, tangents(cell.t, count, directions), tangents(cell.et, count, directions)


def moving(
    region: Corners, variable: str, env: dict[str, Value], places: Places, machine: Evaluator
) -> tuple[Ints, Array, Array, Array, Array]:
    """Whose the crossings are, where along the variable by Newton's method, how far off, their speeds (k, P) by
    the implicit function theorem, and how far off these are."""
    owner, place, off = places.owner, places.place, places.off
    k, function, which = machine.directions, region.surfaces, np.arange(owner.size)
    here = {name: pad(value, k + 2) for name, value in gather(env, owner).items() if name in function.params}
    tracked = machine.with_directions(k + 2).tracking()

    def at(place: Array) -> list[list[Array]]:
        """Both surfaces at places, with tangents and gradients (k + 2, P), and how far off all of that is."""
        for n, name in enumerate((variable, region.within.variable)):
            here[name] = Cell(place[n], None, (*(None,) * k, *(1.0 if n == m else None for m in range(2))))
        rows = [_parts(cell, which.size, k + 2) for cell in numbers_at(function, tracked, here)]
        parts = [np.stack(of, axis=-2) for of in zip(*rows, strict=True)]
        return [[part[..., line, which] for part in parts] for line in (places.p, places.q)]

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
