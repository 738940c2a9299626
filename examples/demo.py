"""What `make demo` shows: the paper's programs run and differentiated, a diagnostic, and what accuracy costs."""

from __future__ import annotations

import math
import os
import sys
import tempfile
import time
from pathlib import Path

import potto
from potto.__main__ import main

HERE = Path(__file__).resolve().parent
RENDERER = "paper/renderer.po"
QUAD = r"\(x, y) . c . 1/(sqrt(2)*(x+y+c)+2)^2"
C = -0.7


def show(*command: str, status: int = 0) -> None:
    """Run a command as a person would, and insist on how it ends."""
    shown = " ".join(f"'{word}'" if set(word) & set(" ()\\*") else word for word in command)
    print(f"\n$ potto {shown}", flush=True)
    ended = main(list(command))
    sys.stderr.flush()
    if ended != status:
        sys.exit(f"demo: `potto {shown}` ended with {ended}, not {status}")


def exact(c: float) -> tuple[float, float]:
    """The quadratic shader over the unit square and its derivative by c, in closed form.

    With s = x + y, whose density is s on [0, 1] and 2 - s on [1, 2], the integral is one over s from -c to 2; with
    u = sqrt(2) (s + c) + 2 every piece is elementary.
    """
    k = math.sqrt(2)

    def u(s: float) -> float:
        return k * (s + c) + 2

    def square(s: float, a: float, b: float) -> float:  # antiderivative of (a + b s) / u^2
        return -a / (k * u(s)) + b / k * ((math.log(u(s)) + 2 / u(s)) / k + c / u(s))

    def cube(s: float, a: float, b: float) -> float:  # of (a + b s) / u^3
        return -a / (2 * k * u(s) ** 2) + b / k * ((-1 / u(s) + 1 / u(s) ** 2) / k + c / (2 * u(s) ** 2))

    def over(f: object) -> float:
        assert callable(f)
        return float(f(1, 0, 1) - f(-c, 0, 1) + f(2, 2, -1) - f(1, 2, -1))

    boundary = -c / 4  # the density at s = -c times the shader there, 1/2^2
    return over(square), boundary - 2 * k * over(cube)


def accuracy() -> None:
    """Time against error, for the renderer with the quadratic shader."""
    renderer = potto.load(HERE / RENDERER).renderer
    shader = potto.compile(f"shader = {QUAD}").shader
    value, slope = exact(C)
    say(f"Speed against error: the quadratic shader at c = {C}, value and derivative, kernels made before.")
    print(f"{'':>22} {'time':>10} {'evaluations':>12} {'error of value':>15} {'error of derivative':>20}")
    for label, settings in (
        ("quadrature", {"method": "quadrature"}),
        ("Monte Carlo, 10^4", {"method": "mc", "samples": 10_000}),
        ("Monte Carlo, 10^5", {"method": "mc", "samples": 100_000}),
    ):
        derivative = potto.deriv(renderer)
        with potto.settings(**{**settings, "samples": 100}):
            derivative((C, 1.0), potto.deriv(shader))  # makes the kernels
        with potto.settings(**settings):
            start = time.perf_counter()
            r = derivative((C, 1.0), potto.deriv(shader))
            seconds = time.perf_counter() - start
        errors = f"{abs(r.value - value):>15.1e} {abs(r.tangent - slope):>20.1e}"
        print(f"{label:>22} {seconds * 1e3:>7.2f} ms {r.evals:>12,} {errors}")


def say(text: str) -> None:
    print(f"\n{text}", flush=True)


def run() -> None:
    os.chdir(HERE)
    say("The paper's main program: the derivative of a pixel for three shaders, at a corner where all is 0.")
    show("run", "paper/main.po")
    say(f"A pixel that the edge cuts (c = {C}), with the constant shader: its value, and its derivative by c.")
    show("eval", RENDERER, f"renderer({C}, \\(x, y) . c . 1)")
    show("eval", RENDERER, f"drenderer(({C}, 1), deriv(\\(x, y) . c . 1))")
    say("Differentiating samples instead would say 0: the shader is constant, and no sample moves with the edge.")
    say("The same with the quadratic shader, whose derivative has an interior part as well.")
    show("eval", RENDERER, f"drenderer(({C}, 1), deriv({QUAD}))")
    say("The derivative in symbols.")
    show("deriv", RENDERER, "renderer")
    say("A jump that Potto is not told about is refused.")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        text = "def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\n"
        Path("wrong.po").write_text(text, encoding="utf-8")
        show("check", "wrong.po", status=1)
        os.chdir(HERE)
    accuracy()


if __name__ == "__main__":
    run()
