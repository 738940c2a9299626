"""Integrals of tuples that are 0: they are tuples all the same."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import potto

PROGRAM = """
def pair(q) integral [0, 1] (x*[x > q], [x > q]) d(x)
def second(q) snd(pair(q)) + 1
def chosen(q) integral ([0, 1], [0, 1]) (if [x + y > q] then (x, y, 1) else (0, 0, 0)) d(x, y)
def corner(a, b, t, q)
    integral ([a, a + 1/64], [b, b + 1/16]) (abs(y - t)*[y - q > 0], max(x, y)*[(x - t)*(y - 1/3) > 0]) d(x, y)
"""
MODULE = potto.compile(PROGRAM)


@pytest.mark.parametrize("backend", ["numpy", "auto"])
def test_as_many_numbers_as_elsewhere(backend: Any) -> None:
    with potto.settings(backend=backend):
        assert MODULE.pair(2.0).value == (0.0, 0.0)
        assert potto.deriv(MODULE.pair)((2.0, 1.0)).tangent == (0.0, 0.0)
        assert MODULE.second(2.0).value == 1.0
        assert MODULE.chosen(3.0).value == (0.0, 0.0, 0.0)
        for part in MODULE.chosen(np.linspace(2.5, 3.0, 100)).value:
            assert np.array_equal(part, np.zeros(100))


def test_a_surface_beside_a_bound_where_nothing_else_is() -> None:
    """y = 1/3 lies on a bound to rounding; for x < t the integrand is 0 on the side that counts."""
    found = potto.deriv(MODULE.corner)((0.125, 0.0), (1 / 3, 0.0), (0.3, 1.0), (0.5, 0.0))
    assert found.value == (0.0, 0.0) and found.tangent == (0.0, 0.0)


@pytest.mark.parametrize("order", ["([-1, 1], [0, 1]) {} d(x, y)", "([0, 1], [-1, 1]) {} d(y, x)"])
@pytest.mark.parametrize(
    ("integrand", "slope"),
    [
        ("[x - t/(1 + y) > 0]", -math.log(2)),
        ("[x - t/(1 + y) > 0]*(1 + x*y)", -math.log(2)),
        ("[x*(1 + y) > t*exp(y)]*(1 + y)", 1 - math.e),
        ("[x > t*sqrt(1 + y)]", -(2**1.5 - 1) / 1.5),
        ("[x*(1 + y*x) > t*(2 - y)]", -1.5),
    ],
)
def test_what_a_stretch_of_length_zero_grows_to(integrand: str, slope: float, order: str) -> None:
    """At t = 0 all sections along x lie at 0, and they move as y says: that is integrated, however plain the integrand
    may be."""
    f = potto.compile(f"def f(t) integral {order.format(integrand)}").f
    found = potto.deriv(f)((0.0, 1.0))
    assert abs(found.tangent - slope) <= found.tangent_error + 1e-15 and found.tangent_error < 1e-10


@pytest.mark.parametrize("order", ["([-1, 1], [0, 1]) {} d(x, y)", "([0, 1], [-1, 1]) {} d(y, x)"])
def test_where_a_surface_has_no_slope_all_along(order: str) -> None:
    """x^3 = t*(1 + y) moves infinitely fast at t = 0, x^2 = t^2*(1 + y) to either side, 4*(sqrt(8) - 1)/3 of it."""
    f = potto.compile(f"def f(t) integral {order.format('[x^3 > t*(1 + y)]')}").f
    found = potto.deriv(f)((0.0, 1.0))
    assert abs(found.value - 1) <= found.error < 1e-12 and found.tangent == -math.inf
    g = potto.compile(f"def g(t) integral {order.format('[x^2 > t^2*(1 + y)]')}").g
    (note,) = potto.deriv(g)((0.0, 1.0)).notes
    wide = 4 * (math.sqrt(8) - 1) / 3
    assert abs(note.backward - wide) <= note.backward_error + 1e-14
    assert abs(note.forward + wide) <= note.forward_error + 1e-14
