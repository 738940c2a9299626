"""The experiments behind the numbers that error estimates rest on: `python benchmarks/calibration.py [NAME]`.

truncation, singular, analytic: how often the estimates of `potto.integrate.rules.gauss` are exceeded, by how much,
and how much larger than the error they are; singular is `truncation` as it is for pieces at whose ends powers may be.
edge: how near a piece may come to the edge of a builtin's domain before the coefficients no longer tell (`EDGE` in
`potto.integrate.fixed.edges`). Functions are drawn from families that are told in their names; the truth is a rule of
20 nodes on 800 graded panels.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from potto.integrate.rules.gauss import EPS, analytic_truncation, gauss, truncation
from potto.kernels.cells import Array

Function = Callable[[Array], Array]
Estimate = Callable[[Array], Array]
DRAWN = 600
NODES = (6, 8, 11, 12, 16, 20)
POWERS = (-0.7, -0.5, -0.25, 0.25, 0.5, 0.75, 1.5, 2.5, 3.5, 5.5)
ESTIMATES: dict[str, Estimate] = {
    "truncation": truncation, "singular": lambda size: truncation(size, True),
    "analytic": lambda size: analytic_truncation(size, size.shape[-1]),
}  # fmt: skip
# What a sum of n products may lose to rounding, and what the truth may, both as a part of what is added up.
ROUNDING = 300 * EPS


def drawn(family: str, random: np.random.Generator) -> Function:
    """A function on [0, 1] with random scales: features as narrow as a fiftieth of it and as wide as five times."""
    at, wide = random.uniform(-0.5, 1.5), 10 ** random.uniform(-1.7, 0.7)
    wave, phase = 10 ** random.uniform(0, 1.6), random.uniform(0, 2 * np.pi)
    power = random.choice(POWERS)

    def x(u: Array) -> Array:  # what nears 0 at an end
        return u

    families: dict[str, Function] = {
        "pole beside": lambda u: 1 / ((u - at) ** 2 + wide * wide),
        "pole on the line": lambda u: 1 / (x(u) + wide / 2) ** 2,
        "peak": lambda u: np.exp(-(((u - at) / wide) ** 2)),
        "step": lambda u: np.tanh((u - at) / wide) + 0.3,
        "wave": lambda u: np.cos(wave * u + phase),
        "power beside": lambda u: (x(u) + wide / 3) ** power,
        "logarithm beside": lambda u: np.log(x(u) + wide / 3),
        "wave over pole": lambda u: np.exp(np.sin(wave * u + phase)) / (x(u) + wide),
        "pole to a power": lambda u: x(u) * np.exp(wave * u / 6) / ((u - at) ** 2 + wide * wide) ** 1.5,
        "circle": lambda u: np.sin(np.pi * u) ** 2 / (1 + wide - np.cos(np.pi * u)),
        "power": lambda u: x(u) ** power,
        "power times growth": lambda u: x(u) ** power * np.exp(wave * u / 8),
    }
    return families[family]


ANALYTIC = ("pole beside", "pole on the line", "peak", "step", "wave", "power beside", "logarithm beside",
            "wave over pole", "pole to a power", "circle")  # fmt: skip
SINGULAR = ("power", "power times growth")


def truth(function: Function) -> float:
    """The integral over [0, 1]: panels graded towards both ends."""
    fine = 2.0 ** -np.arange(9, 50)
    ends = np.unique(np.concatenate([np.linspace(0, 1, 601), fine, 1 - fine[fine > 1e-16]]))
    rule, width = gauss(20), np.diff(ends)
    return float((function(ends[:-1, None] + width[:, None] * rule.nodes) @ rule.weights) @ width)


def measured(functions: list[Function], exact: Array, n: int) -> Iterator[tuple[str, Array, Array]]:
    """Errors of the rule with n nodes, and the bounds by each estimate."""
    rule = gauss(n)
    values = np.array([f(rule.nodes) for f in functions])
    sizes, floor = np.abs(values @ rule.transform), ROUNDING * (np.abs(values) @ rule.weights)
    error = np.maximum(np.abs(values @ rule.weights - exact) - floor, 0.0)
    for name, estimate in ESTIMATES.items():
        yield name, error, estimate(sizes) + floor


def estimates(which: str) -> None:
    """A line a family: of how many functions the bound is exceeded, by how much at worst, and by how many digits it is
    larger than the error in the median, for each number of nodes."""
    print(f"{which}: {DRAWN} functions a family; exceeded (at worst times), digits to spare, at {NODES} nodes")
    for family in (*ANALYTIC, *SINGULAR):
        random = np.random.default_rng(7)
        functions = [drawn(family, random) for _ in range(DRAWN)]
        exact = np.array(list(map(truth, functions)))
        cells = []
        for n in NODES:
            error, bound = next((e, b) for name, e, b in measured(functions, exact, n) if name == which)
            beyond = error > bound
            worst = float((error / bound).max())
            spare = np.median(np.log10(bound / np.maximum(error, 1e-3 * bound)))
            told = f"{beyond.sum():3d} ({worst:8.1f})" if beyond.any() else f"{'  0':14s}"
            cells.append(f"{told} {spare:3.1f}")
        print(f"  {family:20s}" + " | ".join(cells))


def power_times_growth(gap: float, power: float, rate: float) -> Function:
    return lambda u: (u + gap) ** power * np.exp(rate * u)


def edge() -> None:
    """x^a exp(b x) from x = d/(1 - d) of a piece's length off 0: the worst ratio of error and `analytic` bound."""
    print(f"edge: worst error by analytic bound, for ratios of the least and the most on the piece, at {NODES} nodes")
    random = np.random.default_rng(3)
    for nearest in (1e-4, 0.01, 0.02, 0.04, 0.08, 0.16):
        gap = nearest / (1 - nearest)
        functions = [power_times_growth(gap, random.choice(POWERS), random.uniform(-4, 4)) for _ in range(DRAWN)]
        exact = np.array(list(map(truth, functions)))
        worst = []
        for n in NODES:
            error, bound = next((e, b) for name, e, b in measured(functions, exact, n) if name == "analytic")
            worst.append(float((error / bound).max()))
        print(f"  {nearest:6g}  " + "  ".join(f"{w:9.3g}" for w in worst))


