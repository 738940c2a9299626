"""Conditions on products: (x - t)*(y - s) >= 0 jumps at x = t too, where the condition does not vary along y."""

from __future__ import annotations

import pytest

import potto

PROGRAM = """
def spelled(t, s) integral ([0, 1], [0, 1]) (x + y)*[(x - t)*(y - s) >= 0] d(x, y)
def turned(t, s) integral ([0, 1], [0, 1]) (x + y)*[(t - x)*(y - s) <= 0] d(x, y)
def quotient(t, s) integral ([0, 1], [0, 1]) (x + y)*[(x - t)/(2*y - 2*s) >= 0] d(x, y)
def scaled(t, s) integral ([0, 1], [0, 1]) (x + y)*[-3*exp(x)*(x - t)*(s - y) >= 0] d(x, y)
def inside(x, y, t, s) [(x - t)*(y - s) >= 0]
def called(t, s) integral ([0, 1], [0, 1]) (x + y)*inside (x, y, t, s) d(x, y)
def swapped(t, s) integral ([0, 1], [0, 1]) (x + y)*inside (x, y, t, s) d(y, x)
def cube(t, s) integral ([0, 1], [0, 1], [0, 1]) 2*z*(x + y)*[(x - t)*(y - s)*(z + 1) >= 0] d(x, y, z)
"""
NAMES = ["spelled", "turned", "quotient", "scaled", "called", "swapped", "cube"]


def area(a: float, b: float, c: float, d: float) -> float:
    """The integral of x + y over [a, b] x [c, d]."""
    return (b * b - a * a) / 2 * (d - c) + (d * d - c * c) / 2 * (b - a)


def strip(t: float, c: float, d: float) -> float:
    """The integral of t + y over [c, d]."""
    return t * (d - c) + (d * d - c * c) / 2


@pytest.mark.parametrize(("t", "s"), [(0.3, 0.6), (0.5, 0.5), (0.7, 1.5), (-0.25, 0.125)])
@pytest.mark.parametrize("name", NAMES)
def test_both_factors_have_their_boundary_terms(name: str, t: float, s: float) -> None:
    f = potto.grad(getattr(potto.compile(PROGRAM), name), wrt=["t", "s"])
    got = f(t, s)
    a, b = min(max(t, 0.0), 1.0), min(max(s, 0.0), 1.0)
    value = area(a, 1, b, 1) + area(0, a, 0, b)
    by_t = strip(t, 0, b) - strip(t, b, 1) if 0 < t < 1 else 0.0
    by_s = strip(s, 0, a) - strip(s, a, 1) if 0 < s < 1 else 0.0
    # Polynomials on rectangles: exact but for rounding.
    assert abs(got.value - value) <= 1e-14
    assert abs(got["t"] - by_t) <= 1e-14 and abs(got["s"] - by_s) <= 1e-14
    assert got.converged and got.evals <= 5000  # nothing is refined
