"""Roots of x^n = a for an n that is given when the program runs: each is found once."""

from __future__ import annotations

import math

import pytest

import potto


@pytest.mark.parametrize(
    ("a", "n", "by_a", "by_n"),
    [
        (0.5, 1, 1.0, 0.5 * math.log(2)),
        (-0.5, 3, 0.5 ** (-2 / 3) / 3, 0.5 ** (1 / 3) * math.log(0.5) / 9),
        (0.5, 2, math.sqrt(2), 0.5 ** (1 / 2) * math.log(2) / 2),
    ],
)
def test_a_power_whose_exponent_is_a_parameter(a: float, n: int, by_a: float, by_n: float) -> None:
    """x < a^(1/n), and for an even n also x > -a^(1/n); by hand, to 1e-10 as it was asked. x = a was found twice for
    n = 1, once as a root for odd exponents, and the surface was said to fold there."""
    f = potto.compile("def f(a, n) integral [-1, 1] [x^n < a] d(x)").f
    found = potto.grad(f, wrt=["a", "n"])(a=a, n=n)
    assert found.converged and found.notes == ()
    assert found.tangent == pytest.approx([by_a, by_n], rel=1e-10)