def native() -> None:
    """What it takes to load LLVM and to make machine code, and by how many points it pays."""
    import potto
    from potto.integrate.fixed.lowered.rule_text import RuleText
    from potto.kernels.making import counts
    from potto.kernels.native import objects

    start = time.perf_counter()
    objects.compiler()
    print(f"native: LLVM loaded in {time.perf_counter() - start:.3f} s")
    with potto.settings(backend="native"):  # the first function costs more than others
        potto.compile("def f(a) a*a + 1").f(np.linspace(0, 1, 4_000))
    sizes, spans, made_of = [], [], objects.made

    def timed(text: str, name: str) -> tuple[objects.Loaded, bool]:
        start = time.perf_counter()
        found = made_of(text, name)
        if found[1]:
            sizes.append(text.count("\n"))
            spans.append(time.perf_counter() - start)
        return found

    written, writing = [], RuleText.text

    def text_of(rule: RuleText, places: Any) -> str:
        start = time.thread_time()
        found = writing(rule, places)
        written.append((time.thread_time() - start) / found.count("\n"))
        return found

    objects.made, RuleText.text = timed, text_of  # type: ignore[method-assign, assignment]
    programs = {
        "1-D, a root": "def f(a) integral [0, 3] exp(-x)*[x*x < a] d(x)",
        "2-D, a line": "def f(a) integral ([0, 1], [0, 1]) 1/(x + y + a)^2*[x + y < a] d(x, y)",
        "2-D, two curves": "def f(a) integral ([0, 2], [0, 2]) exp(x*y)*[x*x + y*y < a]*[y < x] d(x, y)",
        "3-D, a plane": "def f(a) integral ([0, 1], [0, 1], [0, 1]) [x + y + z < a]/(1 + x*y) d(x, y, z)",
    }
    for name, text in programs.items():
        function = potto.grad(potto.compile(text).f, ["a"])
        where, made, spent = np.linspace(0.3, 0.9, 4_000), counts.native, counts.native_seconds
        times = []
        for backend in ("numpy", "native"):
            with potto.settings(backend=backend):
                function(where)
                start = time.perf_counter()
                function(where)
                times.append((time.perf_counter() - start) / where.size)
        made, spent = counts.native - made, counts.native_seconds - spent
        print(f"  {name:16} {made} functions, {spent / max(made, 1) * 1e3:5.1f} ms each; "
              f"a member {times[0] * 1e6:.1f} us by numpy, {times[1] * 1e6:.1f} us by machine code")  # fmt: skip
    objects.made, RuleText.text = made_of, writing  # type: ignore[method-assign]
    line, least = np.polyfit(sizes, spans, 1, w=1 / np.array(spans))
    off = np.abs(np.array(spans) / (least + line * np.array(sizes)) - 1)
    print(f"  of {len(sizes)} texts of {min(sizes)} to {max(sizes)} lines: {least * 1e3:.1f} ms and "
          f"{line * 1e6:.0f} us a line, within {off.max():.0%}, half of them within {np.median(off):.0%}; "
          f"to write one {np.median(written) * 1e6:.0f} us a line")  # fmt: skip


