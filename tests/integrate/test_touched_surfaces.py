"""A surface that only touches 0 jumps nowhere, wherever it moves; roots near to one another are not taken for that."""

from __future__ import annotations

import math

import pytest

import potto

T = 0.233
TOUCHED = (
    "[abs(3/2*x - t) > 0]",
    "[abs(3/2*x - t) + t*[x >= 0] > t]",
    "[(3/2*x - t)^2 > 0]",
    "[x^2 - 2*x*t + t^2 > 0]",
    "[max(x - t, t - x) > 0]",
    "[abs(abs(x - t) - 0.1) > 0]",
    "[(x - t)^2*exp(y) > 0]",
)


@pytest.mark.parametrize("method", ["quadrature", "mc", "qmc"])
@pytest.mark.parametrize("condition", TOUCHED)
def test_nothing_jumps_where_a_surface_is_touched(condition: str, method: str) -> None:
    """The whole is e^1 - 1, whatever t is; sampled, with a bar of three standard deviations that holds for this seed.
    What few samples may not have seen is in the bar of the slope; a jump there would be larger than 0.7."""
    f = potto.deriv(potto.compile(f"def f(t) integral ([0, 1], [0, 1]) exp(x)*{condition} d(x, y)").f)
    with potto.settings(method=method, samples=1024, seed=1):
        r = f((T, 1.0))
    assert abs(r.value - (math.e - 1)) <= 3 * r.error
    assert abs(r.tangent) <= r.tangent_error + 1e-15 and r.tangent_error < 0.1


@pytest.mark.parametrize("t", [1e-8, 1e-16, 1e-20])
def test_two_roots_that_are_near_to_one_another_are_passed(t: float) -> None:
    """x^2 < t is an interval of length 2*sqrt(t); the labels of its ends are known to 1e-15."""
    f = potto.deriv(potto.compile("def f(t) integral [-1, 1] [x^2 < t] d(x)").f)
    with potto.settings(method="qmc", samples=256, seed=1):
        r = f((t, 1.0))
    assert abs(r.tangent * math.sqrt(t) - 1) <= 1e-14 / math.sqrt(t)
