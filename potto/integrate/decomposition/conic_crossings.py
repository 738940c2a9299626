"""Where two conics cross: all places, each with how far off it may be.

Owns `crossings` and `Crossings`. Two conics cross where all of their pencil do. Where its squares cancel, as of two
circles, a member of it is a line, and what is left is a quadratic equation. Else the places are the roots of a
resultant of degree 4, in coordinates turned in projective space, so that neither axes nor points at infinity are
special; discs hold all of its roots, so that none is missed (`quartics`). Newton's method finds the places, and
Kantorovich's theorem proves them (Ortega 1968), whose constants are exact for conics. Where fewer are proved than may
be, since conics touch or all but coincide, the discs that are left tell where others may be: just one where a disc
holds a single root.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from potto.integrate.columns import Columns, joined
from potto.integrate.decomposition.balls import Ball, exact, stacked
from potto.integrate.decomposition.quartics import RootDiscs, roots_in_discs
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Ints

SAME = 32 * EPS  # of their sizes: up to which squares that cancel are 0
FLAT = 2.0**-20  # of the larger one: below which the smaller eigenvalue of squares does not tell where a middle is
ASIDE = 4  # boxes: from how far off on the middle of a conic is none of what is asked for
MOST_PAIRS = 1 << 13  # that are looked at at once
STEPS = 8  # of Newton's method; what it takes longer for is not proved
PROVED = 2.0**-4  # at most, of Kantorovich's h, so that any two places either are one or are told apart


@lru_cache(maxsize=1)
def _turns() -> tuple[Array, ...]:
    """Rotations of projective space, in which no direction of a conic is special but by chance: so there is another
    one. They are made where they are asked for: numpy loads what draws numbers with the first."""
    return tuple(np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0] for seed in range(2))


class Crossings(Columns):
    """Places of a batch of pairs: of which pair (P,), where, (2, P), how far off they may be, (P,), and whether each is
    one crossing, rather than where some may be."""

    pair: Ints
    place: Array
    off: Array
    sure: Bools


def crossings(first: Ball, second: Ball, box: Array) -> Crossings:
    """Where pairs of conics cross.

    first, second: the numbers of x*x, x*y, y*y, x, y and 1 of conics or lines, (6, N). box: (4, N), the least and the
    most of x and y, of places that are asked for; others may be among them.
    """
    starts = range(0, max(box.shape[1], 1), MOST_PAIRS)
    parts = [_some(first[:, (at := slice(i, i + MOST_PAIRS))], second[:, at], box[:, at]) for i in starts]
    for start, part in zip(starts, parts, strict=True):
        part.pair = part.pair + start
    return joined(parts)


def _some(first: Ball, second: Ball, box: Array) -> Crossings:
    with np.errstate(all="ignore"):
        first, second = (of.times(1 / np.abs(of.v).max(axis=0)) for of in (first, second))
        p, q, center, scale = _in_order(first, second)
        reach = 0.5 * (box[1::2] - box[::2]).max(axis=0)
        aside = np.isfinite(reach) & (np.abs(center - 0.5 * (box[::2] + box[1::2])) > ASIDE * reach).any(axis=0)
        center = np.where(aside, 0.5 * (box[::2] + box[1::2]), center)
        scale = np.where(aside, reach, np.fmin(scale, ASIDE * reach))
        rest, flat = _without_squares(p, q)
        frame = np.zeros((3, 3, scale.size))
        frame[0, 0] = frame[1, 1] = scale
        frame[:2, 2], frame[2, 2] = center, 1.0
        m, n = (_in_frame(_matrix(of), frame) for of in (p, rest))
        box = (box - center[[0, 0, 1, 1]]) / scale
        parts = []
        for how, some in ((_on_lines, np.nonzero(flat)[0]), (_of_conics, np.nonzero(~flat)[0])):
            found = how(m[:, :, some], n[:, :, some], box[:, some])
            pair = found.pair = some[found.pair]
            found.place = center[:, pair] + scale[pair] * found.place
            found.off = scale[pair] * found.off + EPS * np.abs(found.place).max(axis=0, initial=0.0)
            parts.append(found)
    whole = joined(parts)
    return whole.pick(np.isfinite(whole.place).all(axis=0) & ~np.isnan(whole.off))


def _in_order(first: Ball, second: Ball) -> tuple[Ball, Ball, Array, Array]:
    """Conics, the rounder one first, with its middle (2, N) and its size."""
    (one, *own), (other, *others) = (_shape(of.v) for of in (first, second))
    turned = other > one
    p, q = (Ball(np.where(turned, b.v, a.v), np.where(turned, b.e, a.e)) for a, b in ((first, second), (second, first)))
    center, scale = (np.where(turned, b, a) for a, b in zip(own, others, strict=True))
    return p, q, center, scale


def _shape(v: Array) -> tuple[Array, Array, Array]:
    """How round conics are, 1 for circles, 0 for parabolas, -1 for lines; their middles (2, N), of parabolas what is
    near their vertex; and how large they are, about."""
    a, b, c, d, e, f = np.where(np.isfinite(v), v, 0.0)
    values, ways = np.linalg.eigh(np.moveaxis(np.array([[2 * a, b], [b, 2 * c]]), -1, 0))
    size = np.abs(values).max(axis=1)
    curved = np.abs(values) > FLAT * size[:, None]
    slopes = np.einsum("nij,in->nj", ways, np.stack((d, e)))
    moves = np.where(curved, -slopes / np.where(curved, values, 1.0), 0.0)
    rest = np.abs(f + 0.5 * (slopes * moves).sum(axis=1))
    scale = 2 * np.maximum(np.sqrt(0.5 * rest / size), np.abs(slopes * ~curved).max(axis=1) / size)
    scale = np.where(np.isfinite(scale) & (scale > 0), scale, 1.0)
    return np.where(size > 0, np.abs(values).min(axis=1) / size, -1.0), np.einsum("nij,nj->in", ways, moves), scale


def _without_squares(p: Ball, q: Ball) -> tuple[Ball, Bools]:
    """The conic of the pencil of p and q whose squares are perpendicular to those of p, and where they are 0."""
    own, shared = (p.v[:3] ** 2).sum(axis=0), (p.v[:3] * q.v[:3]).sum(axis=0)
    rest = q.times(np.where(own > 0, own, 1.0)) - p.times(shared)
    rounded = SAME * (own * np.abs(q.v[:3]) + np.abs(shared * p.v[:3]))
    return rest, (np.abs(rest.v[:3]) <= rest.e[:3] + rounded).all(axis=0)


def _matrix(conic: Ball) -> Ball:
    """Twice the symmetric matrices (3, 3, N) of conics."""
    v, e = (np.array([[2 * a, b, d], [b, 2 * c, e], [d, e, 2 * f]]) for a, b, c, d, e, f in (conic.v, conic.e))
    return Ball(v, e)


def _in_frame(m: Ball, frame: Array) -> Ball:
    """Matrices of conics in other coordinates, the largest number 1."""
    size, batch = np.abs(frame), np.broadcast_shapes(m.v.shape, frame.shape)
    frame, size = np.broadcast_to(frame, batch), np.broadcast_to(size, batch)
    moved = np.einsum("ian,ibn->abn", frame, np.einsum("ijn,jbn->ibn", m.v, frame))
    off = np.einsum("ian,ibn->abn", size, np.einsum("ijn,jbn->ibn", m.e + 8 * EPS * np.abs(m.v), size))
    return Ball(moved, off).times(1 / np.abs(moved).max(axis=(0, 1)))


def _on_lines(m: Ball, n: Ball, box: Array) -> Crossings:
    """Crossings of conics with matrices m and lines, whose squares are 0 but for rounding."""
    a, b, c = n[0, 2], n[1, 2], n[2, 2].times(0.5)
    size = np.abs(n.v[:2, :2]).sum(axis=(0, 1)) + n.e[:2, :2].sum(axis=(0, 1))
    parts = []
    for which, (u, v) in enumerate(_along(m, a, b, c)):
        far = u.v**2 + v.v**2  # of the squares there it is not known what they come to
        far = np.where(np.isfinite(far), far, 0.0)
        u, v = _along(m, a, b, c + Ball(np.zeros_like(far), size * far))[which]
        parts.append(_places(np.arange(far.size), u, v, np.ones(far.shape, dtype=bool)))
    return joined(parts)


def _along(m: Ball, a: Ball, b: Ball, c: Ball) -> list[tuple[Ball, Ball]]:
    """Both places at which lines a*u + b*v + c = 0 cross conics with matrices m."""
    square = a * a + b * b
    foot = [-(c * of) / square for of in (a, b)]
    way = [-b, a]
    one = exact(np.ones_like(c.v))
    at, along = [*foot, one], [*way, exact(np.zeros_like(c.v))]
    bent = _form(m, along, along)
    slope, rest = _form(m, at, along), _form(m, at, at)
    half = (slope * slope - bent * rest).root()
    top = -(slope + half.times(np.where(slope.v < 0, -1.0, 1.0)))
    return [(foot[0] + s * way[0], foot[1] + s * way[1]) for s in (top / bent, rest / top)]


def _form(m: Ball, p: Sequence[Ball], q: Sequence[Ball]) -> Ball:
    """The bilinear form of a symmetric matrix."""
    found = exact(np.zeros(m.v.shape[2:]))
    for i in range(3):
        for j in range(3):
            found = found + p[i] * q[j] * m[i, j]
    return found


def _of_conics(p: Ball, q: Ball, box: Array) -> Crossings:
    """Crossings of two conics with matrices p and q each."""
    left, parts = np.arange(box.shape[1]), list[Crossings]()
    turns = _turns()
    for turn in turns:
        search = _Search(*(_in_frame(of[:, :, left], turn[:, :, None]) for of in (p, q)))
        last = turn is turns[-1]
        done = ~search.open.any(axis=0) | last
        which, at = np.nonzero(search.proved & done)
        u, v = (Ball(of[which, at], search.radius[which, at]) for of in search.places)
        parts.append(_places(left[at], *_turned_back(u, v, turn), np.ones(at.shape, dtype=bool)))
        for at, u, v, sure in search.others(turn, box[:, left]) if last else ():
            parts.append(_places(left[at], *_turned_back(u, v, turn), sure))
        left = left[~done]
        if not left.size:
            break
    return joined(parts)


def _places(pair: Ints, x: Ball, y: Ball, sure: Bools) -> Crossings:
    return Crossings(pair, np.stack((x.v, y.v)), np.maximum(x.e, y.e), sure)


def _turned_back(u: Ball, v: Ball, turn: Array) -> tuple[Ball, Ball]:
    """Places in turned coordinates as they are in the others."""
    x, y, one = _homogeneous(u, v, turn)
    return x / one, y / one


def _homogeneous(u: Ball, v: Ball, turn: Array) -> list[Ball]:
    return [u.times(row[0]) + v.times(row[1]) + exact(np.full_like(u.v, row[2])) for row in turn]


class _Search:
    """The places at which conics with matrices p and q, (3, 3, N), cross: `places`, (2, 8, N), which of them are proved
    crossings, each once, and how far off they are; `open`: the discs (4, N) in which further ones may be."""

    def __init__(self, p: Ball, q: Ball) -> None:
        self.p, self.q = p, q
        self.discs = roots_in_discs(_resultant(p, q))
        self.places = self._near()
        self.radius = np.full(self.places.shape[1:], np.inf)
        self.proved = self._prove()
        self.open = self._open(self.discs)

    def _near(self) -> Array:
        """Where the first conic is at the roots; one of both places is on the second one as well."""
        u = np.concatenate((self.discs.middle.real,) * 2)
        m = self.p.v
        half = m[1, 2] + m[0, 1] * u
        root = np.sqrt(np.maximum(half**2 - m[1, 1] * (m[2, 2] + 2 * m[0, 2] * u + m[0, 0] * u * u), 0.0))
        root[4:] = -root[4:]
        places = np.stack((u, (root - half) / m[1, 1]))
        for _ in range(STEPS):
            (f, f_u, f_v), (g, g_u, g_v) = (_values(of.v, places) for of in (self.p, self.q))
            places = places - np.stack((g_v * f - f_v * g, f_u * g - g_u * f)) / (f_u * g_v - f_v * g_u)
        return places

    def _prove(self) -> Bools:
        """Which places are next to a crossing, each crossing once; the surest come first."""
        radius = _proved_radius(self.p, self.q, self.places)
        best = np.argsort(radius, axis=0, kind="stable")
        self.radius, *places = (np.take_along_axis(of, best, axis=0) for of in (radius, *self.places))
        self.places, proved = np.stack(places), np.isfinite(self.radius)
        gap = np.hypot(*(of[:, None] - of[None] for of in self.places))
        same = (gap <= self.radius[:, None] + self.radius[None]) & proved[:, None] & proved[None]
        found: Bools = proved & ~(same & np.tri(8, k=-1, dtype=bool)[:, :, None]).any(axis=1)
        return found

    def _open(self, discs: RootDiscs) -> Bools:
        """The discs that hold more roots than places are proved in them and those that hang together with them."""
        inside = np.abs(self.places[0][None] - discs.middle[:, None]) <= discs.radius[:, None]
        among = (discs.together[:, :, None] & inside[None]).any(axis=1) & self.proved[None]
        found: Bools = discs.real & (among.sum(axis=1) < discs.together.sum(axis=1))
        return found

    def others(self, turn: Array, box: Array) -> list[tuple[Ints, Ball, Ball, Bools]]:
        """Where further crossings may be, of which pairs, but for what is outside of boxes (4, N); and whether there
        is just one: at a simple root, that is real since its conjugate would be in its disc as well."""
        first = self.open & ~(self.discs.together & np.tri(4, k=-1, dtype=bool)[:, :, None]).any(axis=1)
        which, at = np.nonzero(first)  # of discs that hang together
        u = self.discs.united(which, at)
        m, n = self.p[:, :, at], self.q[:, :, at]
        half = m[1, 2] + m[0, 1] * u
        root = (half * half - m[1, 1] * (m[2, 2] + (m[0, 2] * u).times(2.0) + m[0, 0] * u * u)).root()
        whole, slope = (_at(part, u) for part in _shared(m, n))
        alone = -whole / slope
        simple = np.isfinite(alone.e) & (self.discs.together[which, :, at].sum(axis=1) == 1)
        found = []
        for v, some in ((alone, simple), *(((root.times(sign) - half) / m[1, 1], ~simple) for sign in (1.0, -1.0))):
            place = [u, v, exact(np.ones_like(u.v))]
            there = some & ~np.isnan(v.v) & ~(np.abs(v.v - alone.v) > v.e + alone.e)
            there &= _form(n, place, place).may_vanish() & ~_beyond(_homogeneous(u, v, turn), box[:, at])
            found.append((at[there], u[there], v[there], simple[there]))
        return found


def _proved_radius(p: Ball, q: Ball, places: Array) -> Array:
    """How far from places (2, K, N) there is a crossing, just one in eight times that, of any two conics within the
    radii of p and q; infinite where that is not proved."""
    size = np.stack((*np.abs(places), np.ones_like(places[0])))
    (f, f_u, f_v), (g, g_u, g_v) = (_values(of.v, places) for of in (p, q))
    doubt = sum((of.e + 8 * EPS * np.abs(of.v) for of in (p, q)), np.zeros_like(p.e))
    off = np.einsum("ikn,ijn,jkn->kn", size, doubt, size)
    turned = 2 * np.einsum("ijn,jkn->kn", doubt[:2], size)
    below = np.abs(f_u * g_v - f_v * g_u)
    inverse = np.sqrt(f_u**2 + f_v**2 + g_u**2 + g_v**2) / below
    inverse = np.where(inverse * turned < 0.5, inverse / (1 - inverse * turned), np.inf)
    step = np.hypot(g_v * f - f_v * g, f_u * g - g_u * f) / below
    step = step * (1 + 4 * inverse * turned) + inverse * off
    bends = 2 * np.hypot(*((np.abs(of.v) + of.e)[:2, :2].sum(axis=(0, 1)) for of in (p, q)))
    return np.where(inverse * bends * step <= PROVED, 2 * step + EPS * size[:2].max(axis=0), np.inf)


def _beyond(place: Sequence[Ball], box: Array) -> Bools:
    """Which places are outside of boxes for certain, also at infinity."""
    x, y, one = place
    found: Bools = np.zeros(one.v.shape, dtype=bool)
    for of, low, high in ((x, *box[:2]), (y, *box[2:])):
        found = found | ((sides := (of - one.times(low)) * (of - one.times(high))).v > sides.e)
    return found


def _values(m: Array, places: Array) -> tuple[Array, Array, Array]:
    """Conics at places (2, K, N), and their slopes along both coordinates."""
    u, v = places
    f_u, f_v, rest = (m[i, 0] * u + m[i, 1] * v + m[i, 2] for i in range(3))
    return u * f_u + v * f_v + rest, 2 * f_u, 2 * f_v


def _resultant(p: Ball, q: Ball) -> Ball:
    """The polynomial in u, (5, N), that is 0 where two conics meet (Bezout's form)."""
    (p0, p1, _), (q0, q1, _) = _in_v(p), _in_v(q)
    a, b = _shared(p, q)
    return stacked(_less(_product(a, a), _product(b, _less(_product(p1, q0), _product(q1, p0)))))


def _shared(p: Ball, q: Ball) -> tuple[list[Ball], list[Ball]]:
    """Polynomials a and b in u with a + b*v = 0 where two conics meet: the line of their pencil through that place."""
    (p0, p1, p2), (q0, q1, q2) = _in_v(p), _in_v(q)
    return _less(_product(p2, q0), _product(q2, p0)), _less(_product(p2, q1), _product(q2, p1))


def _in_v(m: Ball) -> tuple[list[Ball], list[Ball], list[Ball]]:
    """The coefficients of 1, v and v*v of a conic with matrix m, as polynomials in u."""
    return [m[2, 2], m[0, 2].times(2.0), m[0, 0]], [m[1, 2].times(2.0), m[0, 1].times(2.0)], [m[1, 1]]


def _at(p: Sequence[Ball], u: Ball) -> Ball:
    """The value of a polynomial."""
    found = p[-1]
    for coefficient in reversed(p[:-1]):
        found = found * u + coefficient
    return found


def _product(p: Sequence[Ball], q: Sequence[Ball]) -> list[Ball]:
    found: dict[int, Ball] = {}
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            found[i + j] = found[i + j] + a * b if i + j in found else a * b
    return [found[n] for n in range(len(found))]


def _less(p: Sequence[Ball], q: Sequence[Ball]) -> list[Ball]:
    return [a - b for a, b in zip(p, q, strict=True)]
