"""How much of an infinite range an integrand takes up: a density leaves next to nothing beyond some place.

Owns `pulled_in` and `reaches`. What the integrand is at most, on shells that grow around where it is
concentrated, follows from its enclosure; where what all the shells farther out can hold is below rounding, nothing
needs to be looked for, nor evaluated.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from potto.calculus.decomposition.sweep import Level
from potto.core.terms import Var, postorder
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.pieces import gather
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.intervals import ANYTHING, Interval, enclosure
from potto.integrate.rules.magnitudes import log_magnitude
from potto.integrate.rules.substitution import Segments, choose
from potto.kernels.cells import Array, Cell, Ints, Value

# Of shells, before one of them is looked at more closely; far out as large as rounding lets `k*log(x) - x` be told from
# 0, and `-x^2 - y^4` from what rounding makes of its larger end. Of infinity itself that says nothing, so that the last
# one ends where numbers nearly do.
SIZES = np.concatenate((4.0 ** np.arange(-22, 23), 2.0 ** np.arange(56, 964, 12)))
FARTHEST = 2.0**964
HUGE = 2.0**45  # from here on shells are so long that exponents of both signs are not told from each other
PARTS = 32  # into which that is divided
PIECES = 4  # of a shell, of each of which it is told how large logarithms are
APART = 2.0**16  # how far off, in terms of where most of it is, a range ends whose nodes see that
NOTHING = EPS * EPS  # of what a shell holds at most
Ranges = dict[str, tuple[Array, Array]]


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


def reaches(
    plan: Plan,
    env: dict[str, Value],
    numbers: Sequence[int],
    ends: tuple[Array, Array] | None = None,
    batch: int = 1,
) -> tuple[Ranges, Array]:
    """By variable whose range is infinite, a range beyond which there is next to nothing wherever the variables further
    out are, infinite where none is known; and how much there is beyond them, at most: (B,).

    numbers: of the variables, one after the other; ends: the bounds of the first one, lower ones first.
    """
    box = _box(plan, env, batch)
    found: Ranges = {}
    left_out = np.zeros(batch)
    for number in numbers:
        level = plan.levels[number].level
        low, high = ends or _columns(_enclosed(level, box), batch)
        ends = None
        if np.isinf(low).any() or np.isinf(high).any():
            low, high, lost = _Range(plan, number, box, low, high).found(_volume(plan, number, box, batch))
            left_out += lost
            found[level.variable] = low, high
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
    """The environment as intervals, a row for each member, and variables further in between their bounds."""
    box: dict[str, Interval] = {node.name: ANYTHING for node in postorder(plan.mass) if isinstance(node, Var)}
    for name, value in env.items():
        if isinstance(value, Cell):
            column = as_array(value.v, batch)[:, None]
            box[name] = column, column
    for level in (each.level for each in plan.levels if each.level.variable not in env):
        box[level.variable] = _enclosed(level, box)
    return box


def _volume(plan: Plan, number: int, box: dict[str, Interval], batch: int) -> Array:
    """The size of the ranges of the variables further in: of an infinite one the part that matters."""
    volume = np.ones(batch)
    for inner in range(number + 1, len(plan.levels)):
        level = plan.levels[inner].level
        below, above = _columns(_enclosed(level, box), batch)
        if not (np.isfinite(below).all() and np.isfinite(above).all()):
            found = _Range(plan, inner, box, below, above).found(np.ones(batch))
            below, above = as_array(found[0], batch), as_array(found[1], batch)
            if not (np.isfinite(below).all() and np.isfinite(above).all()):
                return np.full(batch, np.inf)
        box[level.variable] = below[:, None], above[:, None]
        volume *= above - below
    return volume


def _enclosed(level: Level, box: dict[str, Interval]) -> Interval:
    """Between which ends a range lies. An infinite bound has no enclosure, and is taken as it is."""
    (low, high), (least, most) = (
        [np.where(np.isnan(end), far, end) for end in side]
        for side, far in zip(enclosure((level.lo, level.hi), box), (-np.inf, np.inf), strict=True)
    )
    return np.minimum(low, least), np.maximum(high, most)


def _stretches(plan: Plan, number: int, box: dict[str, Interval]) -> Array:
    """The size of the ranges of the variables further in, none of them infinite on shells of this one: (B, places)."""
    volume: Array = np.ones(())
    box = dict(box)
    for level in (each.level for each in plan.levels[number + 1 :]):
        box[level.variable] = ends = _enclosed(level, box)
        with np.errstate(invalid="ignore"):
            volume = volume * (ends[1] - ends[0])
    return np.where(np.isnan(volume), np.inf, volume)


class _Range:
    """The range of one variable, others in a box."""

    def __init__(self, plan: Plan, number: int, box: dict[str, Interval], low: Array, high: Array) -> None:
        self.plan, self.number = plan, number
        self.body, self.box = plan.mass, dict(box)
        self.level, self.low, self.high = plan.levels[number].level, low, high
        # Where a variable further out is infinite nothing is there, though no enclosure tells.
        infinite = [np.isinf(least) & (least == most) for least, most in self.box.values()]
        nowhere = np.broadcast_arrays(np.zeros((low.size, 1), dtype=bool), *infinite)
        self.nowhere = np.logical_or.reduce(nowhere)

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
        """The nearest place beyond which there is next to nothing, infinite if there is none, and how much there is."""
        far = start[:, None] + side * np.concatenate(([0.0], SIZES, [FARTHEST]))
        held = self.held(side, far, volume)
        most = np.max(held, axis=1, initial=0.0, where=np.isfinite(held))
        row = np.arange(start.size)
        at, left = _first(held, most)
        peak = np.where(np.isfinite(held), held, -1.0).argmax(axis=1)
        reach = far[row, np.where(at <= SIZES.size, at, 0)]
        most = np.minimum(most, np.max(self.held(side, _parts(start, reach), volume), axis=1, initial=0.0))
        at, left = _first(held, most)
        known = (at <= SIZES.size) & (np.abs(far[row, at] - start) <= APART * np.abs(far[row, peak + 1] - start))
        at = np.where(known, at, 0)
        fine = _parts(far[row, np.maximum(at - 1, 0)], far[row, at])
        within = self.held(side, fine, volume)
        part, left = _first(np.concatenate((within, left[:, None]), axis=1), most)
        return np.where(known, fine[row, np.minimum(part, PARTS)], side * np.inf), left

    def held(self, side: float, places: Array, volume: Array) -> Array:
        """What there is at most between one place and the next: (B, places - 1)."""
        ends = places[:, :-1], places[:, 1:]
        box = {**self.box, self.level.variable: ends if side > 0 else ends[::-1]}
        lo, hi = (np.broadcast_to(end, ends[0].shape) for end in enclosure((self.body,), box)[0])
        unknown = np.isnan(lo)
        size = np.where(unknown, 0.0, np.maximum(np.abs(lo), np.abs(hi)))
        unknown &= ~self.nowhere
        if unknown.any():  # 0 times what overflows
            size = np.where(unknown, self.by_logarithms(ends), size)
        within = volume[:, None]
        if np.isinf(volume).any():  # ranges further in that grow with this variable
            within = np.minimum(within, _stretches(self.plan, self.number, box))
        with np.errstate(invalid="ignore"):
            return np.where(size == 0, 0.0, size * np.abs(ends[1] - ends[0]) * within)

    def by_logarithms(self, ends: tuple[Array, Array]) -> Array:
        """How large the integrand is at most between places (B, places), a piece at a time. Beyond HUGE, where
        shells are long and exponents beyond what numbers hold, nothing if it fell off before."""
        shape = ends[0].shape
        known = np.maximum(np.abs(ends[0]), np.abs(ends[1])) <= HUGE
        near = np.flatnonzero(known.any(axis=0))
        bound = np.full(shape, -np.inf)
        steps = np.linspace(0.0, 1.0, PIECES + 1)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            first, last = (end[:, near, None] for end in ends)
            grid = first + steps * (last - first)
            one, other = (part.reshape(shape[0], -1) for part in (grid[..., :-1], grid[..., 1:]))
            box = {**self.box, self.level.variable: (np.minimum(one, other), np.maximum(one, other))}
            found = np.broadcast_to(log_magnitude(self.body, box), one.shape).reshape(*grid.shape[:2], PIECES)
            bound[:, near] = found.max(axis=2)
            held = np.where(known, bound + np.log(np.abs(ends[1] - ends[0])), -np.inf)
            end = np.maximum(known.sum(axis=1, keepdims=True) - 1, 1)
            grows = np.take_along_axis(held, end, axis=1) > np.take_along_axis(held, end - 1, axis=1)
            return np.exp(np.where(known, bound, np.where(grows, np.inf, -np.inf)))


def _columns(ends: Interval, batch: int) -> tuple[Array, Array]:
    low, high = (as_array(np.broadcast_to(end, (batch, 1))[:, 0], batch) for end in ends)
    return low, high


def _parts(start: Array, end: Array) -> Array:
    parts: Array = start[:, None] + np.linspace(0, 1, PARTS + 1) * (end - start)[:, None]
    return parts


def _first(held: Array, most: Array) -> tuple[Any, Array]:
    """From which shell on all of them together hold next to nothing of the most that one holds, and what they do;
    behind the last one where that is not known."""
    left = np.cumsum(held[:, ::-1], axis=1)[:, ::-1]
    left = np.concatenate((left, np.zeros((held.shape[0], 1))), axis=1)
    little = left <= (NOTHING * most)[:, None]
    at = np.where(little.any(axis=1), np.argmax(little, axis=1), held.shape[1])
    return at, left[np.arange(held.shape[0]), at]
