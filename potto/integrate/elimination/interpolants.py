"""Functions of one number as polynomials on pieces, with their tangents and errors.

Owns `InterpolantTable`, `tabulated` and `concentration`. The pieces lie between the places where the function is not
smooth, which are known and move with the parameters; each is halved until its Legendre coefficients say that the
polynomial is as good as asked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from potto.integrate.pieces import Sums
from potto.integrate.rules import substitution
from potto.integrate.rules.gauss import EPS, GaussRule, gauss
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Cell, Ints

ORDER = 16
ROUNDS, MOST = 40, 2000  # of halvings; pieces
# How far apart neighbouring pieces may be where they meet, as a part of the largest value, beyond their errors.
GAP = 1e-9
BESIDE = 2.0**-40  # how far from its ends a piece is looked at, as a part of it: on them it may jump
# What the coefficients that are left out may add up to, of the largest value, to be taken for rounding where it is
# still this part of itself on half of a piece: of what is smooth it is 2^-16.
NOISE, STUCK = 1e-12, 0.35
TINY = np.finfo(float).tiny
SEEN = 0.1  # of the largest value
ROUNDED = 16  # how many roundings a number may be beyond the table that is on its end

# From places (n,) with speeds, (k + 1, n) or none, to the function there: `Sums` of one component.
Function = Callable[[Array, Array], Sums]


class InterpolantTable(Struct, frozen=True):
    """V(s) for s in [x0[0], x1[-1]].

    Each piece runs from u0 to u1 of the map of its segment, and from x0 to x1. coefficients: (2 + k, P, n) of shifted
    Legendre polynomials: of V, then of V's derivatives by the parameters where s moves along with its segment's ends,
    and last of dV/du. error: (2 + k, P) of the same, in the mean over the piece: there an interpolant through Gauss
    nodes is off by no more than the values that it goes through, since the rule is exact for its square. largest: of
    |V|. met: the largest that was asked for, the least s, and the greatest.
    """

    segments: Segments
    segment: Ints
    u0: Array
    u1: Array
    x0: Array
    x1: Array
    coefficients: Array
    error: Array
    largest: float = 0.0
    met: Array = field(default_factory=lambda: np.array((0.0, np.inf, -np.inf)))

    @property
    def seen(self) -> bool:
        """Whether anyone has asked for V where it is large between the least s and the greatest that were asked for: if
        not, a peak may have been missed. What lies beyond them hardly weighs."""
        most, least, greatest = self.met
        if most >= SEEN * self.largest:
            return True
        x, _, v = self.at_nodes
        return bool(most >= SEEN * np.abs(v).max(initial=0.0, where=(least <= x) & (x <= greatest)))

    @property
    def at_nodes(self) -> tuple[Array, Array, Array]:
        """The Gauss nodes of all pieces, dx/du, and V: (P, n) each."""
        rule = gauss(ORDER)
        back = np.polynomial.legendre.legvander(2 * rule.nodes - 1, ORDER - 1)
        u = self.u0[:, None] + (self.u1 - self.u0)[:, None] * rule.nodes
        x, slope, _ = substitution.points(self.segments.pick(self.segment), u)
        return x, slope, self.coefficients[0] @ back.T

    def at(self, s: Cell, k: int, wide: int) -> Cell:
        """V at numbers that move in `wide` directions, the first k of which are those of the parameters; 0 beyond the
        table, which holds all that matters."""
        shape = np.shape(s.v)
        x = np.clip(asked := np.ravel(s.v), self.x0[0], self.x1[-1])
        piece = np.searchsorted(self.x0[1:], x, side="right")
        seg = self.segments.pick(self.segment[piece])
        q, slope = _inverse(seg, x)
        width = (self.u1 - self.u0)[piece]
        z = np.clip(2 * (q - self.u0[piece]) / width - 1, -1.0, 1.0)
        p = np.polynomial.legendre.legvander(z, self.coefficients.shape[-1] - 1)
        within = np.abs(asked - x) <= ROUNDED * EPS * np.abs(x)
        values = np.einsum("ni,cni->cn", p, self.coefficients[:, piece]) * within
        errors = self.error[:, piece] * within
        v, e = values[0].reshape(shape), errors[0].reshape(shape)
        most, least, greatest = self.met
        self.met[:] = (
            np.abs(v).max(initial=most),
            np.fmin.reduce(x, initial=least),
            np.fmax.reduce(x, initial=greatest),
        )
        if not wide:
            return Cell(v, e)
        label = substitution.label(seg, x[:, None])
        t, et = [], []
        for d in range(wide):
            rate = s.t[d] if d < len(s.t) else None
            by = np.zeros(x.size) if rate is None else np.broadcast_to(np.asarray(rate), shape).reshape(-1)
            own, off = (values[1 + d], errors[1 + d]) if d < k else (np.zeros(x.size), np.zeros(x.size))
            by = np.where(within, by - substitution.velocity(seg, label, d)[0][:, 0] if d < k else by, 0.0)
            with np.errstate(divide="ignore", invalid="ignore"):
                moved = np.where(by == 0, 0.0, by / slope)
            t.append((own + moved * values[-1]).reshape(shape))
            et.append((off + np.abs(moved) * errors[-1]).reshape(shape))
        return Cell(v, e, tuple(t), tuple(et))


def tabulated(
    segments: Segments, k: int, function: Function, rtol: float, exhausted: Callable[[], bool], even: bool
) -> InterpolantTable | None:  # fmt: skip
    """The function on the segments; None where it is not continuous, does not become smooth on pieces, or takes more
    than there is. even: whether no part of them weighs more than others of its length, as a density does."""
    count = segments.a.size
    todo = (np.arange(count), np.zeros(count), np.ones(count))
    done: list[tuple[Ints, Array, Array, Array, Array, Array]] = []
    rule, largest, total, parents = gauss(ORDER), np.zeros(2 + k), 0, np.full(count, np.inf)
    for turn in range(ROUNDS):
        coefficients, error, most = _measured(segments, todo, k, function, rule)
        if exhausted() or not np.isfinite(coefficients).all():
            return None
        total += todo[0].size
        largest = np.maximum(largest, most)
        lost = _cut_off(np.abs(coefficients))
        before = lost[0] + error[0]
        lost[0] = np.maximum(lost[0], _off_at_the_ends(segments, todo, coefficients[0], function, rule))
        # What is off on a short piece counts little, even where what passes on numbers crowds them there like a root.
        share = np.sqrt((todo[2] - todo[1]) * _lengths(segments)[todo[0]]) if even else 1.0
        missed = lost * share
        coarse = (missed > np.maximum(rtol * largest[:, None], error)).any(axis=0)
        part = (missed / np.maximum(largest, TINY)[:, None]).max(axis=0)
        coarse &= (part > NOISE) | (part < STUCK * parents)
        if turn + 1 == ROUNDS or total > MOST:
            rise = np.abs(coefficients[0] @ rule.ends @ (1.0, -1.0))
            if (coarse & (rise > GAP * largest[0])).any():
                return None  # it jumps
            coarse = np.zeros_like(coarse)
        segment, u0, u1 = todo
        fine = ~coarse
        done.append((segment[fine], u0[fine], u1[fine], coefficients[:, fine], (error + lost)[:, fine], before[fine]))
        if not coarse.any():
            break
        segment, u0, u1, parents = segment[coarse], u0[coarse], u1[coarse], np.tile(part[coarse], 2)
        middle = 0.5 * (u0 + u1)
        todo = (np.tile(segment, 2), np.concatenate((u0, middle)), np.concatenate((middle, u1)))
    table, inside = _joined(segments, done)
    return replace(table, largest=largest[0]) if _continuous(table, inside, rule, largest[0]) else None


def concentration(tables: Sequence[InterpolantTable]) -> tuple[float, float]:
    """The mean and the deviation of a number of whose density some tables are the sum."""
    weights = gauss(ORDER).weights
    moments = np.zeros(3)
    for table in tables:
        x, slope, v = table.at_nodes
        mass = np.abs(v) * weights * slope * (table.u1 - table.u0)[:, None]
        moments += [(mass * x**power).sum() for power in range(3)]
    if not moments[0] > 0:
        return 0.0, 0.0
    mean, square = moments[1:] / moments[0]
    return float(mean), math.sqrt(max(square - mean * mean, 0.0))


def _lengths(segments: Segments) -> Array:
    """The lengths of segments, as parts of the whole; of an infinite one each is all."""
    length = segments.b - segments.a
    whole = length.sum()
    return length / whole if np.isfinite(whole) else np.ones(length.size)


def _joined(
    segments: Segments, parts: list[tuple[Ints, Array, Array, Array, Array, Array]]
) -> tuple[InterpolantTable, Array]:  # fmt: skip
    """The table of pieces that were finished at different times, in order, and the errors of V by its nodes alone."""
    segment = np.concatenate([part[0] for part in parts])
    u0, u1 = (np.concatenate([part[i] for part in parts]) for i in (1, 2))
    coefficients, error = (np.concatenate([part[i] for part in parts], axis=1) for i in (3, 4))
    inside = np.concatenate([part[5] for part in parts])
    x0, x1 = (substitution.points(segments.pick(segment), u[:, None])[0][:, 0] for u in (u0, u1))
    order = np.lexsort((u0, segments.a[segment]))
    table = InterpolantTable(segments, segment[order], u0[order], u1[order], x0[order], x1[order],
                             coefficients[:, order], error[:, order])  # fmt: skip
    return table, inside[order]


def _measured(
    segments: Segments, todo: tuple[Ints, Array, Array], k: int, function: Function, rule: GaussRule
) -> tuple[Array, Array, Array]:
    """Coefficients of pieces, the errors of what they are made of, and the largest magnitudes (2 + k,)."""
    segment, u0, u1 = todo
    seg = segments.pick(segment)
    x, slope, label = substitution.points(seg, u0[:, None] + (u1 - u0)[:, None] * rule.nodes)
    speeds = np.empty((k + 1, *x.shape))
    for d in range(k):
        speeds[d] = substitution.velocity(seg, label, d)[0]
    speeds[k] = slope
    sums = function(x.ravel(), speeds.reshape(k + 1, -1))
    h = np.concatenate((sums.v, sums.t[0])).reshape(2 + k, *x.shape)
    e = np.concatenate((sums.e, sums.et[0])).reshape(2 + k, *x.shape)
    size = np.abs(h).max(axis=-1)
    rounding = size.copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        carried = np.abs(h[-1] * speeds[:k] / slope).max(axis=-1)  # may have cancelled
    rounding[1:-1] += np.where(np.isfinite(carried), carried, 0.0)
    return h @ rule.transform, e.max(axis=-1) + 4 * EPS * rounding, size.max(axis=-1)


def _off_at_the_ends(
    segments: Segments, todo: tuple[Ints, Array, Array], coefficients: Array, function: Function, rule: GaussRule
) -> Array:
    """By how much polynomials miss the function at the ends of their pieces, where peaks are and no nodes: (P,)."""
    segment, u0, u1 = todo
    inside = np.stack((u0 + BESIDE * (u1 - u0), u1 - BESIDE * (u1 - u0)), axis=1)
    x = substitution.points(segments.pick(segment), inside)[0]
    found = function(x.ravel(), np.zeros((0, x.size)))
    exact, error = found.v[0].reshape(x.shape), found.e[0].reshape(x.shape)
    near = np.polynomial.legendre.legvander(np.array([2 * BESIDE - 1, 1 - 2 * BESIDE]), rule.nodes.size - 1)
    off = np.maximum(np.abs(exact - coefficients @ near.T) - error, 0.0)
    return np.where(np.isfinite(off), off, 0.0).max(axis=1)  # type: ignore[no-any-return]


def _cut_off(size: Array) -> Array:
    """What the coefficients (.., n) that are left out may add up to, twice, if they fall on like those before."""
    n = size.shape[-1]
    end, before = size[..., -1] + size[..., -2], size[..., -3] + size[..., -4]
    middle = size[..., n // 2] + size[..., n // 2 - 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        decay = np.fmax(end / before, (end / middle) ** (2 / (n - 1 - n // 2)))
    decay = np.clip(np.where(np.isfinite(decay), decay, 0.0), 0.0, 0.9)
    lost: Array = 4 * end * np.maximum(decay, 0.05) / (1 - decay)
    return lost


def _continuous(table: InterpolantTable, inside: Array, rule: GaussRule, largest: float) -> bool:
    """Whether neighbouring pieces meet where no jump is known.

    Where they don't, something runs along the variable that was integrated.
    """
    ends = table.coefficients[0] @ rule.ends
    jumps = (table.u0 == 0) & (table.segments.rank[table.segment] == 2)
    gap = np.where(jumps[1:], 0.0, np.abs(ends[1:, 0] - ends[:-1, 1]))
    return bool((gap <= GAP * largest + 4 * (inside[1:] + inside[:-1])).all())


def _inverse(seg: Segments, x: Array) -> tuple[Array, Array]:
    """Which u the maps of segments take to x, one in each, and dx/du there."""
    a, b = seg.a, seg.b
    with np.errstate(invalid="ignore"):
        q, slope = (x - a) / (b - a), b - a
    for kind, inverse in _INVERSES.items():
        rows = seg.kind == kind
        if rows.any():
            q, slope = q.copy(), slope.copy()
            q[rows], slope[rows] = inverse(seg.pick(rows), x[rows])
    return q, slope


def _left(seg: Segments, x: Array) -> tuple[Array, Array]:
    low, high = np.sqrt(seg.a - seg.left), np.sqrt(seg.b - seg.left)
    root = np.sqrt(_distance(x - seg.left, seg.left))
    return (root - low) / (high - low), 2 * root * (high - low)


def _right(seg: Segments, x: Array) -> tuple[Array, Array]:
    low, high = np.sqrt(seg.right - seg.a), np.sqrt(seg.right - seg.b)
    root = np.sqrt(_distance(seg.right - x, seg.right))
    return (low - root) / (low - high), 2 * root * (low - high)


def _both(seg: Segments, x: Array) -> tuple[Array, Array]:
    c, d = seg.left, seg.right
    low, high = (np.arctan2(np.sqrt(y - c), np.sqrt(d - y)) for y in (seg.a, seg.b))
    half = np.arctan2(np.sqrt(_distance(x - c, c)), np.sqrt(_distance(d - x, d)))
    return (half - low) / (high - low), 2 * (d - c) * np.sin(half) * np.cos(half) * (high - low)


def _distance(found: Array, turn: Array) -> Array:
    """A distance from a turning point, as large as it may be by rounding: at the point the slope of the map is 0."""
    return np.maximum(found, EPS * np.abs(turn))


def _up(seg: Segments, x: Array) -> tuple[Array, Array]:
    far = (x - seg.a) / seg.pace
    return far / (1 + far), seg.pace * (1 + far) ** 2


def _down(seg: Segments, x: Array) -> tuple[Array, Array]:
    far = (seg.b - x) / seg.pace
    return 1 / (1 + far), seg.pace * (1 + far) ** 2


def _whole(seg: Segments, x: Array) -> tuple[Array, Array]:
    far = np.abs(x)
    w = 2 * far / (1 + np.sqrt(1 + 4 * far * far))
    return 0.5 * (1 + np.copysign(w, x)), 2 * (1 + w * w) / (1 - w * w) ** 2


_INVERSES = {substitution.LEFT: _left, substitution.RIGHT: _right, substitution.BOTH: _both, substitution.UP: _up,
             substitution.DOWN: _down, substitution.WHOLE: _whole}  # fmt: skip
