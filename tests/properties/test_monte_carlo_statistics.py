"""Monte Carlo is unbiased, and its reported error is what it says: four standard errors.

Over many seeds, z = (estimate - exact)/standard error has mean 0 and variance 1. The mean of n such numbers has a
standard deviation of 1/sqrt(n); a test that allows 4 of those fails for a right estimator once in 16,000 choices of
seeds, and the seeds are fixed. The exact numbers are closed forms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import mpmath as mp
import numpy as np
import pytest
from how_many import examples

import potto
from potto.integrate.montecarlo.sampling import SIGMAS

SAMPLES = 2_000
T = 0.6


@dataclass(frozen=True)
class Problem:
    """A function f(t) at t = 0.6, its value and its derivative there."""

    name: str
    source: str
    value: float
    tangent: float
    definitions: str = ""


PROBLEMS = (
    # int_0^t x dx + (1 - t)
    Problem("step", "integral [0, 1] (if [x < t] then x else 1) d(x)", T * T / 2 + 1 - T, T - 1),
    # int_0^t sin x [x > 1/4] dx
    Problem("moving bound", "integral [0, t] sin(x)*[x > 0.25] d(x)", math.cos(0.25) - math.cos(T), math.sin(T)),
    # The integral of exp(-x) over x > t
    Problem("infinite", "integral [0, inf] exp(-x)*[x > t] d(x)", math.exp(-T), -math.exp(-T)),
    # P(x < t) for x ~ normal(0, 1)
    Problem(
        "normal",
        "integral (x ~ normal(0, 1)) [x < t] d(x)",
        (1 + math.erf(T / math.sqrt(2))) / 2,
        math.exp(-T * T / 2) / math.sqrt(2 * math.pi),
    ),
    # int int [x + y < t] x y = t^4/24
    Problem("triangle", "integral ([0, 1], [0, 1]) [x + y < t]*x*y d(x, y)", T**4 / 24, T**3 / 6),
    # A quarter of a disc of area pi t/4, and e outside of it
    Problem(
        "disc",
        "integral ([0, 1], [0, 1]) exp([x^2 + y^2 > t]) d(x, y)",
        math.pi * T / 4 + math.e * (1 - math.pi * T / 4),
        math.pi / 4 * (1 - math.e),
    ),
    # {y < x t} below the diagonal: int_0^1 x t dx, and the bound follows x
    Problem("wedge", "integral ([0, 1], [0, x]) [y < x*t]*x d(x, y)", T / 3, 1 / 3),
    # int_0^1 (t x)^2 dx: a function of an inner integral
    Problem("nested", "integral [0, 1] (integral [0, 1] [y < t*x] d(y))^2 d(x)", T * T / 3, 2 * T / 3),
    # int_0^t e^(2x) dx + 1 - t: a jump under an inner integral
    Problem(
        "constant inside",
        "integral [0, 1] exp(integral [0, 2] [x < t]*x d(y)) d(x)",
        (math.exp(2 * T) - 1) / 2 + 1 - T,
        math.exp(2 * T) - 1,
    ),
    # Several roots along a line: int_0^1 (1/2 + asin(t y)/pi) dy
    Problem(
        "waves",
        "integral ([0, 1], [0, 1]) [sin(4*pi*x) < t*y] d(x, y)",
        0.5 + (math.asin(T) + (math.sqrt(1 - T * T) - 1) / T) / math.pi,
        (1 - math.sqrt(1 - T * T)) / (math.pi * T * T),
    ),
    # Parallel to one variable here and to the other there: two squares
    Problem("product", "integral ([0, 1], [0, 1]) [(x - t)*(y - t) > 0] d(x, y)", T**2 + (1 - T) ** 2, 4 * T - 2),
    # Nearly parallel to the innermost variable: int_0^1 (t - y/1000) dy
    Problem("steep", "integral ([0, 1], [0, 1]) [x + 0.001*y < t] d(x, y)", T - 0.0005, 1.0),
    # An eighth of a ball
    Problem(
        "ball",
        "integral ([0, 1], [0, 1], [0, 1]) [x^2 + y^2 + z^2 < t] d(x, y, z)",
        math.pi * T**1.5 / 6,
        math.pi * math.sqrt(T) / 4,
    ),
    # A condition in a function that is called: int_0^t (1 - (x/t)^2) dx
    Problem(
        "called",
        "integral ([0, 1], [0, 1]) below(x/t, y) d(x, y)",
        2 * T / 3,
        2 / 3,
        "def below(u, v) if [u^2 + v < 1] then 1 else 0\n",
    ),
    # A bound that follows x to infinity: half of int_0^t s exp(-s) ds
    Problem(
        "infinite wedge",
        "integral ([0, inf], [x, inf]) exp(-x - y)*[x + y < t] d(x, y)",
        (1 - (1 + T) * math.exp(-T)) / 2,
        T * math.exp(-T) / 2,
    ),
    # A curve in a domain that moves: x^2 < y < t for x below sqrt(t)
    Problem("moving domain", "integral ([0, 1], [0, t]) [y > x^2] d(x, y)", 2 * T**1.5 / 3, math.sqrt(T)),
    # int_0^1 int_0^1 exp(3 [x < t] + [(x - t)(y - t) > 0]) where two surfaces coincide
    Problem(
        "coincident",
        "integral ([0, 1], [0, 1]) exp(3*[x < t] + [(x - t)*(y - t) > 0]) d(x, y)",
        T * (math.exp(4) * T + math.exp(3) * (1 - T)) + (1 - T) * (T + math.e * (1 - T)),
        2 * T * math.exp(4) + (1 - 2 * T) * math.exp(3) + (1 - 2 * T) - 2 * math.e * (1 - T),
    ),
    # A sector of a disc, pi/2 + t/2; the cut of the angle stays where it is
    Problem(
        "sector",
        "integral ([-1, 1], [-1, 1]) [atan2(y, x) < t]*[x^2 + y^2 < 1] d(x, y)",
        math.pi / 2 + T / 2,
        0.5,
    ),
    Problem("reversed", "integral ([1, 0], [0, 1]) [x*y < t] d(x, y)", -T * (1 - math.log(T)), math.log(T)),
)


def scores(problem: Problem, method: str, seeds: range) -> tuple[list[float], list[float]]:
    """(estimate - exact)/standard error, of the value and of the derivative."""
    f = potto.deriv(potto.compile(f"{problem.definitions}def f(t) {problem.source}").f)
    values, tangents = [], []
    for seed in seeds:
        with potto.settings(method=method, samples=SAMPLES, seed=seed):
            answer = f((T, 1.0))
        for got, error, exact, into in (
            (answer.value, answer.error, problem.value, values),
            (answer.tangent, answer.tangent_error, problem.tangent, tangents),
        ):
            if error > 1e-9 * abs(exact):
                into.append((got - exact) / (error / SIGMAS))
            else:  # nothing is left to chance, as where the surface is a point: good to rounding
                assert abs(got - exact) <= max(error, 1e-9 * abs(exact))
    return values, tangents


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_what_nothing_is_drawn_for_is_as_good_as_its_rounding(method: Literal["mc", "qmc"]) -> None:
    """The derivative of a step on a line is the integrand there: cos(200 t), whose argument is rounded."""
    f = potto.deriv(potto.compile("def f(t) integral [0, 1] [x < t]*cos(200*x) d(x)").f)
    for t in np.linspace(0.01, 0.99, 40):
        with potto.settings(method=method, samples=64):
            answer = f((t, 1.0))
        exact = mp.cos(200 * mp.mpf(t))
        assert abs(answer.tangent - exact) <= answer.tangent_error < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("method", ["mc", "qmc"])
@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda p: p.name)
def test_reported_errors_cover_what_is_wrong(problem: Problem, method: str) -> None:
    count = examples(120)
    seeds = range(count) if method == "mc" else range(0, 200 * count, 1_000)
    values, tangents = scores(problem, method, seeds)
    for found in (values, tangents):
        if not found:
            continue
        missed = sum(abs(z) > SIGMAS for z in found)
        # A normal number is beyond 4 standard deviations once in 16,000 times, and bars of qmc are as wide in terms of
        # Student's t: two such out of 1,000 have a probability of 2e-3, two out of these 3e-5.
        assert missed <= 1, (missed, len(found))
        if method == "mc":
            assert abs(np.mean(found)) < 4 / math.sqrt(len(found)), found
            assert abs(np.var(found) - 1) < 4 * math.sqrt(2 / len(found))  # of n scores with a variance of 1


@pytest.mark.slow
@pytest.mark.parametrize(("method", "steepest", "flattest"), [("mc", -0.6, -0.4), ("qmc", -2.2, -0.8)])
@pytest.mark.parametrize("name", ["triangle", "ball", "waves", "moving domain"])
def test_errors_fall_with_the_number_of_samples(name: str, method: str, steepest: float, flattest: float) -> None:
    """As its square root for independent points, about as its inverse or faster for Sobol points."""
    problem = next(p for p in PROBLEMS if p.name == name)
    f = potto.deriv(potto.compile(f"{problem.definitions}def f(t) {problem.source}").f)
    counts, errors = (1 << 10, 1 << examples(15, 16)), []
    for count in counts:
        off = []
        for seed in range(40):
            with potto.settings(method=method, samples=count, seed=seed):
                answer = f((T, 1.0))
            off.append((answer.value - problem.value, answer.tangent - problem.tangent))
        errors.append(np.sqrt(np.mean(np.square(off), axis=0)))
    slopes = np.log(errors[1] / errors[0]) / math.log(counts[1] / counts[0])
    assert all(steepest < slope < flattest for slope in slopes), slopes
