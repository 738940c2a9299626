"""Integrals of integrals mean and cost what one integral over all their variables does.

Answers in closed form, or by mpmath over the inner integral in closed form. Tolerance: 1e-9 of the answer, and every
reported error must cover it (with 16 ulp for the reference itself). Cost is counted in evaluations.
"""

from __future__ import annotations

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto

EPS = 2.0**-52


def ball(n: int, r2: float) -> tuple[float, float]:
    """The volume of the ball of squared radius r2, and its derivative by r2."""
    unit = math.pi ** (n / 2) / math.gamma(n / 2 + 1)
    return unit * r2 ** (n / 2), unit * n / 2 * r2 ** (n / 2 - 1)


def rate_of(value: Any, t: float) -> tuple[float, float]:
    with mp.workdps(30):
        return float(value(mp.mpf(t))), float(mp.diff(value, mp.mpf(t)))


EXP8 = rate_of(lambda r: ((1 - mp.exp(-r)) / r) ** 8, 0.9)
SQUARE = "([-1, 1], [-1, 1])"
CUBE = "([-1, 1], [-1, 1], [-1, 1])"

# What it is, nested, joined, where, the answer and its derivative
ROWS: list[tuple[str, str, str, float, tuple[float, float]]] = [
    (
        "a disc that touches its box",
        "integral [-1, 1] (integral [-1, 1] [x^2 + y^2 < t] d(y)) d(x)",
        f"integral {SQUARE} [x^2 + y^2 < t] d(x, y)",
        1.0, ball(2, 1.0),
    ),
    (
        "a ball",
        "integral [-1, 1] (integral [-1, 1] (integral [-1, 1] [x^2 + y^2 + z^2 < t] d(z)) d(y)) d(x)",
        f"integral {CUBE} [x^2 + y^2 + z^2 < t] d(x, y, z)",
        0.9, ball(3, 0.9),
    ),
    (
        "one outside, two inside",
        "integral [-1, 1] (integral ([-1, 1], [-1, 1]) [x^2 + y^2 + z^2 < t] d(y, z)) d(x)",
        f"integral {CUBE} [x^2 + y^2 + z^2 < t] d(x, y, z)",
        0.9, ball(3, 0.9),
    ),
    (
        "two outside, one inside",
        "integral ([-1, 1], [-1, 1]) (integral [-1, 1] [x^2 + y^2 + z^2 < t] d(z)) d(x, y)",
        f"integral {CUBE} [x^2 + y^2 + z^2 < t] d(x, y, z)",
        0.9, ball(3, 0.9),
    ),
    (
        "eight variables",
        "(".join(["integral [0, 1] "] * 8)
        + "exp(-t*(a + b + c + g + h + p + q + r))"
        + " ".join(f"d({name}))" for name in "rqphgcba")[:-1],
        "integral ([0, 1], [0, 1], [0, 1], [0, 1], [0, 1], [0, 1], [0, 1], [0, 1]) "
        "exp(-t*(a + b + c + g + h + p + q + r)) d(a, b, c, g, h, p, q, r)",
        0.9, EXP8,
    ),
    (
        "inner bounds that depend on the outer variable",
        "integral [0, 1] (integral [0, x] exp(t*x + y) d(y)) d(x)",
        "integral ([0, 1], [0, x]) exp(t*x + y) d(x, y)",
        0.4, rate_of(lambda t: (mp.exp(t + 1) - 1) / (t + 1) - (mp.exp(t) - 1) / t, 0.4),
    ),
    (
        "a factor outside",
        "integral [0, 2] exp(x)*(integral [0, 1] [x*y < t] d(y)) d(x)",
        "integral ([0, 2], [0, 1]) exp(x)*[x*y < t] d(x, y)",
        0.4, rate_of(lambda t: mp.exp(t) - 1 + t * (mp.ei(2) - mp.ei(t)), 0.4),
    ),
    (
        "a factor that jumps, a divisor and a sign",
        "integral [0, 1] -([x < t]*(integral [0, 1] exp(x*y) d(y))/(1 + x)) d(x)",
        "integral ([0, 1], [0, 1]) -([x < t]*exp(x*y)/(1 + x)) d(x, y)",
        0.4, rate_of(lambda t: -mp.quad(lambda x: mp.expm1(x) / x / (1 + x), [0, t]), 0.4),
    ),
    (
        "reversed bounds",
        "integral [1, 0] (integral [x, -1] exp(x*y*t) d(y)) d(x)",
        "integral ([1, 0], [x, -1]) exp(x*y*t) d(x, y)",
        0.4, rate_of(lambda t: mp.quad(lambda x: (mp.exp(x * x * t) - mp.exp(-x * t)) / (x * t), [0, 1]), 0.4),
    ),
    (
        "infinite bounds",
        "integral [0, inf] (integral [0, inf] exp(-x - y*(1 + t*x)) d(y)) d(x)",
        "integral ([0, inf], [0, inf]) exp(-x - y*(1 + t*x)) d(x, y)",
        0.4, rate_of(lambda t: mp.exp(1 / t) * mp.e1(1 / t) / t, 0.4),
    ),
    (
        "measures, one of which is around the other",
        "integral (x ~ normal(t, 1)) (integral (y ~ normal(x, 0.5)) [y < 0.3] d(y)) d(x)",
        "integral (x ~ normal(t, 1), y ~ normal(x, 0.5)) [y < 0.3] d(x, y)",
        0.4, rate_of(lambda t: mp.ncdf((mp.mpf(0.3) - t) / mp.sqrt(1.25)), 0.4),
    ),
    (
        "a delta inside",
        "integral [0, 1] (integral [0, 1] delta(x + y - t)*exp(x) d(y)) d(x)",
        "integral ([0, 1], [0, 1]) delta(x + y - t)*exp(x) d(x, y)",
        0.4, rate_of(lambda t: mp.expm1(t), 0.4),
    ),
    (
        "a delta of the outer variable",
        "integral [0, 1] (integral [0, 1] delta(x - t)*exp(x*y) d(y)) d(x)",
        "integral ([0, 1], [0, 1]) delta(x - t)*exp(x*y) d(x, y)",
        0.4, rate_of(lambda t: mp.expm1(t) / t, 0.4),
    ),
    (
        "a name that hides the outer one",
        "integral [0, 1] (integral [0, x] t*x d(x)) d(x)",
        "integral ([0, 1], [0, x]) t*y d(x, y)",
        0.4, (0.4 / 6, 1 / 6),
    ),
    (
        "a local name",
        "integral [0, 1] (let s = x + t in integral [0, s] [y < x]*s d(y)) d(x)",
        "integral ([0, 1], [0, x + t]) [y < x]*(x + t) d(x, y)",
        0.4, (1 / 3 + 0.2, 0.5),
    ),
    (
        "a sum of integrals over one region",
        "integral [-1, 1] ((integral [-1, 1] [x^2 + y^2 < t] d(y)) + (integral [-1, 1] x^2*s^2 d(s))) d(x)",
        f"integral {SQUARE} ([x^2 + y^2 < t] + x^2*y^2) d(x, y)",
        0.9, (ball(2, 0.9)[0] + 4 / 9, math.pi),
    ),
    (
        "a function of the outer variable beside one",
        "integral [-1, 1] x^2*(3 - 2*(integral [-1, 1] [x^2 + y^2 < t] d(y))) d(x)",
        f"integral {SQUARE} x^2*(3/2 - 2*[x^2 + y^2 < t]) d(x, y)",
        0.9, (2 - math.pi * 0.9**2 / 2, -math.pi * 0.9),
    ),
    (
        "a sum of integrals over regions of their own",
        "integral [0, 1] (2*(integral [0, x] [y < t] d(y)) - (integral [0, 1] [x + y < t] d(y))/2) d(x)",
        "(2*(integral ([0, 1], [0, x]) [y < t] d(x, y)) - (integral ([0, 1], [0, 1]) [x + y < t] d(x, y))/2)",
        0.4, (2 * 0.4 - 1.25 * 0.4**2, 2 - 2.5 * 0.4),
    ),
    (
        "measures, and a function of the outer number",
        "integral (x ~ normal(t, 1)) ((integral (y ~ normal(x, 0.5)) [y < 0.3] d(y)) + x^2) d(x)",
        "(integral (x ~ normal(t, 1), y ~ normal(x, 0.5)) [y < 0.3] d(x, y)) + (integral (x ~ normal(t, 1)) x^2 d(x))",
        0.4, rate_of(lambda t: mp.ncdf((mp.mpf(0.3) - t) / mp.sqrt(1.25)) + 1 + t * t, 0.4),
    ),
]  # fmt: skip
IDS = [row[0] for row in ROWS]


