"""How much of an infinite range an integrand takes up: a density leaves next to nothing beyond some place.

Owns `concentrated`. What the integrand is at most, on shells that double around where it is concentrated, follows from
its enclosure; where what all the shells farther out can hold is below rounding, nothing needs to be looked for.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from potto.core.terms import Var, postorder
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.intervals import ANYTHING, Interval, enclosure
from potto.kernels.cells import Array, Cell, Value

SIZES = 4.0 ** np.arange(-22, 23)  # of shells, before one of them is looked at more closely
PARTS = 16  # into which that is divided
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
    box: dict[str, Interval] = {node.name: ANYTHING for node in postorder(plan.mass) if isinstance(node, Var)}
    for name, value in env.items():
        if isinstance(value, Cell):
            column = as_array(value.v, batch)[:, None]
            box[name] = column, column
    own = _Range(plan, number, box, low, high)
    return own.found(_volume(plan, number, box, batch))


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
            if found is None:
                return np.full(batch, np.inf)
            below, above = as_array(found[0].v, batch), as_array(found[1].v, batch)
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

    def found(self, volume: Array) -> tuple[Cell, Cell, Array] | None:
        ends, lost = [], np.zeros(self.low.size)
        for side, bound, other in ((-1.0, self.low, self.high), (1.0, self.high, self.low)):
            infinite = np.isinf(bound)
            if not infinite.any():
                ends.append(Cell(bound))
                continue
            start = self.middle(side, other)
            place, left = self.end(side, start, volume)
            if not np.isfinite(place[infinite]).all():
                return None
            ends.append(Cell(np.where(infinite, place, bound)))
            lost += np.where(infinite, left, 0.0)
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
        far = start[:, None] + side * np.concatenate(([0.0], SIZES, [np.inf]))
        held = self.held(side, far, volume)
        most = np.max(held, axis=1, initial=0.0, where=np.isfinite(held))
        at, left = _first(held, NOTHING * most)
        known = at <= SIZES.size
        at = np.where(known, at, 0)
        row, nearer = np.arange(start.size), np.maximum(at - 1, 0)
        fine = far[row, nearer, None] + np.linspace(0, 1, PARTS + 1) * (far[row, at] - far[row, nearer])[:, None]
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


def _first(held: Array, allowed: Array) -> tuple[Any, Array]:
    """From which shell on all of them together hold no more than is allowed, and what they do."""
    left = np.cumsum(held[:, ::-1], axis=1)[:, ::-1]
    left = np.concatenate((left, np.zeros((held.shape[0], 1))), axis=1)
    at = np.argmax(left <= allowed[:, None], axis=1)
    return at, left[np.arange(held.shape[0]), at]
