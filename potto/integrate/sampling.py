"""Monte Carlo and randomized quasi-Monte Carlo over the unit cube.

Owns `sample`. A point u of the cube is a point x(u, theta) of the domain, so that moving bounds move the points with
them. The derivative is the mean of the integrand's derivative at fixed u, plus for every surface the mean, over the
other variables, of

    [F] psi_theta / |psi_x|   at the roots x of psi in its innermost variable,

which samples the surface itself: unbiased, where differentiating the samples alone would miss it. Quasi-Monte Carlo
integrates the innermost variable exactly along its cuts and samples the others; its error is read off independent
scramblings of Sobol points. Samples that fall nowhere count as zero; none is ever left out of a mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from potto.integrate.cuts import as_array, frame_rows
from potto.integrate.levels import Iteration
from potto.integrate.pieces import Sums, components, still
from potto.integrate.plan import Group, LevelPlan, Plan
from potto.integrate.roots import searched_rows
from potto.kernels.cells import Array, Cell, Mask, Number, Value, map_arrays, pad

SIGMAS = 4.0  # reported error in standard errors
REPLICATES = 16
CHUNK = 1 << 15
INNER_ORDER = 8


def sample(plan: Plan, machine: Any, env: dict[str, Value], batch: int, method: str) -> Sums:
    """Estimate the integrals of a batch one after the other; each from the same seed."""
    rows = [_one(plan, machine, {n: map_arrays(v, _member(i)) for n, v in env.items()}, method) for i in range(batch)]
    return Sums(*(np.concatenate([getattr(r, name) for r in rows], axis=-1) for name in ("v", "e", "t", "et")))


def _one(plan: Plan, machine: Any, env: dict[str, Value], method: str) -> Sums:
    settings = machine.settings
    quasi = method != "mc" and len(plan.levels) > 1
    if quasi:
        count = 1 << max(4, int(np.log2(max(settings.samples // REPLICATES, 16))))
        means = [
            _Run(plan, machine, env, _scrambled(settings.seed + 7919 * r), True).means(count) for r in range(REPLICATES)
        ]
        values = np.stack([m[0] for m in means])
        tangents = np.stack([m[2] for m in means])
        v, t = values.mean(axis=0), tangents.mean(axis=0)
        e = SIGMAS * values.std(axis=0, ddof=1) / np.sqrt(REPLICATES)
        et = SIGMAS * tangents.std(axis=0, ddof=1) / np.sqrt(REPLICATES)
    else:
        generator = np.random.default_rng(settings.seed)
        run = _Run(plan, machine, env, partial(_random, generator), False)
        v, se, t, set_ = run.means(settings.samples)
        e, et = SIGMAS * se, SIGMAS * set_
    return Sums(v[:, None], e[:, None], t[:, :, None], et[:, :, None])


def _member(i: int) -> Callable[[Array], Array]:
    return lambda a: a[i : i + 1]


def _random(generator: np.random.Generator, count: int, dims: int) -> Iterator[Array]:
    for size in _sizes(count):
        yield generator.random((size, dims))


def _scrambled(seed: int) -> Callable[[int, int], Iterator[Array]]:
    return lambda count, dims: _sobol(count, dims, seed)


def _sobol(count: int, dims: int, seed: int) -> Iterator[Array]:
    from scipy.stats import qmc

    engine = qmc.Sobol(max(dims, 1), scramble=True, seed=seed)
    for size in _sizes(count):
        yield engine.random(size)[:, :dims]


def _sizes(count: int) -> Iterator[int]:
    """A number of points in chunks: an interrupt waits for one of them at most, and so does memory."""
    return (min(CHUNK, count - start) for start in range(0, count, CHUNK))


@dataclass
class _Point:
    """A chunk of sample points: the environment with the variables put in, and the volume element as a cell."""

    env: dict[str, Value]
    volume: Cell


class _Moments:
    """Mean and spread of samples that come in chunks, each put together from those of the chunks (Chan et al.)."""

    def __init__(self) -> None:
        self.any = False
        self.counts: list[int] = []
        self.means: list[Array] = []
        self.spreads: list[Array] = []

    def add(self, x: Array) -> None:
        self.any = self.any or bool(x.any())
        self.counts.append(x.shape[-1])
        self.means.append(x.mean(axis=-1))
        self.spreads.append(x.var(axis=-1))

    def mean_and_deviation(self, root: float) -> tuple[Array, Array]:
        shares = np.array(self.counts) / sum(self.counts)
        means, spreads = np.stack(self.means, axis=-1), np.stack(self.spreads, axis=-1)
        mean = (means * shares).sum(axis=-1)
        variance = (spreads * shares).sum(axis=-1) + ((means - mean[..., None]) ** 2 * shares).sum(axis=-1)
        return mean, np.sqrt(variance) / root


@dataclass
class _Run:
    """Means over one set of points. `points(n, d)` gives n points of the d-dimensional cube, in chunks; `exact_inner`
    as above."""

    plan: Plan
    machine: Any
    env: dict[str, Value]
    points: Callable[[int, int], Iterator[Array]]
    exact_inner: bool

    def means(self, count: int) -> tuple[Array, Array, Array, Array]:
        """(value, its standard error, tangents, theirs), components first."""
        k = self.machine.directions
        dims = len(self.plan.levels) - (1 if self.exact_inner else 0)
        v, se, t, set_ = self.mean(count, dims, self.interior)
        if k and not self.machine.frozen:
            inner = len(self.plan.levels) - 1
            for number, level in enumerate(self.plan.levels):
                if self.exact_inner and number == inner:
                    continue
                for group in level.decided:
                    surface = self.plan.groups[group]
                    other = dims - (0 if self.exact_inner and number == inner else 1)
                    _, _, tb, sb = self.mean(count, other, partial(self.boundary, number=number, group=surface))
                    t, set_ = t + tb, np.sqrt(set_**2 + sb**2)
        return v, se, t, set_

    def mean(
        self, count: int, dims: int, f: Callable[[Array], tuple[Array, Array]]
    ) -> tuple[Array, Array, Array, Array]:
        """Mean and standard error of (values, tangents) of f over the cube; with no dimension left, f at its point."""
        if dims == 0:
            v, t = f(np.zeros((1, 0)))
            return v[:, 0], np.zeros(v.shape[0]), t[..., 0], np.zeros(t.shape[:2])
        values, tangents = _Moments(), _Moments()
        for u in self.points(count, dims):
            v, t = f(u)
            values.add(v)
            tangents.add(t)
        root = np.sqrt(max(count - 1, 1))
        if not values.any and not tangents.any:
            self.machine.note_unfinished("no sample fell where it counts: the error estimate says nothing")
        return *values.mean_and_deviation(root), *tangents.mean_and_deviation(root)

    # The two kinds of means

    def interior(self, u: Array) -> tuple[Array, Array]:
        point = self.place(u, len(self.plan.levels) - (1 if self.exact_inner else 0))
        return self.integrand(point, {}, u.shape[0])

    def boundary(self, u: Array, number: int, group: Group) -> tuple[Array, Array]:
        """For points of the other variables, the sum over the roots of one surface in its innermost variable."""
        n, k = u.shape[0], self.machine.directions
        level = self.plan.levels[number]
        before = self.place(u[:, :number], number, n)
        lo, hi, rows = self.sections(level, before.env, n)
        mine = [r for r in rows if r.cut >= 0 and level.level.cuts[r.cut] is group.cut]
        total_v: Any = 0.0
        total: Any = 0.0
        for row in mine:
            value, tangents = self.at_root(as_array(row.x, n), u, number, group, before, lo, hi)
            total_v, total = total_v + value, total + tangents
        if not mine:
            width = self.width()
            return np.zeros((width, n)), np.zeros((width, k, n))
        return total_v, total

    def at_root(
        self, root: Array, u: Array, number: int, group: Group, before: _Point, lo: Cell, hi: Cell
    ) -> tuple[Array, Array]:
        n, k = root.size, self.machine.directions
        low, high = as_array(lo.v, n), as_array(hi.v, n)
        inside = (root > np.minimum(low, high)) & (root < np.maximum(low, high))
        x = np.where(inside, root, np.where(np.isfinite(low), low, 0.0))
        with np.errstate(invalid="ignore", divide="ignore"):
            label = np.where(np.isfinite(high - low) & (high != low), (x - low) / (high - low), 0.0)
        t = tuple(_mix(lo.t, hi.t, d, label) for d in range(k))
        level = self.plan.levels[number]
        env = {**before.env, level.variable: Cell(x, None, t)}
        slope, moves = self.slopes(group, level.variable, env, k)
        sign = np.where(high < low, -1.0, 1.0)
        env = dict(env)
        point = self.place(u[:, number:], len(self.plan.levels) - (1 if self.exact_inner else 0), n,
                           _Point(env, before.volume), number + 1)  # fmt: skip
        frozen_run = _Run(self.plan, self.machine.with_directions(0), self.env, self.points, self.exact_inner)
        frozen = _Point({name: still(v) for name, v in point.env.items()}, Cell(point.volume.v))
        one = np.ones(n, dtype=bool)
        above, _ = frozen_run.integrand(frozen, {group.number: one}, n)
        below, _ = frozen_run.integrand(frozen, {group.number: ~one}, n)
        jump = np.where(inside, above - below, 0.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            rates = np.stack([np.where(inside, sign * m / np.abs(slope), 0.0) for m in moves])
        return np.zeros_like(jump), jump[:, None, :] * rates[None]

    def slopes(self, group: Group, variable: str, env: dict[str, Value], k: int) -> tuple[Array, list[Array]]:
        """d psi / d x of the surface, and how fast it rises at a point that moves with its label, per direction."""
        from potto.integrate.plan import function_of

        function = function_of(group.cut.surface)
        wide = {n: pad(v, k + 1) for n, v in env.items() if n in function.params}
        x = env[variable]
        assert isinstance(x, Cell)
        wide[variable] = Cell(x.v, None, (*x.t, 1.0))
        value = self.machine.with_directions(k + 1).evaluate(function, wide, None)
        n = np.size(x.v)
        full = [as_array(0.0 if t is None else t, n) for t in value.t]
        return full[k], full[:k]

    # Points of the domain

    def place(
        self, u: Array, stop: int, count: int | None = None, start: _Point | None = None, first: int = 0
    ) -> _Point:
        """Variables first..stop-1 put at the labels u (n, stop - first)."""
        n = u.shape[0] if count is None else count
        env = dict(self.env) if start is None else dict(start.env)
        volume = Cell(1.0, None, (None,) * self.machine.directions) if start is None else start.volume
        if start is None:
            env = {name: map_arrays(v, lambda a: np.repeat(a, n)) for name, v in env.items()}
        for column, level in enumerate(self.plan.levels[first:stop]):
            lo, hi = self.bounds(level, env)
            x, length = _stretch(lo, hi, u[:, column], self.machine.directions)
            env[level.variable] = x
            volume = _times(volume, length)
        return _Point(env, volume)

    def bounds(self, level: LevelPlan, env: dict[str, Value]) -> tuple[Cell, Cell]:
        values = self.machine.evaluate(level.frame, {p: env[p] for p in level.frame.params}, None)
        assert isinstance(values, tuple)
        lo, hi = values[0], values[1]
        assert isinstance(lo, Cell) and isinstance(hi, Cell)
        return (_held(lo), _held(hi)) if self.machine.frozen else (lo, hi)

    def sections(self, level: LevelPlan, env: dict[str, Value], n: int) -> tuple[Cell, Cell, list[Any]]:
        values = self.machine.evaluate(level.frame, {p: env[p] for p in level.frame.params}, None)
        assert isinstance(values, tuple)
        lo, hi, rows = frame_rows(level, values)
        return lo, hi, rows + searched_rows(level, env, lo, hi, n, self.machine)

    # The integrand

    def integrand(self, point: _Point, sides: dict[int, Mask], n: int) -> tuple[Array, Array]:
        """F times the volume element: values (m, n) and tangents (m, k, n)."""
        k = self.machine.directions
        if self.exact_inner:
            last = len(self.plan.levels) - 1
            sums = Iteration(self.plan, self.machine, INNER_ORDER).run(last, point.env, n, sides, self.machine)
            f, ft = sums.v, sums.t
        else:
            body = self.plan.body
            self.machine.count(n)
            value = self.machine.evaluate(body, {p: point.env[p] for p in body.params}, self.plan.trace(sides))
            cells = components(value)
            f = np.stack([_full(c.v, n) for c in cells])
            ft = np.stack([np.stack([_full(x, n) for x in (c.t or (None,) * k)]) for c in cells]) if k else (
                np.zeros((len(cells), 0, n))
            )  # fmt: skip
        volume = _full(point.volume.v, n)
        out = f * volume
        rates = [_full(x, n) for x in (point.volume.t or (None,) * k)]
        tangents = ft * volume + f[:, None, :] * np.stack(rates)[None] if k else ft
        return out, tangents

    def width(self) -> int:
        return 1


def _held(bound: Cell) -> Cell:
    """A bound that stands still."""
    return Cell(bound.v, bound.e, (None,) * len(bound.t))


def _full(x: Any, n: int) -> Array:
    return np.broadcast_to(np.asarray(0.0 if x is None else x, dtype=float), (n,))


def _mix(a: tuple[Any, ...], b: tuple[Any, ...], d: int, label: Array) -> Number | None:
    p, q = (x[d] if d < len(x) else None for x in (a, b))
    if p is None and q is None:
        return None
    return (0.0 if p is None else p) * (1 - label) + (0.0 if q is None else q) * label


def _stretch(lo: Cell, hi: Cell, u: Array, k: int) -> tuple[Cell, Cell]:
    """The point at label u of [lo, hi] and dx/du, as cells; infinite ends by the same maps as in quadrature."""
    low, high = as_array(lo.v, u.size), as_array(hi.v, u.size)
    sign = np.where(high < low, -1.0, 1.0)
    a, b = np.minimum(low, high), np.maximum(low, high)
    if np.isfinite(a).all() and np.isfinite(b).all():
        t = tuple(_mix(lo.t, hi.t, d, u) for d in range(k))
        rate = tuple(_mix(tuple(None if x is None else -x for x in lo.t), hi.t, d, np.full(u.size, 0.5))
                     for d in range(k))  # fmt: skip
        return Cell(low + (high - low) * u, None, t), Cell(
            high - low, None, tuple(None if r is None else 2 * r for r in rate)
        )
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        w = 2 * u - 1
        up, down = np.isinf(b), np.isinf(a)
        x = np.where(up & down, w / (1 - w * w), np.where(up, a + u / (1 - u), b - (1 - u) / u))
        slope = np.where(up & down, 2 * (1 + w * w) / (1 - w * w) ** 2, np.where(up, 1 / (1 - u) ** 2, 1 / (u * u)))
    t = tuple(_mix(lo.t, hi.t, d, np.where(up, 0.0, 1.0)) for d in range(k))
    return Cell(x, None, t), Cell(sign * slope, None, (None,) * k)


def _times(a: Cell, b: Cell) -> Cell:
    def part(p: Any, q: Any) -> Any:
        terms = [x * y for x, y in ((p, b.v), (q, a.v)) if x is not None]
        return None if not terms else sum(terms[1:], terms[0])

    k = max(len(a.t), len(b.t))
    return Cell(a.v * b.v, None, tuple(map(part, a.t or (None,) * k, b.t or (None,) * k)))
