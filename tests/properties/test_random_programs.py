"""Random programs: value and derivative against brute force, and reported errors that cover what is wrong.

The value of a program comes from `plain_quadrature`, to about 1e-12. Its derivative is extrapolated from central
differences with steps 0.004, 0.002 and 0.001: to about 1e-9, and the last two extrapolations say how well. Parameters
at which the difference quotients don't settle, or those of the two sides differ, are left out: nothing is promised
there.
"""

from __future__ import annotations

import math
import random
import warnings
from dataclasses import dataclass

import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st
from plain_quadrature import Program, TooHard, estimate
from program_source import random_program

import potto
from potto.diagnostics import PottoError

# Enough for what these programs are; one whose budget runs out must say so, and need not take a minute for it.
BUDGET = 2_000_000
pytestmark = pytest.mark.filterwarnings("ignore:The recursion limit")  # deep input is read with a higher one
STEPS = (0.004, 0.002, 0.001)


@dataclass(frozen=True)
class Point:
    """Where a program is evaluated, and the direction of its derivative."""

    t: float
    s: float
    dt: float
    ds: float

    def moved(self, h: float) -> dict[str, float]:
        return {"t": self.t + h * self.dt, "s": self.s + h * self.ds}


@dataclass(frozen=True)
class Slope:
    """A derivative by differences. `known`: the quotients settle, from both sides on the same number."""

    value: float
    error: float
    known: bool


def slope(program: Program, point: Point, value: float) -> Slope:
    quotients, gaps, off = [], [], 0.0
    for h in STEPS:
        (up, off_up), (down, off_down) = estimate(program, **point.moved(h)), estimate(program, **point.moved(-h))
        quotients.append((up - down) / (2 * h))
        gaps.append(abs(up - 2 * value + down) / h)
        off = max(off, off_up, off_down)
    first, second = (4 * quotients[1] - quotients[0]) / 3, (4 * quotients[2] - quotients[1]) / 3
    best = (16 * second - first) / 15
    size = max(1.0, abs(best))
    error = 10 * abs(best - second) + (1e-12 * max(1.0, abs(value)) + 10 * off) / STEPS[-1]
    # A kink's gap stays when the step is halved, that of a smooth function is halved too.
    return Slope(best, error, gaps[2] <= 0.6 * gaps[1] + 1e-7 * size and error < 1e-3 * size)


def where(number: int) -> Point:
    pick = random.Random(number)
    return Point(pick.uniform(0.2, 1.3), pick.uniform(0.2, 1.3), *pick.choice([(1.0, 0.0), (0.0, 1.0), (1.0, -0.5)]))


def check(number: int, flat: bool = False) -> str:
    """Compare one program; what came of it."""
    text, program = random_program(number, flat)
    point = where(number)
    try:
        value, off = estimate(program, **point.moved(0.0))
        by_differences = slope(program, point, value)
    except TooHard:
        return "too hard"
    try:
        with potto.settings(max_evals=BUDGET), warnings.catch_warnings():
            warnings.simplefilter("ignore", potto.ProgramWarning)  # where only `f` is broken
            module = potto.compile(text)
            plain = module.f(point.t, point.s)
            dual = potto.deriv(module.f)((point.t, point.dt), (point.s, point.ds))
    except PottoError as refused:
        assert all(d.code.startswith("P04") for d in refused.diagnostics), f"{text}\n{refused}"
        return "refused"
    context = f"program {number} at {point}:\n{text}"
    size = max(1.0, abs(value))
    for answer in (plain, dual):
        assert abs(answer.value - value) <= answer.error + 1e-11 * size + 3 * off, f"{context}{answer} {value}"
    _useful(dual, size, by_differences, context)
    if not by_differences.known:
        return "not differentiable"
    allowed = dual.tangent_error + by_differences.error
    assert abs(dual.tangent - by_differences.value) <= allowed, f"{context}{dual} {by_differences}"
    return "compared" if dual.converged else "not converged"


def _useful(dual: potto.Estimate, size: float, by_differences: Slope, context: str) -> None:
    """An error bound that says something, or a reason why not."""
    if dual.converged:
        assert not dual.reasons
        assert dual.error <= 1e-6 * size, f"{context}{dual}"
        assert dual.tangent_error <= 1e-6 * max(1.0, abs(by_differences.value)), f"{context}{dual}"
    else:
        assert dual.reasons, f"{context}{dual}"
    assert not math.isnan(dual.value) and not math.isnan(dual.tangent), f"{context}{dual}"


@seed(20260)
@settings(max_examples=60, deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**6))
def test_programs_over_one_variable(number: int) -> None:
    check(number, flat=True)


@pytest.mark.parametrize("number", range(40))
def test_programs_over_two_variables(number: int) -> None:
    check(number)


# A thousand programs, whose reported errors all cover what is wrong with their values and derivatives.


@pytest.mark.slow
@pytest.mark.parametrize("start", range(10_000, 10_840, 70))
def test_many_programs_over_one_variable(start: int) -> None:
    outcomes = [check(number, flat=True) for number in range(start, start + 70)]
    assert outcomes.count("compared") >= 60, outcomes


@pytest.mark.slow
@pytest.mark.parametrize("start", range(1000, 1160, 20))
def test_many_programs_over_two_variables(start: int) -> None:
    outcomes = [check(number) for number in range(start, start + 20)]
    assert outcomes.count("compared") >= 12, outcomes
