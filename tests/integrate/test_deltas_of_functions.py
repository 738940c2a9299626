"""Functions that give deltas, called under the integral that they have a meaning under.

Each integral is t^2 at t = 1/2 with derivative 2t, times what the case says.
"""

from __future__ import annotations

import pytest

import potto

PROGRAM = """
def peak(t, x) delta(x - t)
def twice(t)(x) 2*peak(t, x)
def near(t) \\x . peak(t, x)
def over(p) integral [0, 1] p(x)*x^2 d(x)
def own(t) integral [0, 1] delta(x - t)*x d(x)
"""


@pytest.mark.parametrize(
    ("body", "factor"),
    [
        ("integral [0, 1] peak(t, x)*x^2 d(x)", 1),
        ("integral [0, 1] twice(t)(x)*x^2 d(x)", 2),
        ("integral [0, 1] (let q = near(t) in q(x))*x^2 d(x)", 1),
        ("over(\\x . peak(t, x))", 1),
        ("over(near(t))", 1),
        ("integral [0, 1] own(t)*2*y*t d(y)", 1),  # a number by then
    ],
)
def test_a_delta_that_a_function_gives(body: str, factor: float) -> None:
    found = potto.compile(PROGRAM + f"def f(t) {body}\n").eval("deriv(f)((0.5, 1))")
    assert found.value == pytest.approx(factor * 0.25, rel=1e-12, abs=0)
    assert found.tangent == pytest.approx(factor, rel=1e-9, abs=0)
