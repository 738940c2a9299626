"""The lines of `throughput`: what is timed, what it is held against, and its goal.

Owns `LINES`. A line is a function of `Asked` that gives rows, from small to large. Every value and every derivative is
compared with a reference (a closed form, a sum over all pixels, the formulas of `throughput_by_hand`) before anything
is timed: `off` is the largest difference, in the size of the largest number.
"""

from __future__ import annotations

import gc
import itertools
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import throughput_by_hand as hand
from run import by_hand, exact_quad, gauss

import potto
from potto.kernels.native.promotion import settle
from potto.python.workers import Workers

FAR = 1e-7  # an answer that is further off than this is wrong, and its time not worth telling


@dataclass(frozen=True)
class Asked:
    """seconds: of the processor, for a measurement. native: whether machine code is asked for."""

    seconds: float = 0.5
    native: bool = False


@dataclass(frozen=True)
class Row:
    """A measurement: seconds of ours, of numpy's and C's by hand where there are some; of peers by their names.

    goal: in seconds, or as a `ratio` to what is done by hand; nan if the line has none for this backend.
    """

    name: str
    size: int
    seconds: float
    off: float
    numpy: float = math.nan
    c: float = math.nan
    goal: float = math.nan
    ratio: float = math.nan
    note: str = ""

    @property
    def met(self) -> bool | None:
        if not self.off <= FAR:
            return False
        if not math.isnan(self.goal):
            return self.seconds <= self.goal
        return None if math.isnan(self.ratio) else self.ratio <= 1


def timed(run: Callable[[], Any] | None, asked: Asked) -> float:
    """The least time of the processor of one run; of several at once where one is too short to be timed."""
    if run is None:
        return math.nan
    start = time.process_time()
    run()
    first = time.process_time() - start
    if first > 2 * asked.seconds:
        return first
    many, best, spent = max(1, int(1e-3 / max(first, 1e-6))), math.inf, 0.0
    while spent < asked.seconds:
        start = time.process_time()
        for _ in range(many):
            run()
        took = time.process_time() - start
        best, spent = min(best, took / many), spent + max(took, 1e-4)
    return best


def once(run: Callable[[], Any]) -> tuple[Any, float]:
    """What a first run gives, and its time. What is still being compiled for rows before is no part of it."""
    settle()
    start = time.process_time()
    found = run()
    return found, time.process_time() - start


def off(found: Any, exact: Any) -> float:
    """The largest difference, in the size of the largest number."""
    found, exact = np.asarray(found, dtype=float), np.asarray(exact, dtype=float)
    if not np.isfinite(found).all():
        return math.inf
    return float(np.abs(found - exact).max() / max(np.abs(exact).max(), 1e-300))


def held(name: str, size: int, ours: float, far: float, theirs: tuple[float, float], asked: Asked,
         times: tuple[float, float]) -> Row:  # fmt: skip
    """A row whose goal is so many times what numpy, and C, take by hand."""
    base, most = (theirs[1], times[1]) if asked.native else (theirs[0], times[0])
    return Row(name, size, ours, far, *theirs, ratio=ours / (most * base))


# Eq. (1)

EQUATION = """
def renderer(c) integral ([0, 1], [0, 1]) 1/(sqrt(2)*(x + y + c) + 2)^2*[x + y + c >= 0] d(x, y)
def pixel(px, py, c)
    integral ([px, px + 1/512], [py, py + 1/512]) 1/(sqrt(2)*(x + y + c) + 2)^2*[x + y + c >= 0] d(x, y)
def disc(px, py, r) integral ([px, px + 1/512], [py, py + 1/512]) [(x - 0.5)^2 + (y - 0.5)^2 < r] d(x, y)
def edge(x, y, ax, ay, bx, by) (bx - ax)*(y - ay) - (by - ay)*(x - ax)
def covered(px, py, h, ax, ay, bx, by, cx, cy)
    integral ([px, px + h], [py, py + h])
        [edge(x, y, ax, ay, bx, by) > 0 and edge(x, y, bx, by, cx, cy) > 0 and edge(x, y, cx, cy, ax, ay) > 0] d(x, y)
def triangle(px, py, t) covered(px, py, 1/512, 0.13 + t, 0.21, 0.83 + t, 0.37, 0.41 + t, 0.91)
quad = \\(x, y) . c . 1/(sqrt(2)*(x + y + c) + 2)^2
"""


