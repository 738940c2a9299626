"""Derivatives of functions that take a derivative themselves: of one argument, the others standing still."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import potto

PROGRAM = """
def cut(t, c) integral [0, 1] [x < t]*c*x d(x)
def total(ws: [n] Real, t) sum w in ws (integral [0, 1] [x < t*w]*x d(x))
def part(s, b) integral ([0, 1], [0, 1]) [s*exp(z)*exp(w) < b] d(z, w)

def by_number(t) snd(deriv(cut)((t, 1), 2))
def by_array(t) snd(deriv(total)([1, 0.5], (t, 1)))
def by_scale(s) snd(deriv(part)((s, 1), 3))
"""


@pytest.mark.parametrize(
    ("name", "place", "value", "slope"),
    [
        ("by_number", 0.3, 0.6, 2),  # c t^2/2: the argument that is a plain number has tangent 0
        ("by_array", 0.3, 0.375, 1.25),  # t^2/2 (1 + 1/4)
        # with u = 2 - log(3/s) the area is 1 - u^2/2; z only scales its own surface
        ("by_scale", 1.0, -0.9013877113318903, -0.0986122886681097),
    ],
)
def test_slope_of_a_slope(name: str, place: float, value: float, slope: float) -> None:
    found = potto.compile(PROGRAM).eval(f"deriv({name})(({place}, 1))")
    assert found.converged
    assert abs(float(found.value) - value) < 1e-13 and abs(float(found.tangent) - slope) < 1e-12


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_powers_of_a_negative_base_by_an_exponent_that_stands_still(backend: Any) -> None:
    """x^n with n a parameter is differentiable by x below 0 for whole n: by n, which stands still, it is not. Closed
    forms, to some roundings. What n - 1 rounds off is nothing there, and errors of such slopes were infinite."""
    m = potto.compile("def f(x, n) x^n\ndef g(x, n) n*x^(n - 1)\ndef h(x, n) integral [0, 1] (y*x)^(n - 1) d(y)")
    with potto.settings(backend=backend):
        second = potto.hessian(m.f, ["x"])(-2.0, 3.0)
        assert abs(second.value + 12) <= second.error <= 1e-14 and second.converged
        x, n = np.array([-2.0, -1.0, 2.0]), np.array([3.0, 4.0, 5.0])
        slope = potto.grad(m.g, ["x"])(x, n)
        assert np.all(np.abs(slope.tangent - n * (n - 1) * x ** (n - 2)) <= slope.tangent_error)
        assert (slope.tangent_error <= 2e-15 * np.abs(slope.tangent)).all() and slope.converged
        inside = potto.grad(m.h, ["x"])(-2.0, 3.0)
        assert abs(inside.tangent + 4 / 3) <= inside.tangent_error <= 1e-12
        mixed = potto.hessian(m.f, ["x", "n"])(-2.0, 3.0)
        assert abs(mixed.value[0, 0] + 12) <= 1e-14 and not mixed.converged and np.isnan(mixed.value[0, 1])
