"""What samples cannot have seen: bounds for the parts of an integral that hardly any point fell into.

Owns `Largest` and `peaks`. A set that none of N independent points fell into is, but once in 22,000 times, no larger
than MISSED/N. What it may hide is worth as much as the integrand is there, and of that something is known all the
same: a program that divides by what vanishes somewhere, or squares it in an exponential, says where its peaks are; and
where a few samples are far larger than all others, there is more of their kind.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from potto.integrate.chart import Chart, label_of
from potto.integrate.cuts import as_array
from potto.integrate.pieces import Sums, still
from potto.kernels.cells import Array

MISSED = 10.0
FEW = 16
# How much more than it looks like the power may be by which the largest samples grow with their number (Hill, 1975).
SLACK = 1.5
# How close to a center a peak is looked for, in powers of 2 of the domain; points at each distance.
NEAREST, POINTS = 48, 8


@dataclass
class Largest:
    """The largest magnitudes among samples: arrays (..., FEW) for values and tangents."""

    most: dict[str, Array] = field(default_factory=dict)

    def add(self, samples: Sums) -> None:
        for name in ("v", "t"):
            x = np.abs(getattr(samples, name))
            if x.shape[-1] > FEW:
                x = np.partition(x, x.shape[-1] - FEW, axis=-1)[..., -FEW:]
            before = self.most.get(name)
            if before is not None:
                shape = np.broadcast_shapes(before.shape[:-1], x.shape[:-1])
                both = [np.broadcast_to(y, (*shape, y.shape[-1])) for y in (before, x)]
                x = np.sort(np.concatenate(both, axis=-1), axis=-1)[..., -FEW:]
            self.most[name] = np.sort(x, axis=-1)

    def top(self, name: str) -> Any:
        x = self.most.get(name)
        return 0.0 if x is None or not x.shape[-1] else x[..., -1]

    def tail(self, name: str, points: int) -> Any:
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


def peaks(chart: Chart, drawn: int, f: Callable[[Any, int], Sums], seed: int) -> Sums | None:
    """The largest magnitudes of samples near the centers that the integrand is known to have; None if it has none.

    f: from a point to samples. The values are (m,) and (m, k).
    """
    levels = chart.plan.levels[:drawn]
    if not any(cut < 0 for level in levels for cut, _ in level.rows):
        return None
    random = np.random.default_rng((seed, drawn))
    distance = np.repeat(2.0 ** -np.arange(1.0, NEAREST), POINTS)
    n = distance.size
    point = chart.start(n, chart.machine.directions)
    for number, level in enumerate(levels):
        u = random.random(n)
        if any(cut < 0 for cut, _ in level.rows):
            center = _center(chart, number, point.env, random, n)
            near = center + distance * random.uniform(-1.0, 1.0, n)
            u = np.where((near > 0) & (near < 1), near, u)
        labels: list[Array | None] = [None] * number
        point = chart.place(point, [*labels, u], number, number + 1)
    found = f(point, n)
    with np.errstate(invalid="ignore"):
        v, t = (np.where(np.isfinite(x), np.abs(x), 0.0).max(axis=-1) for x in (found.v, found.t))
    return Sums(v, np.zeros_like(v), t, np.zeros_like(t))


def _center(chart: Chart, number: int, env: dict[str, Any], random: np.random.Generator, n: int) -> Array:
    """The label of one of the centers of a variable for each member, whichever; nan where there is none."""
    level = chart.plan.levels[number]
    machine = chart.machine.with_directions(0)
    values = machine.evaluate(level.frame, {name: still(env[name]) for name in level.frame.params}, None)
    lo, hi, *roots = values
    rows = [as_array(root.v, n) for root, (cut, _) in zip(roots, level.rows, strict=True) if cut < 0]
    chosen = np.stack(rows)[random.integers(0, len(rows), n), np.arange(n)]
    return label_of(lo, hi, chosen)