def asked(body: str, t: float, before: str = "") -> Any:
    return potto.deriv(potto.compile(f"{before}\ndef f(t) {body}\n").f)((t, 1.0))


def holds(answer: Any, exact: tuple[float, float]) -> None:
    assert answer.converged, answer.reasons
    for found, error, true in zip(
        (answer.value, answer.tangent), (answer.error, answer.tangent_error), exact, strict=True
    ):
        assert found == pytest.approx(true, rel=1e-9, abs=1e-14)
        assert abs(found - true) <= error + 16 * EPS * abs(true)


@pytest.mark.parametrize(("name", "nested", "joined", "t", "exact"), ROWS, ids=IDS)
def test_nested_is_joined(name: str, nested: str, joined: str, t: float, exact: tuple[float, float]) -> None:
    first, second = asked(nested, t), asked(joined, t)
    holds(first, exact)
    holds(second, exact)
    assert first.evals == second.evals


def test_a_parameter_may_be_called_like_a_variable_inside() -> None:
    f = potto.compile("def f(y) integral [0, y] y*(integral [0, 1] x*y d(y)) d(x)\n").f
    holds(potto.deriv(f)((0.4, 1.0)), (0.4**3 / 4, 3 * 0.4**2 / 4))


def test_behind_a_call() -> None:
    inner = "def inner(x, t) integral [0, 1] [x*y < t] d(y)"
    plain = asked(ROWS[6][1], 0.4)
    for call, before in [
        ("inner(x, t)", inner),
        ("again(x, t)", f"{inner}\ndef again(a, b) inner(a, b)"),
        ("curried(x)(t)", "def curried(x)(t) integral [0, 1] [x*y < t] d(y)"),
        ("inner(t=t, x=x)", inner),
    ]:
        answer = asked(f"integral [0, 2] exp(x)*{call} d(x)", 0.4, before)
        holds(answer, ROWS[6][4])
        assert answer.evals == plain.evals


