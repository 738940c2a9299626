"""Derivatives of functions that take a derivative themselves: of one argument, the others standing still."""

from __future__ import annotations

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
