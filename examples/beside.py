"""The worlds beside the program that samples first and differentiates its sum: `python examples/beside.py`.

The sums are differentiated exactly, by a complex step of 1e-30; comparisons see the real parts, as `where` does in
JAX or PyTorch, whose derivatives of these sums are the same numbers. What is missing is what moves with the jumps.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import potto

HERE = Path(__file__).parent
STEP = 1e-30


class World(NamedTuple):
    """A program's function of one number, where it is looked at, and the same by samples."""

    program: str
    function: str
    place: float
    sampled: Callable[[Any], Any]


class Row(NamedTuple):
    world: World
    value: float
    slope: float
    seconds: float
    sampled: float
    sampled_slope: float
    sampled_seconds: float


def middles(low: float, high: float, n: int) -> Any:
    return low + (high - low) * (np.arange(n) + 0.5) / n


def where(condition: Any, yes: Any, no: Any) -> Any:
    return np.where(condition, yes + 0j, no + 0j)


def normal(z: Any) -> Any:
    return np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi)


def ball(wall: Any) -> Any:
    t = middles(0, 1, 1_000_000)
    return np.mean(where(2 * t < wall.real, 2, -1))


def switch(s: Any) -> Any:
    t = middles(0, 2, 1_000_000)
    return 2 * np.mean((2 - t) * where(t < s.real, 1, -1))


def order(q: Any) -> Any:
    z = middles(-8, 8, 1_000_000)
    d = np.exp(3 + 0.4 * z)
    return 16 * np.mean(normal(z) * where(d < q.real, q - d, 3 * (d - q)))


def digital(spot: Any) -> Any:
    z = middles(-8, 8, 1_000_000)
    later = spot * np.exp(0.01 + 0.2 * z)
    return np.exp(-0.03) * 16 * np.mean(normal(z) * where(later.real > 105, 1, 0))


def truncated(a: Any) -> Any:
    x = middles(-8, 8, 1_000_000)
    inside = where((x > a.real) & (x < 2), 1, 0) * normal(x)
    return np.sum(inside * x) / np.sum(inside)


def mistakes(threshold: Any) -> Any:
    x = middles(-9, 9, 1_000_000)
    sick, healthy = normal(x - 1.5) * where(x < threshold.real, 1, 0), normal(x) * where(x > threshold.real, 1, 0)
    return 18 * np.mean(sick + 0.8 * healthy)


def states(energy: Any) -> Any:
    k = middles(-np.pi, np.pi, 1_000_000)
    return np.mean(where(-2 * np.cos(k) < energy.real, 1, 0))


def blobs(apart: Any) -> Any:
    x, y = np.meshgrid(middles(-3, 3, 1000), middles(-3, 3, 1000))
    field = np.exp(-((x + apart) ** 2) - y**2) + np.exp(-((x - apart) ** 2) - y**2)
    return 36 * np.mean(where(field.real > 0.5, 1, 0))


def half(x_of_site: Any) -> Any:
    x = middles(0, 1, 1_000_000)  # both sites have the same height
    return np.mean(where((x - 0.2) ** 2 < ((x - x_of_site) ** 2).real, 1, 0))


WORLDS = (
    World("dynamics/ball_and_wall", r"\w . place(2, w, 0.5)", 1.5, ball),
    World("dynamics/parking", r"\s . place(2, s)", 0.75, switch),
    World("probability/truncated", r"\a . mean(a, 2)", -1.0, truncated),
    World("probability/newsvendor", "best", 20.0, order),
    World("probability/options", r"\s . digital(market with spot = s, 105, 1)", 100.0, digital),
    World("probability/threshold", r"\t . cost(t, 5, 1)", 0.5, mistakes),
    World("fields/bands", "below", 1.0, states),
    World("fields/metaballs", r"\a . area(a, 1, 0.5)", 0.7, blobs),
    World("fields/voronoi", r"\x . cell([(0.2, 0.5), (x, 0.5)], 0)", 0.6, half),
)


def rows() -> Iterator[Row]:
    for world in WORLDS:
        module = potto.load(HERE / f"{world.program}.po")
        module.eval(f"deriv({world.function})(({world.place}, 1))")  # plans and kernels are made once
        start = time.perf_counter()
        found = module.eval(f"deriv({world.function})(({world.place}, 1))")
        middle = time.perf_counter()
        sampled = world.sampled(np.complex128(complex(world.place, STEP)))
        end = time.perf_counter()
        yield Row(world, float(found.value), float(found.tangent), middle - start,
                  float(sampled.real), float(sampled.imag) / STEP, end - middle)  # fmt: skip


def main() -> None:
    print("| program | value | of a million samples | derivative | of the sum | time | of the sum |")
    print("|---|---|---|---|---|---|---|")
    for row in rows():
        numbers = [f"{x:.9g}" for x in (row.value, row.sampled, row.slope, row.sampled_slope)]
        times = [f"{1000 * t:.1f} ms" for t in (row.seconds, row.sampled_seconds)]
        print("| " + " | ".join([f"`{row.world.program}`", *numbers, *times]) + " |")


if __name__ == "__main__":
    main()