def test_behind_calls_of_calls() -> None:
    """However many there are, each with something of its own to do: a disc as one integral over two variables."""
    calls = "".join(f"def g{k}(x, t) -2*g{k - 1}(x, t)/2\n" for k in range(1, 41))
    inner = "integral [-1, 1] [x^2 + y^2 < t] d(y)"
    behind = potto.compile(f"def g0(x, t) {inner}\n{calls}def f(t) integral [-1, 1] g40(x, t) d(x)").f(0.5)
    written = potto.compile(f"def f(t) integral [-1, 1] ({inner}) d(x)").f(0.5)
    assert abs(behind.value - math.pi / 2) <= behind.error <= 1e-13
    assert behind.evals == written.evals


def test_a_function_with_variables_called_like_ours() -> None:
    before = "def inner(y, x) integral [0, y] x*u d(u)\ndef other(u) integral [0, 1] inner(u, x) d(x)"
    # other(u) = u^2/4; over [0, t]: t^3/12
    holds(asked("integral [0, t] other(u) d(u)", 0.7, before), (0.7**3 / 12, 0.7**2 / 4))


def test_what_does_not_vary_is_found_once() -> None:
    answer = asked("integral [0, 1] (integral [0, 1] exp(y*t) d(y))*x d(x)", 0.4)
    holds(answer, rate_of(lambda t: mp.expm1(t) / t / 2, 0.4))
    assert answer.evals < 60  # not the product of both


def test_what_is_found_once_is_not_found_where_no_side_asks_for_it() -> None:
    """sqrt(t - 2) has no value at 1, and no x is above 2."""
    inner = "def inner(t) integral [0, 1] y*sqrt(t - 2) d(y)\n"
    f = potto.compile(f"{inner}def f(t) integral [0, 1] (if [x > 2] then 1 + inner(t) else x*t) d(x)").f
    answer = potto.grad(f)(1.0)
    assert (answer.value, answer.tangent) == pytest.approx((0.5, 0.5), rel=1e-15) and answer.converged


