"""Conditions that read arrays: under their own names, and decided by several plain conditions at once."""

from __future__ import annotations

import math

import pytest

import potto

PROGRAM = """
waves = [(1, 0.5), (2, 0.25)]
def field(x) sum w in waves (w.y*exp(w.x*x))
def above(t) integral [0, 1] [field(x) > t] d(x)

points = [(0.2, 0.5), (0.6, 0.5), (0.9, 0.5), (0.75, 0.9), (0.5, 0.1)]
def nearer(x, p: (Real, Real), q: (Real, Real)) [(x - p.x)^2 + (0.5 - p.y)^2 < (x - q.x)^2 + (0.5 - q.y)^2]
def cell(i) integral [0, 1] product j in 0..4 (if j == i then 1 else nearer(x, points[i], points[j])) d(x)
"""


def test_a_sum_over_an_array_that_has_a_definition() -> None:
    """With u = e^x the field is u/2 + u^2/4, which is t at u = sqrt(1 + 4 t) - 1."""
    found = potto.compile(PROGRAM).eval("deriv(above)((1.5, 1))")
    root = 7**0.5 - 1
    assert found.converged
    assert abs(found.value - (1 - math.log(root))) < 1e-9
    assert abs(found.tangent + 2 / (7**0.5 * root)) < 1e-9


@pytest.mark.parametrize(("own", "size"), [(0, 0.4), (1, 0.35), (2, 0.25), (3, 0.0)])
def test_what_five_plain_conditions_decide(own: int, size: float) -> None:
    """On the line y = 1/2 borders are half way between those on it; the other two are too far away."""
    assert abs(float(potto.compile(PROGRAM).cell(own)) - size) < 1e-12
