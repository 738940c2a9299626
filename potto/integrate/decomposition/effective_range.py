"""How much of an infinite range an integrand takes up: a density leaves next to nothing beyond some place.

Owns `concentrated`, `pulled_in` and `reaches`. What the integrand is at most, on shells that grow around where it is
concentrated, follows from its enclosure; where what all the shells farther out can hold is below rounding, nothing
needs to be looked for, nor evaluated.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from potto.core.terms import Var, postorder
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.pieces import gather
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.intervals import ANYTHING, Interval, enclosure
from potto.integrate.rules.substitution import Segments, choose
from potto.kernels.cells import Array, Cell, Ints, Value

# Of shells, before one of them is looked at more closely; far out as large as rounding lets `k*log(x) - x` be told from
# 0. Of infinity itself that says nothing, so that the last one ends where numbers nearly do.
SIZES = np.concatenate((4.0 ** np.arange(-22, 23), 2.0 ** np.arange(84, 964, 40)))
FARTHEST = 2.0**964
PARTS = 32  # into which that is divided
NOTHING = EPS * EPS  # of what a shell holds at most


def concentrated(
    plan: Plan, number: int, env: dict[str, Value], lo: Cell, hi: Cell, batch: int
) -> tuple[Cell, Cell, Array] | None:
    """Bounds of variable `number` beyond which the integrand holds next to nothing, and how much at most: (B,).

    None where the range is finite, or no such bounds are known.
    """
    low, high = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    if np.isfinite(low).all() and np.isfinite(high).all():
        return None
    box = _box(plan, env, batch)
    low, high, lost = _Range(plan, number, box, low, high).found(_volume(plan, number, box, batch))
    return (Cell(low), Cell(high), lost) if np.isfinite(low).all() and np.isfinite(high).all() else None


def pulled_in(plan: Plan, number: int, env: dict[str, Value], seg: Segments, batch: int) -> Array | None:
    """Give infinite segments the ends beyond which there is next to nothing; and say how much there is, at most, (B,).

    What is far out is not evaluated, where a density is 0 to rounding and what it weighs overflows. None where nothing
    changes: no end is infinite, or none is known.
    """
    rows = np.nonzero(np.isinf(seg.a) | np.isinf(seg.b))[0]
    if not rows.size:
        return None
    owner, low, high = seg.owner[rows], seg.a[rows], seg.b[rows]
    alike, one = _alike(plan, env, owner, low, high, batch)
    box = _box(plan, gather(env, owner[one]), one.size)
    start, end = np.full(one.size, -np.inf), np.full(one.size, np.inf)
    np.maximum.at(start, alike, low)
    np.minimum.at(end, alike, high)
    near, far, lost = (
        found[alike] for found in _Range(plan, number, box, start, end).found(_volume(plan, number, box, one.size))
    )
    near, far = np.where(np.isinf(low), near, low), np.where(np.isinf(high), far, high)
    known = (np.isfinite(near) | ~np.isinf(low)) & (np.isfinite(far) | ~np.isinf(high)) & (near < far)
    if not known.any():
        return None
    rows, owner = rows[known], owner[known]
    seg.a[rows], seg.b[rows] = near[known], far[known]
    seg.kind[rows] = choose(seg.a[rows], seg.b[rows], seg.left[rows], seg.right[rows])
    left_out: Array = np.bincount(owner, lost[known], minlength=batch).astype(float)
    return left_out


def reaches(plan: Plan, env: dict[str, Value]) -> tuple[dict[str, tuple[float, float]], float]:
    """By variable of one integral whose range is infinite, a range beyond which there is next to nothing wherever the
    variables further out are, infinite where none is known; and how much there is, at most."""
    box = _box(plan, env, 1)
    found: dict[str, tuple[float, float]] = {}
    left_out = 0.0
    for number, level in enumerate(own.level for own in plan.levels):
        below, above = enclosure((level.lo, level.hi), box)
        low, high = np.fmin(below[0], above[0]).reshape(1), np.fmax(below[1], above[1]).reshape(1)
        if np.isinf(low).any() or np.isinf(high).any():
            low, high, lost = _Range(plan, number, box, low, high).found(_volume(plan, number, box, 1))
            left_out += float(lost[0])
            found[level.variable] = float(low[0]), float(high[0])
        box[level.variable] = low[:, None], high[:, None]
    return found, left_out


def _alike(plan: Plan, env: dict[str, Value], owner: Ints, low: Array, high: Array, batch: int) -> tuple[Ints, Ints]:
    """Which segments are alike in all that their integrands depend on, and one of each kind: those that differ only by
    where they begin have the same far end."""
    given = [value.v for name in sorted(plan.mass.free) if isinstance(value := env.get(name), Cell)]
    columns = [np.isinf(low), np.isinf(high), *(as_array(v, batch)[owner] for v in given if np.ndim(v))]
    _, one, alike = np.unique(np.stack(columns), axis=1, return_index=True, return_inverse=True)
    return alike.reshape(-1), one


def _box(plan: Plan, env: dict[str, Value], batch: int) -> dict[str, Interval]:
    """The environment as intervals, a row for each member."""
    box: dict[str, Interval] = {node.name: ANYTHING for node in postorder(plan.mass) if isinstance(node, Var)}
    for name, value in env.items():
        if isinstance(value, Cell):
            column = as_array(value.v, batch)[:, None]
            box[name] = column, column
    return box


def _volume(plan: Plan, number: int, box: dict[str, Interval], batch: int) -> Array:
    """The size of the ranges of the variables further in: of an infinite one the part that matters."""
    volume = np.ones(batch)
    for inner in range(number + 1, len(plan.levels)):
        level = plan.levels[inner].level
        ends = enclosure((level.lo, level.hi), box)
        below, above = (
            as_array(np.broadcast_to(pick(ends[0][i], ends[1][i]), (batch, 1))[:, 0], batch)
            for i, pick in ((0, np.fmin), (1, np.fmax))
        )
        if not (np.isfinite(below).all() and np.isfinite(above).all()):
            found = _Range(plan, inner, box, below, above).found(np.ones(batch))
            below, above = as_array(found[0], batch), as_array(found[1], batch)
            if not (np.isfinite(below).all() and np.isfinite(above).all()):
                return np.full(batch, np.inf)
        box[level.variable] = below[:, None], above[:, None]
        volume *= above - below
    return volume


def _stretches(plan: Plan, number: int, box: dict[str, Interval]) -> Array:
    """The size of the ranges of the variables further in, none of them infinite on shells of this one: (B, places)."""
    volume: Array = np.ones(())
    box = dict(box)
    for level in (each.level for each in plan.levels[number + 1 :]):
        below, above = enclosure((level.lo, level.hi), box)
        box[level.variable] = ends = np.fmin(below[0], above[0]), np.fmax(below[1], above[1])
        with np.errstate(invalid="ignore"):
            volume = volume * (ends[1] - ends[0])
    return np.where(np.isnan(volume), np.inf, volume)


class _Range:
    """The range of one variable, others in a box."""

    def __init__(self, plan: Plan, number: int, box: dict[str, Interval], low: Array, high: Array) -> None:
        self.plan, self.number = plan, number
        self.body, self.box = plan.mass, dict(box)
        self.level, self.low, self.high = plan.levels[number].level, low, high

    def found(self, volume: Array) -> tuple[Array, Array, Array]:
        """The ends of what matters, infinite where none is known, and what is left out at most."""
        ends, lost = [], np.zeros(self.low.size)
        for side, bound, other in ((-1.0, self.low, self.high), (1.0, self.high, self.low)):
            infinite = np.isinf(bound)
            if not infinite.any():
                ends.append(bound)
                continue
            place, left = self.end(side, self.middle(side, other), volume)
            ends.append(np.where(infinite, place, bound))
            lost += np.where(infinite & np.isfinite(place), left, 0.0)
        return ends[0], ends[1], lost

    def middle(self, side: float, other: Array) -> Array:
        """Where shells begin: the outermost hint, else 0, and not beyond the other bound."""
        pick = np.fmax if side > 0 else np.fmin
        start = np.full(self.low.size, np.nan)
        for at in enclosure(self.level.hints, self.box):
            value = np.broadcast_to(0.5 * (at[0] + at[1]), (self.low.size, 1))[:, 0]
            start = pick(start, np.where(np.isfinite(value), value, np.nan))
        start = np.where(np.isnan(start), 0.0, start)
        return np.where(np.isfinite(other), pick(start, other), start)

    def end(self, side: float, start: Array, volume: Array) -> tuple[Array, Array]:
        """The nearest place beyond which there is next to nothing, inf if there is none, and how much there is."""
        far = start[:, None] + side * np.concatenate(([0.0], SIZES, [FARTHEST]))
        held = self.held(side, far, volume)
        most = np.max(held, axis=1, initial=0.0, where=np.isfinite(held))
        row = np.arange(start.size)
        at, left = _first(held, NOTHING * most)
        reach = far[row, np.where(at <= SIZES.size, at, 0)]
        most = np.minimum(most, np.max(self.held(side, _parts(start, reach), volume), axis=1, initial=0.0))
        at, left = _first(held, NOTHING * most)
        known = at <= SIZES.size
        at = np.where(known, at, 0)
        fine = _parts(far[row, np.maximum(at - 1, 0)], far[row, at])
        within = self.held(side, fine, volume)
        part, left = _first(np.concatenate((within, left[:, None]), axis=1), NOTHING * most)
        return np.where(known, fine[row, np.minimum(part, PARTS)], np.inf), left

    def held(self, side: float, places: Array, volume: Array) -> Array:
        """What there is at most between one place and the next: (B, places - 1)."""
        ends = places[:, :-1], places[:, 1:]
        box = {**self.box, self.level.variable: ends if side > 0 else ends[::-1]}
        lo, hi = (np.broadcast_to(end, ends[0].shape) for end in enclosure((self.body,), box)[0])
        size = np.where(np.isnan(lo), 0.0, np.maximum(np.abs(lo), np.abs(hi)))
        within = volume[:, None]
        if np.isinf(volume).any():  # ranges further in that grow with this variable
            within = np.minimum(within, _stretches(self.plan, self.number, box))
        with np.errstate(invalid="ignore"):
            return np.where(size == 0, 0.0, size * np.abs(ends[1] - ends[0]) * within)


def _parts(start: Array, end: Array) -> Array:
    parts: Array = start[:, None] + np.linspace(0, 1, PARTS + 1) * (end - start)[:, None]
    return parts


def _first(held: Array, allowed: Array) -> tuple[Any, Array]:
    """From which shell on all of them together hold no more than is allowed, and what they do."""
    left = np.cumsum(held[:, ::-1], axis=1)[:, ::-1]
    left = np.concatenate((left, np.zeros((held.shape[0], 1))), axis=1)
    at = np.argmax(left <= allowed[:, None], axis=1)
    return at, left[np.arange(held.shape[0]), at]