def one_call(asked: Asked) -> Iterator[Row]:
    program = potto.grad(potto.compile(EQUATION).renderer, "c")
    found, exact, rule = program(-0.7), exact_quad(-0.7), gauss(8)
    c = hand.in_c("half_plane", np.empty((2, 1)), np.array([-0.7]), 1.0)
    yield Row("one call", 1, timed(lambda: program(-0.7), asked), off((found.value, found.tangent), exact),
              timed(lambda: by_hand(-0.7, rule), asked), timed(c, asked), 1e-5 if asked.native else 1e-4)  # fmt: skip


def sweep(asked: Asked) -> Iterator[Row]:
    program = potto.grad(potto.compile(EQUATION).renderer, "c")
    for n in (100, 1000, 10_000):
        c = np.linspace(-1.99, -0.01, n)
        exact = hand.half_plane(c)  # itself held against mpmath where that is quick
        assert off(hand.half_plane(np.array([-0.7]))[:, 0], exact_quad(-0.7)) < 1e-11
        found = program(c)
        theirs = timed(lambda c=c: hand.half_plane(c), asked)
        by_c = timed(hand.in_c("half_plane", np.empty((2, n)), c, 1.0), asked)
        row = held("values of c", n, timed(lambda c=c: program(c), asked),
                   off((found.value, found.tangent), exact), (theirs, by_c), asked, (3, 3))  # fmt: skip
        yield row if n == 10_000 else Row("values of c", n, row.seconds, row.off, theirs, by_c)


# Pictures


def pictures(asked: Asked) -> Iterator[Row]:
    m = potto.compile(EQUATION)
    x, y = hand.pixels()
    corners = np.array(hand.TRIANGLE)
    ax, ay, bx, by, cx, cy = hand.TRIANGLE
    area = ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2
    wanted = (
        ("half plane", m.pixel, "c", -0.7, hand.picture, ("picture", -0.7), exact_quad(-0.7)),
        ("disc", m.disc, "r", 0.1, hand.disc, ("disc", 0.1), (0.1 * math.pi, math.pi)),
        ("triangle", m.triangle, "t", 0.05, hand.triangle, ("triangle", corners, 0.05), (area, 0.0)),
    )
    first = math.nan
    for name, function, wrt, at, by_numpy, (c_name, *c_given), whole in wanted:
        program = potto.grad(function, wrt)
        exact, found = by_numpy(at), program(x, y, at)
        far = off(np.stack((found.value, found.tangent)), exact)
        far = max(far, abs(found.value.sum() - whole[0]), abs(found.tangent.sum() - whole[1]))
        theirs = timed(lambda f=by_numpy, at=at: f(at), asked)
        by_c = timed(hand.in_c(c_name, np.empty((2, x.size)), *c_given), asked)
        ours = timed(lambda p=program, at=at: p(x, y, at), asked)
        first = ours if math.isnan(first) else first
        row = held(name, x.size, ours, far, (theirs, by_c), asked, (3, 5))
        note = f"{ours / first:.1f} times the half plane, goal 2" if ours is not first else ""
        ratio = max(row.ratio, ours / first / 2)
        yield Row(name, x.size, ours, far, theirs, by_c, ratio=ratio, note=note)


