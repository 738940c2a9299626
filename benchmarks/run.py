"""Speed against error, measured: `python benchmarks/run.py` prints a table for each question.

Each figure stands beside that of a peer measured in the same run. Errors are against closed forms or mpmath. Times are
the least of several repeats, in one process, after one run to warm up, unless a row says otherwise.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
from installed import as_installed

import potto

PROGRAM = r"""
const = \(x, y) . c . 1
lin = \(x, y) . c . 1/(sqrt(2)*(x + y + c) + 2)
quad = \(x, y) . c . 1/(sqrt(2)*(x + y + c) + 2)^2
def renderer(c, shader) integral ([0, 1], [0, 1]) shader (x, y) c*[x + y + c >= 0] d(x, y)
def scene(c) integral ([0, 1], [0, 1]) quad (x, y) c*[x + y + c >= 0] d(x, y)
def pixel(px, py, c) integral ([px, px + 1/512], [py, py + 1/512]) quad (x, y) c*[x + y + c >= 0] d(x, y)
"""
ROOT = math.sqrt(2.0)


def best(run: Callable[[], Any], repeats: int = 30) -> float:
    """The least time of one run, in seconds."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def title(text: str) -> None:
    print(f"\n{text}\n{'-' * len(text)}")


# Equation (1) in closed form, for -1 <= c <= 0: f(c) = G(c + 2) - 2 G(c + 1) + G(max(c, 0)), where G'' = s


def exact_quad(c: float) -> tuple[float, float]:
    """Value and derivative for the quadratic shader 1/(sqrt(2) z + 2)^2, z = x + y + c, by 40-digit arithmetic."""
    import mpmath as mp

    with mp.workdps(40):
        c_ = mp.mpf(c)
        r = mp.sqrt(2)

        def g(z: Any) -> Any:  # the second antiderivative of s that vanishes with its slope at 0
            return z / (2 * r) - mp.log(1 + z / r) / 2

        def slope(z: Any) -> Any:
            return 1 / (2 * r) - 1 / (r * (r * z + 2))

        value = g(c_ + 2) - 2 * g(c_ + 1)
        rate = slope(c_ + 2) - 2 * slope(c_ + 1)
        return float(value), float(rate)


def gauss(n: int) -> tuple[Any, Any]:
    """Nodes and weights over [0, 1]: computed once by who writes a rule by hand, so no part of what is timed."""
    x, w = np.polynomial.legendre.leggauss(n)
    return (x + 1) / 2, w / 2


def by_hand(c: float, rule: tuple[Any, Any]) -> tuple[float, float]:
    """What an expert writes in numpy for this one scene: Gauss rules on the two cells, interior and boundary terms."""
    x, w = rule

    def s(z: Any) -> Any:
        return 1 / (ROOT * z + 2) ** 2

    def ds(z: Any) -> Any:
        return -2 * ROOT / (ROOT * z + 2) ** 3

    value = rate = 0.0
    for a, b, lo in ((0.0, -c, lambda t: -c - t), (-c, 1.0, lambda t: 0.0 * t)):
        outer = a + (b - a) * x
        low = lo(outer)[:, None]
        z = outer[:, None] + low + (1 - low) * x + c
        weight = (b - a) * w[:, None] * w * (1 - low)
        value += float((weight * s(z)).sum())
        rate += float((weight * ds(z)).sum())
    return value, rate - c * float(s(0.0))  # the edge has length -c over x, jump s(0), speed 1


