"""Derivatives by differences of values, which stand in where boundary terms have no digits; never for kinks."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest

import potto
from potto.integrate.pieces import Sums
from potto.kernels.cells import Cell, Value
from potto.runtime.integration.derivatives.differences import _derivative

FUNCTIONS: list[tuple[Callable[[float], float], float | None]] = [
    (math.exp, math.e),
    (lambda x: x**7, 7.0),
    (lambda x: 1 / x, -1.0),
    (lambda x: math.sin(20 * x), 20 * math.cos(20)),
    (lambda x: abs(x - 1), None),
    (lambda x: max(x, 1.0) ** 2, None),
    (lambda x: math.sqrt(abs(x - 1)), None),
    (lambda x: math.copysign(abs(x - 1) ** (1 / 3), x - 1), None),  # infinite on both sides alike
]


@pytest.mark.parametrize("number", range(len(FUNCTIONS)))
def test_smooth_functions_have_one_and_kinks_none(number: int) -> None:
    f, exact = FUNCTIONS[number]

    def evaluated(env: dict[str, Value]) -> Sums:
        x = env["x"]
        assert isinstance(x, Cell)
        v = np.array([[f(x.v)]])
        return Sums(v, np.full((1, 1), 1e-15), np.zeros((1, 0, 1)), np.zeros((1, 0, 1)))

    nothing = np.zeros(1), np.full(1, np.inf)  # is known of it
    found = _derivative({"x": Cell(1.0, None, (1.0,))}, 0, 1 / 64, evaluated, nothing)
    if exact is None:
        assert found is None or found[1][0] > 0.1 * abs(found[0][0])
    else:
        assert found is not None
        assert abs(found[0][0] - exact) <= found[1][0] <= 1e-4 * abs(exact)


@pytest.mark.parametrize("tilt", [1e-16, -1e-16, 1e-17])
def test_surfaces_that_are_parallel_to_both_axes_but_for_rounding(tilt: float) -> None:
    """Along every variable one of them has a section that is steep beyond the digits of a double."""
    f = potto.compile(f"""
def f(t)
    integral ([0, 1], [0, 1]) [x + ({tilt!r})*y < t]*[y - ({tilt!r})*x < t]*exp(x) d(x, y)
""").f
    answer = potto.deriv(f)((0.3, 1.0))
    exact = math.expm1(0.3) + 0.3 * math.exp(0.3)  # of t (e^t - 1)
    assert abs(answer.tangent - exact) <= answer.tangent_error + 1e-15 <= 1e-10


@pytest.mark.parametrize("waves", [1e10, 1e12])
def test_waves_too_short_for_differences(waves: float) -> None:
    """At parameters a 64th and a 128th apart they look like slow ones; the derivative itself has six digits at 1e10."""
    f = potto.compile(f"def f(t) integral [0, 1] sin(x + {waves!r}*t) d(x)").f
    answer = potto.grad(f)(1.0)
    with mp.workdps(40):
        exact = waves * (mp.sin(mp.mpf(waves) + 1) - mp.sin(mp.mpf(waves)))
        assert abs(answer.tangent - exact) <= answer.tangent_error <= 0.01 * abs(exact)


def test_of_derivatives_with_the_digits_that_were_asked_for_there_are_none() -> None:
    """Differences take 17 values. The derivative is the integral of exp(x - t/(3*x))/(3*x) from t/3 to 1."""
    f, t = potto.compile("def f(t) integral ([0, 1], [0, 1]) [x*y < t/3]*exp(x - y) d(x, y)").f, 0.41
    with potto.settings(rtol=1e-3):
        value, answer = f(t), potto.grad(f)(t)
    exact = mp.quad(lambda x: mp.exp(x - t / (3 * x)) / (3 * x), [t / 3, 1])
    assert abs(answer.tangent - exact) <= answer.tangent_error <= 1e-3 * exact
    assert answer.evals <= 2 * value.evals
