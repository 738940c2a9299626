"""Cuts whose formula goes by the sign of a parameter, as those of a quadratic do: members are integrated by each.

The closed forms are integrals of polynomials up to the root of a parabola.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

import potto

PROGRAM = potto.compile("""
def below(c) integral ([0, 1], [0, 1]) [x^2 - c*x + y < 0.5]*(1 + x*y) d(x, y)
def along(a, c) integral [0, 1] [x^2 - a*c*x < 0.1]*2*x d(x)
""")
PLACES = np.linspace(-1, 1, 201)  # 0 is one of them


def _below(c: float) -> tuple[float, float]:
    height = Polynomial([0.5, c, -1.0])
    x = Polynomial([0.0, 1.0])
    end = min(1.0, (c + np.sqrt(c * c + 2)) / 2)
    value, slope = (height + x * height**2 / 2).integ()(end), (x + x**2 * height).integ()(end)
    return float(value), float(slope)


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_members_of_both_formulas_take_a_few_nodes_each(backend: str) -> None:
    """Bars hold, and are at most 1e-13; at c = 1/2 the root is the end of the range, and that one goes another way."""
    with potto.settings(backend=backend):
        found = potto.grad(PROGRAM.below)(PLACES)
    values, slopes = np.array([_below(c) for c in PLACES]).T
    assert found.converged and found.evals <= 16 * PLACES.size
    assert np.all(np.abs(found.value - values) <= found.error) and np.max(found.error) <= 1e-13
    inside = PLACES != 0.5
    assert np.all(np.abs(found.tangent - slopes)[inside] <= found.tangent_error[inside])
    assert np.max(found.tangent_error[inside]) <= 1e-13


@pytest.mark.parametrize("c", [-0.7, -1e-9, 0.0, 1e-9, 0.3, 0.7])
def test_one_by_itself_takes_the_rule_that_is_proved(c: float) -> None:
    found = potto.grad(PROGRAM.below)(c)
    value, slope = _below(c)
    assert found.evals <= 12 and abs(found.value - value) <= found.error <= 1e-13
    assert found["c"] == pytest.approx(slope, abs=found.tangent_error) and found.tangent_error <= 1e-13


def test_what_is_settled_on_one_side_is_not_taken_for_the_other() -> None:
    """The root's square, after calls that settle what is near: r = (b + sqrt(b^2 + 0.4))/2 with b = a c."""
    f = PROGRAM.along
    for a, c in [(1.0, 0.02)] * 4 + [(-1.0, 0.02), (1.0, -0.015), (1.0, 0.015), (-1.0, -0.015), (0.0, 0.3)]:
        b = a * c
        root = (b + np.sqrt(b * b + 0.4)) / 2
        found = potto.grad(f, ["a", "c"])(a, c)
        slope = 2 * root * root / np.sqrt(b * b + 0.4)
        assert abs(found.value - root**2) <= found.error <= 1e-13
        assert abs(f(a, c).value - root**2) <= 1e-13  # to rounding
        assert found.tangent == pytest.approx((slope * c, slope * a), abs=1e-13)  # to rounding
