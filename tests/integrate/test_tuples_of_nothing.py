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


@pytest.mark.xfail(
    strict=True, reason="between cuts that meet at one place, what is further in is looked at in the middle"
)
def test_what_a_stretch_of_length_zero_grows_to() -> None:
    """At t = 0 the sections t and t/2 of x meet; between them, however small t is, y runs from 0 to 1."""
    f = potto.compile("def f(t) integral ([-1, 1], [0, 1]) [x - t/(1 + y) > 0] d(x, y)").f
    found = potto.deriv(f)((0.0, 1.0))
    assert abs(found.tangent + math.log(2)) <= found.tangent_error
