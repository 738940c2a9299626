"""Where surfaces meet that have no closed-form roots along the variable further in: kinks, found by numbers.

Owns `crossing_rows`. Two equations in two variables: boxes over which the enclosure of either surface leaves out 0 hold
no crossing, all others are quartered. From what is left Newton's steps lead to the place; where they don't, since the
surfaces touch, both ends of what is left are cuts. Kinks need not move: the integrand is continuous there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from potto.calculus.crossing import Crossing
from potto.calculus.enclosable import enclosable
from potto.core.terms import Lam, Term
from potto.integrate.brackets import at_label
from potto.integrate.cuts import Row, as_array
from potto.integrate.intervals import Interval, enclosure
from potto.integrate.plan import LevelPlan, function_of
from potto.integrate.rules import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints, Value, pad

ROUNDS = 24  # quarterings of the whole
BOXES, BOXES_EACH = 1 << 14, 1 << 8  # at most so many open at once, or so many for each member
STEPS = 10  # of Newton's, which are few where surfaces cross
NEAR = 64  # how far from its box a crossing may be, in widths of the box


def crossing_rows(level: LevelPlan, env: dict[str, Value], lo: Cell, hi: Cell, batch: int, machine: Any) -> list[Row]:
    """The kinks of one variable that are places where surfaces meet further in."""
    low, high = as_array(np.minimum(lo.v, hi.v), batch), as_array(np.maximum(lo.v, hi.v), batch)
    rows: list[Row] = []
    for crossing in level.level.crossings:
        found = _found(crossing, level.variable, env, low, high, machine)
        rows += [Row(x, (), -1, crossing.turning) for x in found]
    return rows


def _found(
    crossing: Crossing, variable: str, env: dict[str, Value], low: Array, high: Array, machine: Any
) -> list[Array]:
    pair, bounds = (crossing.first, crossing.second), (crossing.lo, crossing.hi)
    names = frozenset().union(*(t.free for t in (*pair, *bounds))) - {variable, crossing.variable}
    values = {name: env[name] for name in names}
    known = all(enclosable(t, jumps=True) for t in (*pair, *bounds))
    if not known or not all(isinstance(v, Cell) for v in values.values()):
        return []
    fixed = {n: as_array(v.v, low.size) for n, v in values.items() if isinstance(v, Cell)}
    ends = enclosure(bounds, {**{n: (v, v) for n, v in fixed.items()}, variable: (low, high)})
    below, above = np.fmin(ends[0][0], ends[1][0]), np.fmax(ends[0][1], ends[1][1])
    boxes = _Boxes(pair, variable, crossing.variable, fixed, (low, high),
                   (as_array(below, low.size), as_array(above, low.size)))  # fmt: skip
    owner, x, y = boxes.left()
    if not owner.size:
        return []
    places, there = boxes.polished(owner, x, y, machine)
    owner = np.concatenate((owner[there], owner[~there], owner[~there]))
    return _as_rows(owner, np.concatenate((places[there], x[0][~there], x[1][~there])), low.size)


@dataclass
class _Boxes:
    """Boxes in labels of two variables, the outer one first."""

    surfaces: tuple[Term, Term]
    outer: str
    inner: str
    fixed: dict[str, Array]
    across: tuple[Array, Array]
    along: tuple[Array, Array]

    def left(self) -> tuple[Ints, Interval, Interval]:
        """Whose the boxes are that may hold a crossing, and the two ranges of each; none where they are too many."""
        owner = np.nonzero((self.across[0] < self.across[1]) & (self.along[0] < self.along[1]))[0]
        s = np.repeat(np.array([[0.0], [1.0], [0.0], [1.0]]), owner.size, axis=1)
        for _ in range(ROUNDS):
            if not owner.size or owner.size > max(BOXES, BOXES_EACH * self.across[0].size):
                break
            middle, half = 0.5 * (s[0] + s[1]), 0.5 * (s[2] + s[3])
            owner = np.tile(owner, 4)
            s = np.concatenate([
                np.stack((*a, *b)) for a in ((s[0], middle), (middle, s[1])) for b in ((s[2], half), (half, s[3]))
            ], axis=1)  # fmt: skip
            x, y = self.ranges(owner, s)
            open_ = self.open(owner, x, y)
            owner, s = owner[open_], s[:, open_]
        else:
            return owner, *self.ranges(owner, s)
        nothing = np.zeros(0)
        return np.zeros(0, dtype=np.int64), (nothing, nothing), (nothing, nothing)

    def ranges(self, owner: Ints, s: Array) -> tuple[Interval, Interval]:
        ends = [
            at_label(low[owner], high[owner], label)
            for (low, high), label in zip((self.across, self.across, self.along, self.along), s, strict=True)
        ]
        return (ends[0], ends[1]), (ends[2], ends[3])

    def open(self, owner: Ints, x: Interval, y: Interval) -> Bools:
        box = {n: (v[owner], v[owner]) for n, v in self.fixed.items()}
        may = np.ones(owner.size, dtype=bool)
        for lo, hi in enclosure(self.surfaces, {**box, self.outer: x, self.inner: y}):
            may &= (lo <= 0) & (hi >= 0)
        return may

    def polished(self, owner: Ints, x: Interval, y: Interval, machine: Any) -> tuple[Array, Bools]:
        """Where Newton's steps lead from the middle of boxes, and whether that is near them."""
        functions = [function_of(surface) for surface in self.surfaces]
        here = {n: pad(Cell(v[owner]), 2) for n, v in self.fixed.items()}
        two = machine.with_directions(2)
        at, beside = 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])
        step = np.full(at.size, np.inf)
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                here[self.outer], here[self.inner] = Cell(at, None, (1.0, None)), Cell(beside, None, (None, 1.0))
                (f, fx, fy), (g, gx, gy) = (_parts(function, here, at.size, two) for function in functions)
                det = fx * gy - fy * gx
                step, aside = (f * gy - fy * g) / det, (fx * g - f * gx) / det
                at, beside = at - step, beside - aside
            wide = NEAR * (np.abs(x[1] - x[0]) + EPS * np.abs(at))
            there = (np.abs(at - 0.5 * (x[0] + x[1])) <= wide) & (np.abs(step) <= 1e-3 * wide)
        return at, there


def _parts(function: Lam, here: dict[str, Value], size: int, machine: Any) -> tuple[Array, Array, Array]:
    value = machine.evaluate(function, {n: here[n] for n in function.params}, None)
    slopes = ((0.0 if t is None else t) for t in (*value.t, None, None)[:2])
    v, tx, ty = (np.broadcast_to(part, (size,)) for part in (value.v, *slopes))
    return v, tx, ty


def _as_rows(owner: Ints, places: Array, batch: int) -> list[Array]:
    """Places in order, one of those at one place for each member, as rows padded with nan."""
    order = np.lexsort((places, owner))
    owner, places = owner[order], places[order]
    new = np.ones(owner.size, dtype=bool)
    new[1:] = (owner[1:] != owner[:-1]) | (places[1:] - places[:-1] > 8 * EPS * np.abs(places[1:]))
    owner, places = owner[new], places[new]
    count = np.bincount(owner, minlength=batch)
    rows = np.full((int(count.max(initial=0)), batch), np.nan)
    rows[np.arange(owner.size) - (np.cumsum(count) - count)[owner], owner] = places
    return list(rows)