def one_integral() -> None:
    title("Eq. (1), quadratic shader, c = -0.7: value and derivative, warm from Python")
    m = potto.compile(PROGRAM)
    d, shader = potto.deriv(m.renderer), potto.deriv(m.quad)
    value, rate = exact_quad(-0.7)
    print(f"{'method':34} {'ms':>8} {'evals':>8} {'value err':>10} {'deriv err':>10} {'reported':>9}")
    r = d((-0.7, 1.0), shader)
    ours = best(lambda: d((-0.7, 1.0), shader))
    row("potto, a shader given", ours, r.evals, r.value - value, r.tangent - rate, r.tangent_error)
    whole = potto.grad(m.scene)
    for backend in ("numpy", "native") if find_spec("llvmlite") else ("numpy",):
        with potto.settings(backend=backend):
            ours = best(lambda: whole(-0.7), 300)
            r = whole(-0.7)
        row(f"potto, one function, {backend}", ours, r.evals, r.value - value, r.tangent - rate, r.tangent_error)
    for n in (6, 10):
        rule = gauss(n)
        v, t = by_hand(-0.7, rule)
        theirs = best(lambda rule=rule: by_hand(-0.7, rule))
        row(f"numpy by hand, n = {n}", theirs, 2 * n * n, v - value, t - rate, None)
        print(f"{'':34} potto's last takes {ours / theirs:.2f} times as long")
    from scipy.integrate import nquad

    def masked(y: float, x: float) -> float:
        z = x + y - 0.7
        return 1 / (ROOT * z + 2) ** 2 if z >= 0 else 0.0

    options = {"epsabs": 1e-4, "epsrel": 1e-4}

    def peer() -> Any:
        return nquad(masked, [(0, 1), (0, 1)], opts=options, full_output=True)

    v, e, info = peer()
    row("scipy nquad, masked, 1e-4 (value)", best(peer, 3), info["neval"], v - value, None, e)
    cells = (np.arange(1000) + 0.5) / 1000

    def discretized() -> tuple[float, float]:
        z = cells[:, None] + cells - 0.7
        inside = z >= 0
        rate = np.where(inside, -2 * ROOT / (ROOT * z + 2) ** 3, 0).mean()
        return np.where(inside, 1 / (ROOT * z + 2) ** 2, 0).mean(), rate

    v, t = discretized()
    row("derivative of a sum of 1e6 points", best(discretized, 5), 10**6, v - value, t - rate, None)


def row(name: str, seconds: float, evals: int, value: float, rate: float | None, reported: float | None) -> None:
    text = f"{name:34} {seconds * 1e3:8.3f} {evals:8d} {abs(value):10.1e} "
    text += f"{abs(rate):10.1e} " if rate is not None else f"{'-':>10} "
    print(text + (f"{reported:9.1e}" if reported is not None else f"{'-':>9}"))


def grid() -> None:
    title("A 512 x 512 picture of eq. (1), quadratic shader: value and derivative of every pixel, one array call")
    m = potto.compile(PROGRAM)
    d = potto.deriv(m.pixel)
    px, py = np.meshgrid(np.arange(512) / 512, np.arange(512) / 512)

    def picture() -> Any:
        return d((px, 0.0), (py, 0.0), (-0.7, 1.0))

    r = picture()
    value, rate = exact_quad(-0.7)
    print(f"{best(picture, 3):.3f} s, {r.evals / 512**2:.1f} evaluations a pixel, converged: {r.converged}")
    print(f"sum of all pixels: value off by {abs(r.value.sum() - value):.1e}, ", end="")
    print(f"derivative by {abs(r.tangent.sum() - rate):.1e}")
    print(f"largest reported error of a pixel's derivative, of the largest derivative: "
          f"{np.max(r.tangent_error) / np.max(np.abs(r.tangent)):.1e}")  # fmt: skip
    c = np.linspace(-1.99, -0.01, 128 * 128).reshape(128, 128)
    sweep, shader = potto.deriv(m.renderer), potto.deriv(m.quad)
    seconds = best(lambda: sweep((c, 1.0), shader), 2)
    print(f"the whole integral at 128 x 128 values of c, all of them cut: {seconds:.3f} s")


def source_to_answer() -> None:
    title("Source text to first answer of a ten-line definition, warm (the process has answered before)")
    text = r"""
def scene{n}(t, s)
    left = \y . [y < t]
    right = \y . [y > s]
    blend = \(a, b) . a*b + {n}
    weight = \x . exp(-x^2)
    inner = \x . integral [0, 1] left (x*y)*right (x + y) d(y)
    shade = \x . weight x + sin(3*x)
    integral [0, 1]
        blend (inner x, shade x)
        d(x)
"""

    def answer(n: int) -> None:
        m = potto.compile(text.replace("{n}", str(n)))
        getattr(m, f"scene{n}")(0.5, 0.2)

    answer(1)
    times = []
    for n in range(2, 12):
        start = time.perf_counter()
        answer(n)
        times.append(time.perf_counter() - start)
    print(f"least {min(times) * 1e3:.1f} ms, median {sorted(times)[5] * 1e3:.1f} ms (each time a text not seen before)")