def mesh_pairs(asked: Asked) -> Iterator[Row]:
    random = np.random.default_rng(1)
    program = potto.grad(potto.compile(EQUATION).covered, ("ax", "ay", "bx", "by", "cx", "cy"))
    for n in (250, 2500, 25_000):
        p = random.random((6, n))
        turned = (p[2] - p[0]) * (p[5] - p[1]) < (p[4] - p[0]) * (p[3] - p[1])
        p = np.where(turned, p[[0, 1, 4, 5, 2, 3]], p)
        x, y = 0.5 * random.random((2, n))
        exact, call = hand.pairs(p, x, y, 0.5), lambda x=x, y=y, p=p: program(x, y, 0.5, *p)
        found = call()
        far = off(np.stack((found.value, *found.tangent)), exact)
        theirs = timed(lambda p=p, x=x, y=y: hand.pairs(p, x, y, 0.5), asked)
        by_c = timed(hand.in_c("pairs", np.empty((7, n)), p, x, y, 0.5), asked)
        goal = (0.02 if asked.native else 0.5) if n == 25_000 else math.nan
        yield Row("pairs", n, timed(call, asked), far, theirs, by_c, goal)


def kernel_points(asked: Asked) -> Iterator[Row]:
    """A kernel by itself: the shader and its derivative by c, without an integral and without an error radius. Those by
    hand do the same, into arrays that they are given; ours makes the ones that it answers in."""
    from potto.kernels.cells import Cell

    m = potto.compile(EQUATION)
    machine = m._world.program.machine(potto.projects.settings.current()).inside().with_directions(1)
    shader, random = m.quad._value(), np.random.default_rng(0)
    with np.errstate(all="ignore"):
        for n in (1 << 8, 1 << 12, 1 << 16, 1 << 20):
            x, y = random.random((2, n))
            out, work = np.empty((2, n)), np.empty(n)

            def ours(x: Any = x, y: Any = y) -> Any:
                groups = ((Cell(x), Cell(y)), (Cell(0.3, None, (1.0,)),))
                return machine.call(shader, groups, None)

            cell = ours()
            hand.kernel(x, y, 0.3, out, work)
            z = np.sqrt(2) * (x + y + 0.3) + 2
            assert off(out, (z**-2, -2 * np.sqrt(2) * z**-3)) < 1e-14
            theirs = timed(lambda x=x, y=y, out=out, work=work: hand.kernel(x, y, 0.3, out, work), asked)
            by_c = timed(hand.in_c("kernel", np.empty((2, n)), x, y, 0.3), asked)
            far = off((cell.v, cell.t[0]), out)
            yield held("points", n, timed(ours, asked), far, (theirs, by_c), asked, (1.5, 1.5))


# Two cores

WAVES = """
def waves(px, py, c)
    integral ([px, px + 1/128], [py, py + 1/128]) exp(-x*y)*[sin(7*x + c) + cos(9*y*x) > 0.3] d(x, y)
"""
SHARED = 1600  # pixels a side: a few seconds of work, of which a process gets forty blocks


def cores(asked: Asked) -> Iterator[Row]:
    """A picture with edges that are searched, by one process and by two; by the clock, as nothing else tells."""
    slope, (x, y) = potto.grad(potto.compile(WAVES).waves, "c"), hand.pixels(SHARED)

    def clocked() -> tuple[Any, float]:
        best, found = math.inf, None
        for _ in range(3):
            start = time.perf_counter()
            found = slope(x, y, 0.2)
            best = min(best, time.perf_counter() - start)
        return found, best

    alone, one = clocked()
    with Workers(2) as pool, potto.settings(executor=pool):
        slope(x, y, 0.2)  # the processes start
        shared, two = clocked()
    far = off((shared.value, shared.tangent), (alone.value, alone.tangent))
    yield Row("by one process", x.size, one, 0.0)
    yield Row("by two", x.size, two, far, ratio=1.7 * two / one, note=f"{one / two:.2f} times as fast, goal 1.7")


# Samples

SAMPLED = """
def smooth(c) integral ([0, 1], [0, 1]) exp(-c*x*y) d(x, y)
def cut(c) integral ([0, 1], [0, 1]) 1/(sqrt(2)*(x + y + c) + 2)^2*[x + y + c >= 0] d(x, y)
"""
SAMPLE = 50e-9  # seconds a sample may take whose integrand takes 20 to 50 ns


