"""Expectations of measures whose shape is a parameter, with jumps in what is expected: against mpmath's distributions.

Derivatives by every parameter and by the place of the jump, by differences of the closed forms at 40 digits.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from chances import Cdf, check_chances
from mpmath import mp

import potto


def beta(t: mp.mpf, a: mp.mpf, b: mp.mpf) -> mp.mpf:
    return mp.betainc(a, b, 0, t, regularized=True)


def gamma(t: mp.mpf, a: mp.mpf, r: mp.mpf) -> mp.mpf:
    return mp.gammainc(a, 0, r * t, regularized=True)


def student(t: mp.mpf, n: mp.mpf, m: mp.mpf, s: mp.mpf) -> mp.mpf:
    z = (t - m) / s
    tail = mp.betainc(n / 2, mp.mpf(1) / 2, 0, n / (n + z * z), regularized=True) / 2
    return tail if z < 0 else 1 - tail


def cauchy(t: mp.mpf, m: mp.mpf, s: mp.mpf) -> mp.mpf:
    return mp.atan((t - m) / s) / mp.pi + mp.mpf(1) / 2


def logistic(t: mp.mpf, m: mp.mpf, s: mp.mpf) -> mp.mpf:
    return 1 / (1 + mp.exp((m - t) / s))


def lognormal(t: mp.mpf, m: mp.mpf, s: mp.mpf) -> mp.mpf:
    return mp.ncdf((mp.log(t) - m) / s)


CASES: list[tuple[str, tuple[str, ...], Cdf, tuple[float, ...]]] = [
    ("beta(a, b)", ("a", "b"), beta, (0.4, 2.5, 3.0)),
    ("beta(a, b)", ("a", "b"), beta, (0.85, 6.0, 1.5)),
    ("beta(a, b)", ("a", "b"), beta, (0.1, 1.0, 1.0)),
    ("beta(a, b)", ("a", "b"), beta, (0.3, 0.6, 0.7)),
    ("gamma(a, r)", ("a", "r"), gamma, (1.7, 2.5, 1.5)),
    ("gamma(a, r)", ("a", "r"), gamma, (95.0, 200.0, 2.0)),
    ("gamma(a, r)", ("a", "r"), gamma, (0.2, 0.7, 0.5)),
    ("student_t(n, m, s)", ("n", "m", "s"), student, (0.7, 3.0, 0.2, 1.5)),
    ("student_t(n, m, s)", ("n", "m", "s"), student, (-2.5, 1.5, 0.0, 0.7)),
    ("cauchy(m, s)", ("m", "s"), cauchy, (0.7, 0.2, 1.5)),
    ("logistic(m, s)", ("m", "s"), logistic, (0.7, 0.2, 1.5)),
    ("lognormal(m, s)", ("m", "s"), lognormal, (1.7, 0.2, 0.6)),
]


@pytest.mark.parametrize(("measure", "names", "cdf", "values"), CASES)
def test_by_quadrature(measure: str, names: tuple[str, ...], cdf: Cdf, values: tuple[float, ...]) -> None:
    check_chances(measure, names, cdf, values, "quadrature")


@pytest.mark.parametrize("method", ["mc", "qmc"])
@pytest.mark.parametrize(("measure", "names", "cdf", "values"), [c for c in CASES if c[3][1] != 200.0])
def test_by_samples(measure: str, names: tuple[str, ...], cdf: Cdf, values: tuple[float, ...], method: str) -> None:
    check_chances(measure, names, cdf, values, method)


@pytest.mark.parametrize(("measure", "mean"), [
    ("uniform(x, x + 1)", 0.5),
    ("truncated(normal(x, 0.1), x - 0.1, x + 0.05)",
     float(0.1*(mp.npdf(-1) - mp.npdf(0.5))/(mp.ncdf(0.5) - mp.ncdf(-1)))),
])  # fmt: skip
def test_a_range_around_a_variable_far_out(measure: str, mean: float) -> None:
    """At nodes where x + 1 is x to rounding there is a range all the same: its mean is t and a number."""
    f = potto.compile(f"def f(t) integral (x ~ normal(t, 0.1)) (integral (y ~ {measure}) y d(y)) d(x)").f
    answer = potto.deriv(f)((0.5, 1.0))
    assert answer.converged and abs(answer.value - 0.5 - mean) <= answer.error < 1e-12
    assert abs(answer.tangent - 1.0) <= answer.tangent_error < 1e-11


GROWING = potto.compile("""
def moment(k, s) integral (t ~ normal(0, s)) exp(k*t/s) d(t)
def beyond(k, s, a) integral (t ~ normal(0, s)) exp(k*t/s)*[t > a*s] d(t)
def call(m, s, a) integral (t ~ normal(m, s)) max(exp(t) - a, 0) d(t)
""")


@pytest.mark.parametrize("scale", [1e-8, 1, 1e8])
@pytest.mark.parametrize("k", [0.4, 3, 10])
def test_what_a_density_weighs_may_overflow_far_out(k: float, scale: float) -> None:
    """exp(k t) has the mean exp(k^2/2) and, beyond a, that times the normal tail beyond a - k."""
    found = potto.grad(GROWING.moment, "k")(k, scale)
    assert found.converged
    assert found.value == pytest.approx(math.exp(k * k / 2), rel=1e-12)
    assert found.tangent == pytest.approx(k * math.exp(k * k / 2), rel=1e-11)
    tail = GROWING.beyond(k, scale, 1.0)
    assert tail.value == pytest.approx(math.exp(k * k / 2) * math.erfc((1 - k) / math.sqrt(2)) / 2, rel=1e-10)


def test_a_kink_that_is_rounded_to_its_other_side_is_no_peak() -> None:
    """Black's formula; of 2,000 such kinks some twenty lie where the payoff is already more than 0 by rounding."""
    rng = np.random.default_rng(0)
    a, s = 3 * rng.exponential(1, 2000), rng.uniform(0.5, 2, 2000)
    d = (s - 1 - np.log(a)) / s
    exact = [math.exp(v - 1 + v * v / 2) * math.erfc(-(x + v) / math.sqrt(2)) / 2 - k * math.erfc(-x / math.sqrt(2)) / 2
             for v, x, k in zip(s, d, a, strict=True)]  # fmt: skip
    found = GROWING.call(s - 1, s, a)
    assert found.value == pytest.approx(np.array(exact), rel=1e-10)
    assert found.stats["evaluations"] < 250 * 2000  # 211 a member; 340 where such kinks are looked into