def test_a_nonlinear_function_of_an_inner_integral_stays() -> None:
    answer = asked("integral [0, 1] exp(integral [0, 1] [y < x*t] d(y)) d(x)", 0.4)
    holds(answer, rate_of(lambda t: mp.expm1(t) / t, 0.4))


def test_a_sum_that_alone_is_finite_is_not_taken_apart() -> None:
    answer = asked("integral [0, 1] ((integral [0, x] cos(t*y)/x^2 d(y)) - 1/x) d(x)", 0.7)
    holds(answer, rate_of(lambda t: mp.quad(lambda x: (mp.sin(t * x) / (t * x) - 1) / x, [0, 1]), 0.7))


def test_second_derivatives() -> None:
    f = potto.compile("def f(t) integral [0, 1] (integral [0, 1] [x + y < t]*x*y d(y)) d(x)").f  # t^4/24
    found = potto.deriv(potto.deriv(f))(((0.4, 1.0), (1.0, 0.0)))
    (_, first), (_, second) = found.value, found.tangent
    assert first == pytest.approx(0.4**3 / 6, rel=1e-9) and second == pytest.approx(0.4**2 / 2, rel=1e-9)


def test_a_derivative_with_a_name() -> None:
    before = "def f0(t) integral [0, 1] (integral [0, 1] [x*y < t] d(y)) d(x)"
    answer = potto.compile(f"{before}\ndef g(t) snd(deriv(f0)((t, 1)))").g(0.4)
    assert abs(answer.value + math.log(0.4)) <= answer.error + 16 * EPS  # t - t log t


def test_arrays_of_parameters() -> None:
    f = potto.compile("def f(t) integral [-1, 1] (integral [-1, 1] [x^2 + y^2 < t] d(y)) d(x)").f
    t = np.array([0.25, 0.5, 0.81, 1.0])
    answer = potto.deriv(f)((t, np.ones(4)))
    assert np.all(np.abs(answer.value - math.pi * t) <= answer.error + 1e-14)
    assert np.all(np.abs(answer.tangent - math.pi) <= answer.tangent_error + 1e-14)


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_samples(method: str) -> None:
    f = potto.compile("def f(t) integral [-1, 1] (integral [-1, 1] [x^2 + y^2 < t] d(y)) d(x)").f
    with potto.settings(method=method, samples=40_000, seed=3):
        answer = potto.deriv(f)((0.5, 1.0))
    assert abs(answer.value - math.pi / 2) <= 2 * answer.error and answer.error < 0.05
    assert abs(answer.tangent - math.pi) <= 2 * answer.tangent_error + 1e-12 and answer.tangent_error < 0.2


@pytest.mark.parametrize("behind", [False, True])
def test_a_bracket_inside_of_a_condition_of_an_inner_integral(behind: bool) -> None:
    """What is further in jumps at x = 2 t and 2 t - 1/2, for a part of y each."""
    t = 0.2
    inner = "integral [-1, 1] [x + 0.5*[-y - x >= t] > 2*t]*(y + 2) d(y)"
    program = f"def g(x, t) {inner}\ndef f(t) integral [-0.5, 1.5] exp({'g(x, t)' if behind else f'({inner})'}) d(x)"
    found = potto.deriv(potto.compile(program).f)((t, 1.0))
    with mp.workdps(30):

        def whole(u: Any) -> Any:  # of y < -x - t, where u = x + t
            return mp.exp(((2 - u) ** 2 - 1) / 2)

        value = 2 * t + mp.quad(whole, [3 * t - 0.5, 3 * t]) + (1.5 - 2 * t) * mp.exp(4)
        rate = 2 + 3 * (whole(3 * t) - whole(3 * t - 0.5)) - 2 * mp.exp(4)
    assert found.converged
    assert abs(found.value - float(value)) <= found.error + 16 * EPS * float(value) < 1e-9 * 61
    assert abs(found.tangent - float(rate)) <= found.tangent_error + 16 * EPS * abs(float(rate)) < 1e-9 * 113
