"""What programs with arrays cost: meshes, observations, steps in time, beside their goals.

`python benchmarks/arrays.py [--backend numpy|native] [--large] [--plot FILE]`. Every figure is the least time of the
processor of several warm calls; the error of the pictures is against clipping each triangle at each pixel (`covered`),
which knows nothing of Potto. A plot shows time against triangles, pixels, and what is visible: pairs of both that meet.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from paper_programs import clipped

import potto

PROGRAM = """
def edge(a: (Real*, Real*), b: (Real*, Real*), x, y) (b.x - a.x)*(y - a.y) - (b.y - a.y)*(x - a.x)
def inside(t: ((Real*, Real*), (Real*, Real*), (Real*, Real*)), x, y)
    [edge(t.0, t.1, x, y) >= 0 and edge(t.1, t.2, x, y) >= 0 and edge(t.2, t.0, x, y) >= 0]
def pixel(mesh: [n] ((Real, Real), (Real, Real), (Real, Real)), grey: [n] Real, px, py, h)
    integral ([px, px + h], [py, py + h]) sum i in 0..n-1 (grey[i]*inside(mesh[i], x, y)) d(x, y)
def loss(mesh: [n] ((Real, Real), (Real, Real), (Real, Real)), grey: [n] Real, k)
    sum i in 0..k-1, j in 0..k-1 ((pixel(mesh, grey, i/k, j/k, 1/k)*k^2 - 0.5)^2)
def log_likelihood(m, s, xs: [n] Real) sum x in xs (-((x - m)/s)^2/2 - log(s))
def censored(rate, ts: [n] Real, seen: [n] Real)
    sum i in 0..n-1 (
        if seen[i] > 0 then log(rate) - rate*ts[i] else log(integral (t ~ exponential(rate)) [t > ts[i]] d(t)))
def spring(k, n)
    (x, v) = fold (x, v) = (1, 0) for i in 1..n (let w = v - 0.001*k*x; y = x + 0.001*w in
        if y < 0 then (-y, -w) else (y, w))
    x
