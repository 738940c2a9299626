"""What gradients cost, in values: `python benchmarks/gradients.py [mesh|ways]`, by processor time, least of several.

mesh: the loss sum((integral - target)^2) of triangles with twelve parameters each, in all of them at once; the first
call, and warm ones; with evaluations of integrands and compiled kernels, which must not grow with the directions.
ways: one tangent for each parameter beside a tape, for scalars that all depend on each other (`dense`) and that hardly
do (`sparse`): where they meet is `MANY` in `potto.python.derived_calls`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import potto
from potto.kernels import compile as kernels
from potto.python import derived_calls

TRIANGLE = """
def inside(ax, ay, bx, by, x, y) (bx - ax)*(y - ay) - (by - ay)*(x - ax)
def tri(ax, ay, bx, by, cx, cy, p, q, r, s, u, w)
    integral ([0, 1], [0, 1])
        (p + q*x + r*y + s*x*y + u*x^2 + w*y^2)*[inside(ax, ay, bx, by, x, y) > 0]
            *[inside(bx, by, cx, cy, x, y) > 0]*[inside(cx, cy, ax, ay, x, y) > 0] d(x, y)
"""
NAMES = ("ax", "ay", "bx", "by", "cx", "cy", "p", "q", "r", "s", "u", "w")
PLACES = (0.1, 0.1, 0.9, 0.2, 0.3, 0.8, 1.0, 0.5, 0.3, 0.2, 0.1, 0.4)


def mesh(count: int) -> tuple[Any, dict[str, float]]:
    """The loss of so many triangles, and where it is evaluated."""
    names = [[f"{name}{i}" for name in NAMES] for i in range(count)]
    parts = " + ".join(f"(tri({', '.join(own)}) - 0.{i % 9 + 1})^2" for i, own in enumerate(names))
    flat = [name for own in names for name in own]
    numbers = np.random.default_rng(1).normal(PLACES, 0.05, (count, len(NAMES))).ravel()
    loss = potto.compile(f"{TRIANGLE}def loss({', '.join(flat)})\n    {parts}\n").loss
    return loss, dict(zip(flat, map(float, numbers), strict=True))


def dense(count: int) -> tuple[Any, dict[str, float]]:
    names = [f"x{i}" for i in range(count)]
    lines = ["    z0 = " + " + ".join(f"{0.1 + i / count:.3f}*{name}" for i, name in enumerate(names))]
    lines += [f"    z{j} = sin(z{j - 1}) + 0.5*z{j - 1}*x{j % count}" for j in range(1, 10)]
    f = potto.compile("\n".join([f"def f({', '.join(names)})", *lines, "    z9\n"])).f
    return f, dict(zip(names, np.linspace(0.1, 1, count).tolist(), strict=True))


def sparse(count: int) -> tuple[Any, dict[str, float]]:
    names = [f"x{i}" for i in range(count)]
    terms = (f"(x{i}*sin(x{(i + 1) % count}) - exp(0.1*x{i}))^2/(1 + x{(i + 3) % count}^2)" for i in range(count))
    f = potto.compile(f"def f({', '.join(names)})\n    {' + '.join(terms)}\n").f
    return f, dict(zip(names, np.linspace(0.1, 1, count).tolist(), strict=True))


def spent(run: Callable[[], Any], repeats: int) -> tuple[Any, float]:
    """The answer, and the least processor time."""
    best, answer = float("inf"), None
    for _ in range(repeats):
        start = time.process_time()
        answer = run()
        best = min(best, time.process_time() - start)
    return answer, best


def meshes() -> None:
    print("parameters  value ms  gradient ms  values  first ms  evaluations (value)  kernels  converged")
    for count in (4, 25, 100):
        loss, at = mesh(count)
        loss(**at)
        gradient = potto.grad(loss, list(at))
        first, begun = spent(lambda f=gradient, at=at: f(**at), 1)
        value, alone = spent(lambda f=loss, at=at: f(**at), 4)
        found, seconds = spent(lambda f=gradient, at=at: f(**at), 3)
        times = f"{alone * 1e3:8.1f}  {seconds * 1e3:11.1f}  {seconds / alone:6.2f}  {begun * 1e3:8.1f}"
        evals, made = f"{found.evals:11,} {f'({value.evals:,})':>7}", first.stats["kernels compiled"]
        print(f"{len(at):10}  {times}  {evals}  {made:7}  {found.converged}")


def ways() -> None:
    print("scalars   parameters  tangents: first ms, values   tape: first ms, values")
    for kind in (dense, sparse):
        for count in (4, 8, 12, 16, 32, 64):
            row = ""
            for many in (count + 1, 1):
                derived_calls.MANY = many
                kernels.clear()
                f, at = kind(count)
                f(**at)
                gradient = potto.grad(f, list(at))
                _, first = spent(lambda f=gradient, at=at: f(**at), 1)
                _, alone = spent(lambda f=f, at=at: f(**at), 20)
                _, seconds = spent(lambda f=gradient, at=at: f(**at), 20)
                row += f"  {first * 1e3:15.1f}  {seconds / alone:7.2f}"
            print(f"{kind.__name__:8}  {count:10}{row}")


if __name__ == "__main__":
    {"mesh": meshes, "ways": ways}[sys.argv[1] if len(sys.argv) > 1 else "mesh"]()