def sampling(asked: Asked) -> Iterator[Row]:
    """A million samples, beside random numbers, integrand and mean by numpy; of the derivative, too; and by
    `qmc`, whose evaluations are nodes of rules along lines."""
    m, n = potto.compile(SAMPLED), 1_000_000
    wanted = (
        ("smooth", m.smooth, 0.5, hand.smooth_samples, 0.8876841582354967),  # mpmath
        ("cut", m.cut, -0.7, hand.cut_samples, exact_quad(-0.7)[0]),
    )
    for method in ("mc", "qmc"):
        for name, function, at, by_numpy, exact in wanted:
            slope, by_hand_too = potto.grad(function, "c"), method == "mc"
            with potto.settings(method=method, samples=n):
                found = function(at)
                assert abs(found.value - exact) <= found.error < 1e-2, (found.value, exact)
                theirs = timed((lambda f=by_numpy, at=at: f(at, n)) if by_hand_too else None, asked)
                ours = timed(lambda f=function, at=at: f(at), asked)
                yield Row(f"{name}, {method}", n, ours, 0.0, theirs, goal=SAMPLE * n if by_hand_too else math.nan)
                yield Row(f"its derivative, {method}", n, timed(lambda f=slope, at=at: f(at), asked), 0.0)


# Programs, from their text