"""


def mesh(side: int) -> tuple[np.ndarray, np.ndarray]:
    """Two triangles for each cell of a grid whose corners are moved a little, and how grey each is."""
    rng = np.random.default_rng(1)
    line = np.linspace(0.03, 0.97, side + 1)
    p = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1)
    p = p + rng.uniform(-0.2 / side, 0.2 / side, p.shape)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    both = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2)
    return both.reshape(-1, 3, 2), rng.uniform(0, 1, 2 * side * side)


def covered(triangle: np.ndarray, x: float, y: float, h: float) -> float:
    """The area of a triangle in a square."""
    polygon = clipped(tuple(((triangle - (x, y)) / h).ravel()))
    return (
        h * h * abs(sum(p[0] * q[1] - q[0] * p[1] for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True))) / 2
    )


def picture(triangles: np.ndarray, grey: np.ndarray, size: int) -> np.ndarray:
    """The picture by clipping."""
    out, h = np.zeros((size, size)), 1 / size
    for triangle, g in zip(triangles, grey, strict=True):
        (i0, j0), (i1, j1) = (np.clip((f(triangle, axis=0) * size).astype(int), 0, size - 1) for f in (np.min, np.max))
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                out[i, j] += g * covered(triangle, i * h, j * h, h)
    return out


def least(run: Callable[[], Any], times: int = 3) -> tuple[float, Any]:
    """The least time of several calls, and the answer; the first call is not counted."""
    answer, found = run(), []
    for _ in range(times):
        start = time.process_time()
        answer = run()
        found.append(time.process_time() - start)
    return min(found), answer


def told(what: str, seconds: float, goal: float | None, more: str = "") -> None:
    met = "" if goal is None else f"goal {goal * 1e3:g} ms, {'met' if seconds <= goal else 'not met'}"
    print(f"{what:<58} {seconds * 1e3:9.1f} ms  {met:<24} {more}")


def rendered(module: Any, triangles: np.ndarray, grey: np.ndarray, size: int, times: int = 3) -> tuple[float, Any]:
    places = np.arange(size) / size
    return least(lambda: module.pixel(triangles, grey, places[:, None], places[None, :], 1 / size), times)


def plot(path: str, found: dict[str, dict[int, float]]) -> None:
    """Time against size, with a line of slope 1 through the last point."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(found), figsize=(11, 3.4), squeeze=False)
    for axis, (name, times) in zip(axes.flat, found.items(), strict=True):
        sizes = np.array(sorted(times))
        seconds = np.array([times[size] for size in sizes])
        axis.loglog(sizes, seconds, "o", label="potto")
        axis.loglog(sizes, seconds[-1] * sizes / sizes[-1], ":", color="gray", label="linear")
        axis.set_xlabel(name)
        axis.set_ylabel("seconds of the processor")
        axis.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    print(f"{path}: time against triangles, pixels and pairs")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--backend", default="numpy", choices=["numpy", "native"])
    parser.add_argument("--plot", metavar="FILE", help="draw time against size (needs matplotlib)")
    parser.add_argument("--large", action="store_true", help="also 10,082 triangles on 512 x 512 pixels")
    options = parser.parse_args()
    native = options.backend == "native"
    module = potto.compile(PROGRAM)
    with potto.settings(backend=options.backend):
        triangles, grey = mesh(7)
        seconds, answer = rendered(module, triangles, grey, 128)
        off = np.abs(answer.value - picture(triangles, grey, 128)).max()
        more = f"error {off:.1e}, {answer.stats['integrals culled']:,} culled"
        told("98 triangles on 128 x 128 pixels", seconds, None, more)
        seconds, _ = least(lambda: potto.grad(module.loss, ["mesh", "grey"])(triangles, grey, 128.0))
        told("its loss and gradient in all corners and greys", seconds, 0.05 if native else 1.0)
        by_triangles: dict[int, float] = {}
        by_pairs: dict[int, float] = {}
        for side in (7, 14, 28, 56):
            some, greys = mesh(side)
            seconds, answer = rendered(module, some, greys, 128)
            by_triangles[2 * side * side] = seconds
            by_pairs[2 * side * side * 128**2 - answer.stats["integrals culled"]] = seconds
            told(f"{2 * side * side:,} triangles on 128 x 128 pixels", seconds, None)
        by_pixels: dict[int, float] = {}
        for size in (64, 128, 256, 512):
            seconds, answer = rendered(module, triangles, grey, size)
            by_pixels[size * size] = seconds
            by_pairs[98 * size**2 - answer.stats["integrals culled"]] = seconds
            told(f"98 triangles on {size} x {size} pixels", seconds, None)
        if options.plot:
            plot(options.plot, {"triangles, 128 x 128 pixels": by_triangles, "pixels, 98 triangles": by_pixels,
                                "pairs of a triangle and a pixel that meet": by_pairs})  # fmt: skip
        if options.large:
            many, greys = mesh(71)
            seconds, answer = rendered(module, many, greys, 512, 1)
            off = np.abs(answer.value - picture(many, greys, 512)).max()
            goal = 1.0 if native else 10.0
            told("10,082 triangles on 512 x 512 pixels", seconds, goal, f"error {off:.1e}")
            seconds, _ = least(lambda: potto.grad(module.loss, ["mesh", "grey"])(many, greys, 512.0), 1)
            told("their loss and gradient in all corners and greys", seconds, goal)
        xs = np.random.default_rng(0).normal(0.3, 2, 100_000)
        seconds, answer = least(lambda: potto.grad(module.log_likelihood, ["m", "s"])(0.2, 1.5, xs))
        by_hand, _ = least(lambda: (np.sum(-(((xs - 0.2) / 1.5) ** 2) / 2 - np.log(1.5)), np.sum((xs - 0.2) / 1.5**2),
                                    np.sum((xs - 0.2) ** 2 / 1.5**3 - 1 / 1.5)))  # fmt: skip
        more = f"numpy by hand {by_hand * 1e3:.1f} ms"
        told("log-likelihood of 100,000 observations and gradient", seconds, 0.5, more)
        seconds, _ = least(lambda: potto.grad(module.log_likelihood, "xs")(0.2, 1.5, xs))
        told("the same by all observations", seconds, 0.5)
        ts = np.random.default_rng(0).exponential(1, 100_000)
        seen = (np.random.default_rng(1).uniform(size=ts.size) < 0.7).astype(float)
        seconds, answer = least(lambda: potto.grad(module.censored, "rate")(0.8, ts, seen))
        exact = seen.sum() / 0.8 - ts.sum()
        told("100,000 times, 30,000 censored, and gradient", seconds, 0.5, f"error {abs(answer.tangent - exact):.1e}")
        seconds, _ = least(lambda: potto.grad(module.spring, "k")(1.0, 10_000.0))
        told("a spring with a stop, 10,000 steps, and derivative", seconds, 0.05 if native else None)


if __name__ == "__main__":
    main()
