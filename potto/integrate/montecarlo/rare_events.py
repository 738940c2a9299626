"""What samples cannot have seen: bounds for the parts of an integral that hardly any point fell into.

Owns `Largest`, `peaks`, and for rare events `Outcomes`, `crossings` and `unhit`.

A set that none of N independent points fell into is, but once in 22,000 times, no larger than MISSED/N. What it may
hide is worth as much as the integrand is there, and of that something is known all the same: a program that divides by
what vanishes somewhere, or squares it in an exponential, says where its peaks are; and where a few samples are far
larger than all others, there is more of their kind.

Rare events are behind conditions. That one never came is no reason to think that it can't, and of one that hardly did
a spread says too little: of a count m, m + 4 sqrt(m) is too small a bound, by 8 or so (Wilson's interval, 1927). What
it is worth if it comes is known from points anywhere with the conditions decided that way.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext

import numpy as np
from msgspec import Struct

from potto.calculus.algebra.ranges import range_of
from potto.calculus.surfaces.branch_assignment import box_of
from potto.core.terms import Integral, Term
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.degenerate.undefined import fallen
from potto.integrate.levels import HINT
from potto.integrate.montecarlo.cube_map import Chart, Point, label_of
from potto.integrate.montecarlo.surface_terms import Surface
from potto.integrate.pieces import Evaluator, Sums, box_of_numbers, numbers_at, still
from potto.integrate.plan import Plan
from potto.kernels.cells import Array, Mask, Number, Value

MISSED = 10.0
FEW = 16
# How much more than it looks like the power may be by which the largest samples grow with their number (Hill, 1975).
SLACK = 1.5
# How close to a center a peak is looked for, in powers of 2 of the domain; points at each distance.
NEAREST, POINTS = 48, 8


class Largest(Struct):
    """The largest magnitudes among samples: arrays (..., FEW) for values and tangents."""

    most: dict[str, Array] = {}

    def add(self, samples: Sums) -> None:
        for name in ("v", "t"):
            x = np.abs(getattr(samples, name))
            before = self.most.get(name)
            if before is not None and before.shape[:-1] == x.shape[:-1] and before.shape[-1] == FEW:
                larger = (x > before[..., :1]).reshape(-1, x.shape[-1])
                some = np.flatnonzero(larger[0] if len(larger) == 1 else larger.any(axis=0))
                if not some.size:
                    continue
                x = x[..., some]  # hardly any, after the first chunks
            if x.shape[-1] > FEW:
                x = np.partition(x, x.shape[-1] - FEW, axis=-1)[..., -FEW:]
            if before is not None:
                shape = np.broadcast_shapes(before.shape[:-1], x.shape[:-1])
                both = [np.broadcast_to(y, (*shape, y.shape[-1])) for y in (before, x)]
                x = np.sort(np.concatenate(both, axis=-1), axis=-1)[..., -FEW:]
            self.most[name] = np.sort(x, axis=-1)

    def top(self, name: str) -> Number:
        x = self.most.get(name)
        return 0.0 if x is None or not x.shape[-1] else x[..., -1]

    def hardly(self, name: str) -> bool:
        """Whether hardly any of the samples was anything but 0, or there were hardly any."""
        x = self.most.get(name)
        return x is None or x.shape[-1] < FEW or bool((x[..., 0] == 0).any())

    def tail(self, name: str, points: int) -> Number:
        """What more there may be of the kind of the few largest, as a part of the mean.

        They may grow like a power of the number of points, u^-a of u in [0, 1]: what is beyond them then counts more,
        and without end from a = 1 on.
        """
        x = self.most.get(name)
        if x is None or x.shape[-1] < FEW:
            return 0.0
        with np.errstate(invalid="ignore", divide="ignore"):
            excess = np.maximum(x[..., -1] - 2 * x[..., 0], 0.0)
            power = SLACK * np.log(x[..., 1:] / x[..., :1]).mean(axis=-1)
            beyond = excess / np.maximum(1 - power, 0.0)
        return MISSED / points * np.where(excess == 0, 0.0, np.where(x[..., 0] == 0, excess, beyond))


def peaks(chart: Chart, drawn: int, f: Callable[[Point, int], Sums], seed: int) -> Sums | None:
    """The largest magnitudes of samples near the centers that the integrand is known to have; None if it has none.

    f: from a point to samples. The values are (m,) and (m, k).
    """
    levels = chart.plan.levels[:drawn]
    if not any(cut == HINT for level in levels for cut, _ in level.rows):
        return None
    random = np.random.default_rng((seed, drawn))
    distance = np.repeat(2.0 ** -np.arange(1.0, NEAREST), POINTS)
    n = distance.size
    point = chart.start(n, chart.machine.directions)
    for number, level in enumerate(levels):
        u = random.random(n)
        if any(cut == HINT for cut, _ in level.rows):
            center = _center(chart, number, point.env, random, n)
            near = center + distance * random.uniform(-1.0, 1.0, n)
            u = np.where((near > 0) & (near < 1), near, u)
        labels: list[Array | None] = [None] * number
        point = chart.place(point, [*labels, u], number, number + 1)
    found = f(point, n)
    with np.errstate(invalid="ignore"):
        v, t = (np.where(np.isfinite(x), np.abs(x), 0.0).max(axis=-1) for x in (found.v, found.t))
    return Sums(v, np.zeros_like(v), t, np.zeros_like(t))


def _center(chart: Chart, number: int, env: dict[str, Value], random: np.random.Generator, n: int) -> Array:
    """The label of one of the centers of a variable for each member, whichever; nan where there is none."""
    level = chart.plan.levels[number]
    machine = chart.machine.with_directions(0)
    lo, hi, *roots = numbers_at(level.frame, machine, {name: still(env[name]) for name in level.frame.params})
    rows = [as_array(root.v, n) for root, (cut, _) in zip(roots, level.rows, strict=True) if cut == HINT]
    chosen = np.stack(rows)[random.integers(0, len(rows), n), np.arange(n)]
    return label_of(lo, hi, chosen)


# Rare events

MOST_TURNED = 4  # conditions of which all combinations are counted
PROBES = 128


def box_of_values(term: Integral, env: Mapping[str, Value]) -> dict[str, tuple[float, float]]:
    """Between which numbers parameters and variables are, for one member of a batch."""
    return box_of(term, box_of_numbers(env))


def may_vanish(surface: Term, box: Mapping[str, tuple[float, float]]) -> bool:
    """Whether a surface may pass through a box, as far as interval arithmetic tells."""
    found = range_of(surface, box)
    return not (found.positive or found.negative)


class Outcomes:
    """How often conditions came out which way, together if they are few and else each by itself; and what is at stake.

    groups: the conditions of a plan that may come out either way.
    """

    def __init__(self, plan: Plan, groups: Sequence[int]) -> None:
        self.plan, self.groups = plan, tuple(groups)
        together = len(groups) <= MOST_TURNED
        self.ways: list[dict[int, bool]] = (
            [dict(zip(groups, way, strict=True)) for way in itertools.product((False, True), repeat=len(groups))]
            if together
            else [{group: up} for group in groups for up in (False, True)]
        )
        self.counts = np.zeros(len(self.ways), dtype=np.int64)

    def add(self, env: dict[str, Value], n: int, machine: Evaluator) -> None:
        """Count samples in, until all ways have come often."""
        if self.counts.min(initial=FEW) >= FEW:
            return
        sides = {g: side for g, side, _ in fallen(self.plan, env, n, machine, self.groups)}
        for i, way in enumerate(self.ways):
            on = np.ones(n, dtype=bool)
            for group, up in way.items():
                on &= sides[group] == up
            self.counts[i] += np.count_nonzero(on)

    def stakes(
        self, chart: Chart, drawn: int, f: Callable[[Point, dict[int, Mask], int], Sums], seed: int
    ) -> Sums | None:
        """How much samples may differ, at the most, from what they were, if conditions come out as they hardly did.

        f: the integrand times the volume element at points of all variables, with conditions decided or as they fall.
        """
        rare = [way for way, count in zip(self.ways, self.counts, strict=True) if count < FEW] if self.groups else []
        if not rare:
            return None
        u = np.random.default_rng((seed, drawn, 1)).random((drawn, PROBES))
        start = chart.start(PROBES, chart.machine.directions)
        point = chart.place(start, list(u), 0, drawn, crowding=range(drawn))
        costs = chart.machine.costs
        with nullcontext() if costs is None else costs.apart():
            as_it_falls = f(point, {}, PROBES)
            other = [f(point, {g: np.full(PROBES, up) for g, up in way.items()}, PROBES) for way in rare]
        v, t = (np.max([_most(getattr(x, n) - getattr(as_it_falls, n)) for x in other], axis=0) for n in ("v", "t"))
        return Sums(v, np.zeros_like(v), t, np.zeros_like(t))


def crossings(surface: Surface, pivot: int, seed: int) -> Sums:
    """What a line that crosses a surface may bring: as if the surface went through any point."""
    k, stop = surface.machine.directions, surface.stop
    u = np.random.default_rng((seed, stop, pivot)).random((stop, PROBES))
    marked = {axis: k + i for i, axis in enumerate(surface.pivots)}
    point = surface.placed(list(u), pivot, marked, PROBES)
    _, slopes = surface.slopes(surface.term, point, k + len(marked), PROBES)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        rates = np.abs(slopes[:k]) * np.abs(slopes[marked[pivot]]) / (slopes[k:] ** 2).sum(axis=0)
    if not slopes[:k].any():  # nothing that is differentiated moves it
        return Sums(np.zeros(1), np.zeros(1), np.zeros((1, k)), np.zeros((1, k)))
    costs = surface.machine.costs
    with nullcontext() if costs is None else costs.apart():
        above, below = surface.both_sides(point, pivot, np.zeros(PROBES))
    t = _most((above.v - below.v)[:, None] * rates)
    return Sums(np.zeros(t.shape[:1]), np.zeros(t.shape[:1]), t, np.zeros_like(t))


def unhit(stakes: Sums | None, points: int) -> Sums:
    """What so many independent points may have missed of what is at stake: as errors of the values and tangents."""
    if stakes is None:
        return Sums(*(np.zeros(1) for _ in range(4)))
    share = MISSED / points
    return Sums(share * stakes.v, stakes.e, share * stakes.t, stakes.et)


def _most(x: Array) -> Array:
    """The largest finite magnitude along the last axis."""
    return np.asarray(np.where(np.isfinite(x), np.abs(x), 0.0).max(axis=-1))