NAMES = ("ax", "ay", "bx", "by", "cx", "cy", "k0", "k1", "k2", "k3")
_number = itertools.count(time.time_ns() // 1000 % 10**10 * 1000)


def new(text: str) -> str:
    """The text with a number in it that was not there before, in this run or in one whose plans were kept on disk."""
    return text.replace("FRESH", f"{next(_number)}e-300")


def fresh(text: str) -> Any:
    """A module of a text that was not seen before."""
    return potto.compile(new(text))


def shading(asked: Asked) -> Iterator[Row]:
    """A pixel under a triangle with a colour of its own, squared loss, gradient in all ten parameters.

    From the text, in a process that has answered others before: numpy answers first, as where nobody asks for a
    backend; how long it takes to wait for machine code has a row of its own.
    """
    edges = "\n".join(EQUATION.splitlines()[5:6])
    at = (0.13, -0.21, 1.23, 0.37, 0.41, 1.31, 0.2, 0.5, 0.3, 0.7)
    for degree, colour in ((1, "k0 + k1*x + k2*y + k3"), (2, "k0 + k1*x + k2*y + k3*x*y")):
        text = (
            edges
            + f"""
def loss({", ".join(NAMES)})
    shown = integral ([0, 1], [0, 1])
        ({colour} + FRESH)*[edge(x, y, ax, ay, bx, by) > 0 and edge(x, y, bx, by, cx, cy) > 0
            and edge(x, y, cx, cy, ax, ay) > 0] d(x, y)
    (shown - 0.4)^2
"""
        )
        answer = lambda text=text: potto.grad(fresh(text).loss, NAMES)(*at)  # noqa: E731
        with potto.settings(backend="auto"):
            if degree == 1:
                answer()
            found, first = once(answer)
        program = potto.grad(fresh(text).loss, NAMES)
        far = off(found.tangent, _slopes(at, degree))
        goals = (0.06, 2e-4) if asked.native else (0.09, 3e-3)
        yield Row(f"degree {degree}, from text", 10, first, far, goal=goals[0])
        if asked.native:
            yield Row("machine code waited for", 10, once(answer)[1], far)
        yield Row(f"degree {degree}, warm", 10, timed(lambda p=program: p(*at), asked), far, goal=goals[1])


def _slopes(at: tuple[float, ...], degree: int) -> list[float]:
    """The gradient of the loss by central differences at 40 digits, where a difference of 1e-12 costs nothing."""
    import mpmath as mp

    def loss(p: list[Any]) -> Any:
        corners = [(p[0], p[1]), (p[2], p[3]), (p[4], p[5])]
        for axis, end, sign in ((0, 0, 1), (0, 1, -1), (1, 0, 1), (1, 1, -1)):  # Sutherland and Hodgman
            kept = []
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
                u, v = sign * (a[axis] - end), sign * (b[axis] - end)
                if u >= 0:
                    kept.append(a)
                if (u >= 0) != (v >= 0):
                    kept.append(tuple(s + (e - s) * u / (u - v) for s, e in zip(a, b, strict=True)))
            corners = kept
        total = mp.mpf(0)
        for b, c in itertools.pairwise(corners[1:]):
            a = corners[0]
            area = ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2
            for s, e in ((a, b), (b, c), (c, a)):  # middles of the edges: exact for degree 2
                x, y = (s[0] + e[0]) / 2, (s[1] + e[1]) / 2
                last = p[9] if degree == 1 else p[9] * x * y
                total += area / 3 * (p[6] + p[7] * x + p[8] * y + last)
        return (total - mp.mpf("0.4")) ** 2

    with mp.workdps(40):
        step, slopes = mp.mpf(10) ** -12, []
        for i in range(len(at)):
            ends = ([mp.mpf(x) + sign * step * (i == j) for j, x in enumerate(at)] for sign in (1, -1))
            up, down = map(loss, ends)
            slopes.append(float((up - down) / (2 * step)))
    return slopes


def conditions_text(n: int) -> str:
    return " + ".join(f"{k}*[x < {k}*t/{n + 1}]" for k in range(1, n + 1))


def eighty(asked: Asked) -> Iterator[Row]:
    """80 conditions, from the text to the first answer; the process has answered others before."""
    text = f"def f(t) integral [0, 1] (FRESH + {conditions_text(80)}) d(x)"
    exact = sum(k * k / 81 for k in range(1, 81))
    once(lambda: potto.deriv(fresh(text.replace("80", "79")).f)((0.9, 1.0)))
    found, seconds = once(lambda: potto.deriv(fresh(text).f)((0.9, 1.0)))
    yield Row("from text", 80, seconds, off((found.value, found.tangent), (0.9 * exact, exact)), goal=0.25)
    same = text.replace("FRESH", "0")
    once(lambda: potto.deriv(potto.compile(same).f)((0.9, 1.0)))
    found, seconds = once(lambda: potto.deriv(potto.compile(same).f)((0.9, 1.0)))
    yield Row("a text seen before", 80, seconds, off(found.tangent, exact), goal=0.025)


def many_conditions(asked: Asked) -> Iterator[Row]:
    """n conditions, warm: twice as many cost twice as much."""
    before = math.nan
    for n in (10, 20, 40, 80, 160, 320, 640):
        program = potto.deriv(potto.compile(f"def f(t) integral [0, 1] ({conditions_text(n)}) d(x)").f)
        exact, found = sum(k * k / (n + 1) for k in range(1, n + 1)), program((0.9, 1.0))
        seconds = timed(lambda p=program: p((0.9, 1.0)), asked)
        far = off((found.value, found.tangent), (0.9 * exact, exact))
        note = "" if math.isnan(before) else f"{seconds / before:.2f} times half as many, goal 2.3"
        yield Row("conditions", n, seconds, far, ratio=seconds / before / 2.3, note=note)
        before = seconds


def swaps(asked: Asked) -> Iterator[Row]:
    """A shader that was not seen before, under 90 conditions that stay."""
    text = f"def f(t, shader) integral [0, 1] shader x*({conditions_text(90)}) d(x)\n"
    text += "".join(f"shader{i} = \\x . {i + 1} + {i + 2}*x + FRESH\n" for i in range(15))
    m = potto.compile(new(text))
    t, k = 0.9, np.arange(1, 91)
    for i in range(15):
        with collections() as spent:
            found, seconds = once(lambda i=i: m.f(t, getattr(m, f"shader{i}")))
        exact = float((k * ((i + 1) * k * t / 91 + (i + 2) * (k * t / 91) ** 2 / 2)).sum())
        goal = (5e-3 if asked.native else 20e-3) if i else math.nan
        note = f"{sum(spent) * 1e3:.0f} ms are a collection of Python's garbage" if sum(spent) > 2e-3 else ""
        yield Row("swap" if i else "the first", i, seconds, off(found.value, exact), goal=goal, note=note)


@contextmanager
def collections() -> Iterator[list[float]]:
    """What the garbage collector of Python takes meanwhile: it looks at all that there is."""
    spent: list[float] = []

    def told(phase: str, info: object) -> None:
        now = time.process_time()
        spent.append(-now if phase == "start" else now)

    gc.callbacks.append(told)
    try:
        yield spent
    finally:
        gc.callbacks.remove(told)


def mesh_loss(asked: Asked) -> Iterator[Row]:
    """A loss over triangles that all move: the gradient in 6 parameters of each, in times of the value."""
    edges = "\n".join(EQUATION.splitlines()[5:9])
    random = np.random.default_rng(2)
    for triangles in MESH:
        p = random.random((6, triangles))
        turned = (p[2] - p[0]) * (p[5] - p[1]) < (p[4] - p[0]) * (p[3] - p[1])
        p = np.where(turned, p[[0, 1, 4, 5, 2, 3]], p)
        names = [[f"p{k}_{i}" for i in range(6)] for k in range(triangles)]
        terms = " + ".join(f"(covered(0.25, 0.25, 0.5, {', '.join(own)}) - 0.1)^2" for own in names)
        flat = [name for own in names for name in own]
        m = potto.compile(f"{edges}\ndef loss({', '.join(flat)}) {terms}")
        given, corner = dict(zip(flat, p.T.ravel(), strict=True)), np.full(triangles, 0.25)
        areas = hand.pairs(p, corner, corner, 0.5)
        slopes = (2 * (areas[0] - 0.1) * areas[1:]).T.ravel()
        value, gradient = (lambda m=m, g=given: m.loss(**g)), potto.grad(m.loss, flat)
        found, far = value(), math.inf
        seconds = timed(value, asked)
        result, took = once(lambda f=gradient, g=given: f(**g))
        far = max(off(found.value, ((areas[0] - 0.1) ** 2).sum()), off(result.tangent, slopes))
        if took < 5 * asked.seconds:
            took = timed(lambda f=gradient, g=given: f(**g), asked)
        note = f"{took / seconds:.1f} values, goal 5"
        yield Row("parameters", 6 * triangles, took, far, ratio=took / seconds / 5, note=note)
        if took > LONG and triangles < MESH[-1]:
            yield Row("parameters", 6 * MESH[-1], math.nan, math.inf, note=f"left out, as {6 * triangles} took so long")
            return


MESH = (2, 20, 200)  # triangles
LONG = 1.0  # seconds, after which ten times as many are not asked for

LINES: dict[str, tuple[str, Callable[[Asked], Iterator[Row]]]] = {
    "one": ("eq. (1), quadratic shader, value and derivative: one warm call", one_call),
    "sweep": ("the same at many values of c in one call", sweep),
    "pictures": ("512 x 512 pixels, value and derivative", pictures),
    "pairs": ("(triangle, pixel) pairs, value and 6 derivatives each", mesh_pairs),
    "cores": ("a picture by one process and by two, by the clock", cores),
    "samples": ("a million samples", sampling),
    "kernel": ("a kernel: the shader and its derivative at points", kernel_points),
    "shading": ("a pixel of a coloured triangle, squared loss, gradient in 10 parameters", shading),
    "eighty": ("80 conditions, source text to first answer", eighty),
    "conditions": ("n conditions, value and derivative, warm", many_conditions),
    "swaps": ("another shader under 90 conditions, first answer", swaps),
    "mesh": ("the gradient of a loss over a mesh", mesh_loss),
}