def test_what_grows_fast_towards_a_cut_is_no_power_of_the_distance_to_it() -> None:
    """Cut at -3, exp(t) under a normal density leans to that cut from the left, as a singularity there would."""
    found = potto.grad(GROWING.moment, "k")(1.0, 1.0)
    assert found.converged and found.value == pytest.approx(math.exp(0.5), rel=1e-14)
    assert found.error < 1e-12 and found.stats["evaluations"] < 400  # 862, and no more than 10 digits, where graded


def test_a_periodic_condition_under_a_gamma_density() -> None:
    """The mass of gamma(2, r) on the stretches where sin(5x) < t, by its distribution function 1 - (1 + r x) exp(-r x);
    r x*exp(-r x) is told to be nothing far out, where log(x) grows without end."""
    r, t = 1.5, 0.35
    with mp.workdps(30):

        def mass(level: Any) -> Any:
            low = mp.asin(level)
            turns = range(60)
            ends = [(low / 5, (mp.pi - low) / 5)] + [((2 * k * mp.pi + low) / 5, ((2 * k + 1) * mp.pi - low) / 5)
                                                   for k in turns[1:]]  # fmt: skip
            tail = [(1 + r * a) * mp.exp(-r * a) - (1 + r * b) * mp.exp(-r * b) for a, b in ends]
            return 1 - mp.fsum(tail)

        value, slope = mass(mp.mpf(t)), mp.diff(mass, mp.mpf(t))
    f = potto.compile(f"def f(t) integral (x ~ gamma(2, {r})) [sin(5*x) < t] d(x)").f
    answer = potto.deriv(f)((t, 1.0))
    assert abs(answer.value - value) <= answer.error <= 1e-12
    assert abs(answer.tangent - slope) <= answer.tangent_error <= 1e-11
