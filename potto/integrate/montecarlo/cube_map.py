"""The domain of an integral as the image of the unit cube.

Owns `Chart`: each variable runs from bound to bound as its label runs from 0 to 1, so that a moving or a slanted domain
is a fixed cube, and no point is ever outside of it. Points carry the tangents of the parameters (labels held fixed)
and, where asked for, those by labels.

Cuts are known here too. A stretch between two of them that is so narrow that points would hardly fall in it gets a
share of the points all the same, and these count for less (`crowded`): means stay unbiased, and nothing thin between
surfaces is missed.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Container, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from potto.core.terms import Term, function_of, mul, var
from potto.integrate.decomposition.cuts import frame_rows
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Evaluator, number_at, numbers_at, still
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Number, Value, map_arrays, pad

PRODUCT = function_of(mul(var("a"), var("b")))


class Point(Struct):
    """A chunk of points: the environment with the variables put in, and dx/du as a cell."""

    env: dict[str, Value]
    volume: Cell


class Chart(Struct, frozen=True):
    """The chart of one plan, for one set of parameters. share: the least part of the points for a stretch of labels."""

    plan: Plan
    machine: Evaluator
    env: dict[str, Value]
    share: float = 0.0

    def start(self, count: int, directions: int) -> Point:
        """No variable placed yet."""
        env = {n: pad(map_arrays(v, lambda a: np.repeat(a, count)), directions) for n, v in self.env.items()}
        return Point(env, Cell(1.0, None, (None,) * directions))

    def place(
        self, point: Point, labels: Sequence[Array | None], first: int, stop: int,
        marked: Mapping[int, int] | None = None, held: int | None = None, directions: int | None = None,
        crowding: Container[int] = (),
    ) -> Point:  # fmt: skip
        """The point with the variables first..stop-1 put at their labels; those whose label is None are left out.

        marked: the directions in which labels move. held: the variable that parameters don't move; its bounds' motion
        is someone else's affair. crowding: the variables whose labels are given as drawn, to be `crowded`.
        """
        k = self.machine.directions if directions is None else directions
        env, volume = dict(point.env), point.volume
        machine = self.machine.with_directions(k)
        for number in range(first, stop):
            u = labels[number]
            if u is None:
                continue
            level = self.plan.levels[number]
            lo, hi = self.bounds(level, env, machine)
            weight: Array | None = None
            if self.share and number in crowding:
                u, weight = self.crowded(level, env, u)
            x, length = stretch(lo, hi, u, k)
            if marked and number in marked:
                rates = list(x.t)
                before = rates[marked[number]]
                rates[marked[number]] = length.v if before is None else before + length.v
                x = Cell(x.v, None, tuple(rates))
            if held is not None and number >= held:
                x = Cell(x.v, None, tuple(None if d < self.machine.directions else y for d, y in enumerate(x.t)))
            env[level.variable] = x
            for factor in (length,) if weight is None else (length, Cell(weight)):
                volume = number_at(PRODUCT, machine, {"a": volume, "b": factor})
        return Point(env, volume)

    def crowded(self, level: LevelPlan, env: dict[str, Value], u: Array) -> tuple[Array, Array | None]:
        """Labels for drawn numbers, and their weights: so that every stretch between cuts gets its share of points."""
        if not level.rows:
            return u, None
        here = {name: still(env[name]) for name in level.frame.params}
        lo, hi, rows = frame_rows(level, self.machine.with_directions(0), here)
        with np.errstate(invalid="ignore", over="ignore"):
            cuts = [label_of(lo, hi, row.x) for row in rows if row.cut >= 0]
        inside = [np.fmin(np.fmax(cut, 0.0), 1.0) for cut in cuts]
        inside = [cut for cut in inside if cut.max() > 0 and cut.min() < 1]
        return crowd(ascending(inside), self.share, u) if inside else (u, None)

    def above(self, surface: Term, env: dict[str, Value], n: int) -> Bools:
        """The points at which a surface is not negative."""
        function = function_of(surface)
        here = {name: still(env[name]) for name in function.params}
        return as_array(number_at(function, self.machine.with_directions(0), here).v, n) >= 0

    def bounds(self, level: LevelPlan, env: dict[str, Value], machine: Evaluator) -> tuple[Cell, Cell]:
        lo, hi = numbers_at(level.bounds, machine, env)
        return (_held(lo), _held(hi)) if self.machine.frozen else (lo, hi)


FEW = 6  # rows, up to which comparing pairs of them beats sorting columns (3 to 20 times at 16 K columns)


def ascending(rows: Sequence[Array]) -> list[Array]:
    """0, the places (n,) or () each in ascending order, and 1, all in [0, 1]."""
    if len(rows) > FEW:
        rows = list(np.sort(np.stack(np.broadcast_arrays(*rows)), axis=0))
    else:
        rows = list(rows)
        for last in range(len(rows) - 1, 0, -1):
            for i in range(last):
                rows[i], rows[i + 1] = np.minimum(rows[i], rows[i + 1]), np.maximum(rows[i], rows[i + 1])
    return [np.zeros(()), *rows, np.ones(())]


def crowd(ends: Sequence[Array], share: float, u: Array) -> tuple[Array, Array | None]:
    """Points of [0, 1] for numbers u (n,) evenly spread over it, and the weights with which they count.

    ends: of stretches, from 0 to 1, (n,) each or () where they are the same for all. A stretch shorter than `share`
    gets that much of the points. Only points beside such stretches are moved.
    """
    thin: Any = False
    for low, high in itertools.pairwise(ends):
        length = high - low
        thin = thin | ((length > 8 * EPS) & (length < share))
    if not np.any(thin):
        return u, None
    every = bool(np.all(thin))
    at = slice(None) if every else np.nonzero(thin)[0]
    moved, weights = _spread([end[at] if end.ndim else end for end in ends], share, u[at])
    if every:
        return moved, weights
    label, weight = u.copy(), np.ones(u.shape)
    label[at], weight[at] = moved, weights
    return label, weight


def _spread(ends: Sequence[Array], share: float, u: Array) -> tuple[Array, Array]:
    """The same for points that are all beside a thin stretch."""
    lengths = [high - low for low, high in itertools.pairwise(ends)]
    thin = [(length > 8 * EPS) & (length < share) for length in lengths]
    count = sum(x.astype(np.float64) for x in thin)
    rest = 1 - sum(np.where(x, length, 0.0) for x, length in zip(thin, lengths, strict=True))
    least = np.where(rest > share / 2, np.minimum(share, 0.5 / count), 1 / count)  # all are thin, if they are many
    label, weight, upto = u, np.ones(u.shape), np.zeros(())
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = (1 - count * least) / rest
        for low, length, narrow in zip(ends, lengths, thin, strict=False):
            part = np.where(narrow, least, length * scale)
            counts = np.where(narrow, length / least, 1 / scale)
            here = (u >= upto) & (part > 0)
            label = np.where(here, low + np.minimum((u - upto) * counts, length), label)
            weight = np.where(here, counts, weight)
            upto = upto + part
    return label, weight


def _held(bound: Cell) -> Cell:
    """A bound that stands still."""
    return Cell(bound.v, bound.e, (None,) * len(bound.t))


def label_of(lo: Cell, hi: Cell, x: Number) -> Array:
    """The label of a point between the bounds: the inverse of `stretch`."""
    low, high = lo.v, hi.v
    if _unit(low, high):
        return np.asarray(x)
    a, b = np.minimum(low, high), np.maximum(low, high)
    with np.errstate(invalid="ignore", divide="ignore"):
        finite = np.divide(x - low, high - low)
        if np.isfinite(a).all() and np.isfinite(b).all():
            return finite
        return _by_ends(
            a, b, finite,
            lambda: (x - a) / (1 + (x - a)),
            lambda: 1 / (1 + (b - x)),
            lambda: (1 + 2 * x / (1 + np.sqrt(1 + 4 * x * x))) / 2,  # w/(1 - w^2) = x, w from (-1, 1) to (0, 1)
        )  # fmt: skip


def stretch(lo: Cell, hi: Cell, u: Array, k: int) -> tuple[Cell, Cell]:
    """The point at label u of [lo, hi] and dx/du, as cells; infinite ends by the same maps as in quadrature."""
    low, high = lo.v, hi.v
    rate = tuple(_minus(hi.t, lo.t, d) for d in range(k))
    if np.isfinite(low).all() and np.isfinite(high).all():
        t = tuple(_mix(lo.t, hi.t, d, u) for d in range(k))
        return Cell(u if _unit(low, high) else low + (high - low) * u, None, t), Cell(high - low, None, rate)
    sign = np.where(high < low, -1.0, 1.0)
    a, b = np.minimum(low, high), np.maximum(low, high)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        w = 2 * u - 1
        x = _by_ends(a, b, low + (high - low) * u, lambda: a + u / (1 - u), lambda: b - (1 - u) / u,
                     lambda: w / (1 - w * w))  # fmt: skip
        slope = _by_ends(a, b, b - a, lambda: 1 / (1 - u) ** 2, lambda: 1 / (u * u),
                         lambda: 2 * (1 + w * w) / (1 - w * w) ** 2)  # fmt: skip
        up, down = np.isinf(b), np.isinf(a)
        label = np.where(up | down, np.where(np.isinf(high), 0.0, 1.0), u)  # a bound's motion carries all points along
    t = tuple(_mix(lo.t, hi.t, d, label) for d in range(k))
    finite = ~(up | down)
    rate = tuple(None if r is None else np.where(finite, r, 0.0) for r in rate)
    return Cell(x, None, t), Cell(sign * slope, None, rate)


def _by_ends(
    low: Array, high: Array, finite: Array,
    up: Callable[[], Array], down: Callable[[], Array], both: Callable[[], Array],
) -> Array:  # fmt: skip
    """What is `finite`, or worked out for ranges without an upper end, a lower one, or both, where there are any."""
    over, under = np.isinf(high), np.isinf(low)
    found = finite
    for here, worked_out in ((over & ~under, up), (under & ~over, down), (over & under, both)):
        if here.all():
            return worked_out()
        if here.any():
            found = np.where(here, worked_out(), found)
    return found


def _unit(low: Number, high: Number) -> bool:
    """Whether a variable is its label."""
    return isinstance(low, float) and isinstance(high, float) and low == 0.0 and high == 1.0


def _minus(a: tuple[Any, ...], b: tuple[Any, ...], d: int) -> Number | None:
    p, q = (x[d] if d < len(x) else None for x in (a, b))
    if p is None:
        return None if q is None else -q
    return p if q is None else p - q  # type: ignore[no-any-return]


def _mix(a: tuple[Any, ...], b: tuple[Any, ...], d: int, label: Array) -> Number | None:
    p, q = (x[d] if d < len(x) else None for x in (a, b))
    if p is None and q is None:
        return None
    return (0.0 if p is None else p) * (1 - label) + (0.0 if q is None else q) * label