def process() -> None:
    title("A process of its own: potto eval, potto --version")
    import tempfile
    from pathlib import Path

    as_installed()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "f.po"
        path.write_text("def f(t) integral [0, 1] [x < t]*x d(x)\n")
        for words in (["eval", str(path), "deriv(f)((0.5, 1))"], ["--version"]):
            command = [sys.executable, "-P", "-m", "potto", *words]
            seconds = best(lambda c=command: subprocess.run(c, check=True, capture_output=True), 10)
            print(f"potto {words[0]:10} {seconds * 1e3:6.0f} ms")
        empty = best(lambda: subprocess.run([sys.executable, "-c", "pass"], check=True), 10)
        print(f"(python -c pass {empty * 1e3:6.0f} ms)")


def conditions() -> None:
    title("The derivative of an integral of n conditions added up: linear in n")
    print(f"{'n':>5} {'written out, warm':>18} {'ms/n':>8} {'sum k in 1..n, warm':>20} {'relative error':>15}")
    for n in (10, 40, 160, 640):
        body = " + ".join(f"{k}*[x < {k}*t/{n + 1}]" for k in range(1, n + 1))
        written = potto.deriv(potto.compile(f"def f(t) integral [0, 1] ({body}) d(x)").f)
        looped = potto.deriv(potto.compile(f"def f(t) integral [0, 1] sum k in 1..{n} (k*[x < k*t/{n + 1}]) d(x)").f)
        exact = sum(k * k / (n + 1) for k in range(1, n + 1))
        error = abs(written((0.9, 1.0)).tangent / exact - 1)
        a = best(lambda f=written: f((0.9, 1.0)), 3)
        b = best(lambda f=looped: f((0.9, 1.0)), 5)
        print(f"{n:5d} {a * 1e3:15.2f} ms {a / n * 1e3:8.3f} {b * 1e3:17.2f} ms {error:15.1e}")


def hard_dimensions() -> None:
    from potto.runtime.answers.printing import with_error

    title("More dimensions")
    m = potto.compile("""
def plane(t) integral ([0, 1], [0, 1], [0, 1]) [x + y + z < t]/(1 + x + 2*y + 3*z) d(x, y, z)
def ball(r) integral ([-1, 1], [-1, 1], [-1, 1]) [x^2 + y^2 + z^2 < r^2] d(x, y, z)
def eight(t) integral ([0,1],[0,1],[0,1],[0,1],[0,1],[0,1],[0,1],[0,1])
    exp(-(a+b+c+d+e+f+g+h))*[a+b+c+d+e+f+g+h < t] d(a,b,c,d,e,f,g,h)
""")
    exact = {"ball": 11.05840614063607063682341760128, "eight": None}
    for name, at in (("plane", 1.2), ("ball", 1.1), ("eight", 3.25)):
        f = potto.deriv(getattr(m, name))
        r = f((at, 1.0))
        seconds = best(lambda f=f, at=at: f((at, 1.0)), 2)
        known = exact.get(name)
        off = f", off by {abs(r.tangent - known):.1e}" if known else ""
        print(f"{name:6} {seconds * 1e3:8.1f} ms {r.evals:8d} evals, {r.method}: derivative "
              f"{with_error(r.tangent, r.tangent_error)}{off}")  # fmt: skip


TABLES = {
    "integral": one_integral,
    "grid": grid,
    "source": source_to_answer,
    "process": process,
    "conditions": conditions,
    "dimensions": hard_dimensions,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", choices=[*TABLES, []], help="which tables; all by default")
    for name in parser.parse_args().tables or TABLES:
        TABLES[name]()


if __name__ == "__main__":
    main()