def elementary() -> None:
    """How far functions of machine code are off at a million places each, in units in the last place, and what one
    number takes; against the long doubles of the C library, which have eleven bits more."""
    from potto.core.terms import ZERO, function_of, prim, var
    from potto.kernels.cells import Cell
    from potto.projects.settings import Settings
    from potto.runtime.evaluate import Program

    random = np.random.default_rng(5)
    ranges = {
        "exp": ((-700, 700), (-1, 1), (-740, -700)), "log": ((0.5, 2), (0.99, 1.01), (1e-320, 1e-307)),
        "sin": ((-10, 10), (-1e5, 1e5), (3.14159, 3.141594)), "cos": ((-10, 10), (-1e5, 1e5), (1.57, 1.5708)),
    }  # fmt: skip
    for name, ends in ranges.items():
        function = function_of(prim(name, var("x")))
        worst, times = [0.0, 0.0], [np.inf, np.inf]
        for low, high in ends:
            x = random.uniform(low, high, 1_000_000)
            exact = getattr(np, name)(x.astype(np.longdouble))
            for i, backend in enumerate(("native", "numpy")):
                machine = Program(lambda module, name: ZERO).machine(Settings(backend=backend)).inside()
                for _ in range(3):
                    start = time.process_time()
                    found = machine.evaluate(function, {"x": Cell(x)}, None)
                    times[i] = min(times[i], time.process_time() - start)
                assert isinstance(found, Cell)
                worst[i] = max(worst[i], float((np.abs(found.v - exact) / np.spacing(np.abs(found.v))).max()))
        print(f"  {name}: {worst[0]:.3f} units, {times[0] * 1e3:.1f} ns; numpy {worst[1]:.3f}, {times[1] * 1e3:.1f} ns")


EXPERIMENTS: dict[str, Callable[[], None]] = {
    "truncation": lambda: estimates("truncation"),
    "singular": lambda: estimates("singular"),
    "analytic": lambda: estimates("analytic"),
    "edge": edge,
    "native": native,
    "elementary": elementary,
}


if __name__ == "__main__":
    for name in sys.argv[1:] or EXPERIMENTS:
        with np.errstate(all="ignore"):
            EXPERIMENTS[name]()
