"""What a mathematician would collect, take out or leave away in a shown formula, with the values of the derivative."""

from __future__ import annotations

import pytest
from formulas import Shown, near

COLLECTED = [
    # a factor of all summands, in a sum and in a sum that is a factor
    ("t*sin(c) + c*t^2*sin(c)", "(2*c*t + 1)*sin(c)*dt + t*(cos(c) + t*sin(c) + c*t*cos(c))*dc"),
    # a tangent, though what it is multiplied by has no common denominator without a root
    ("1.8*t*cos(3 - acos(t))", "1.8*(cos(3 - acos(t)) - t*sin(3 - acos(t))/sqrt(1 - t^2))*dt"),
    # brackets of what is otherwise alike
    ("integral [t, t + 1] [abs(x - t) < c/3] d(x)", "dt*([c > 3] - [c > 0]) + (dc/3 + dt)*[0 < c < 3]"),
    # sizes of products, and the larger of two
    ("integral [-c, t^2] abs(x - c) d(x)", "2*abs(c)"),
    ("integral [-c, t] max(x, c) d(x)", "(integral [-c, t] [x < c] d(x) + abs(c))*dc + max(t, c)*dt"),
    # what a condition says already
    (
        "integral [0, t] (2*c - x)*[(x - t)^2 < 0.04] d(x)",
        "(2*c - t + (t - 0.2 - 2*c)*[t > 0.2] + (t + 0.2 - 2*c)*[t < -0.2])*dt",
    ),
    ("integral [0, 3] [x^2 - 3*x + t < 0] d(x)", "if [0 < t < 9/4] then -2*dt/sqrt(9 - 4*t) else 0"),
    # squares
    ("integral [c/4, 1] x*[(x - t)^2 < 0.04] d(x)", "[(c/4 - t)^2 < 0.04]"),
    (
        "sum i in 0..2 (integral [0, 1] [x^2 < t*c/(i + 1)]*x d(x))",
        "(1/(i + 1)*[0 < c*t/(i + 1) < 1]))/2",
    ),
    # what does not depend on the variables before the integral
    ("integral ([0, 1], [0, 1]) cos(t)*[x + y < t] d(x, y)", "cos(t)*(integral [0, 1] [x < t < x + 1] d(x))"),
    # numbers that were halved often
    ("exp(c*(integral [c/4, 1] 0.5*x*t d(x)))", "/32"),
    # of which the larger one is known
    ("integral [0, 1] [cos(2*x + t) > c] d(x)", "sum k in ceil((t - acos(c))/(2*pi))..floor((t - acos(c) + 2)/(2*pi))"),
    ("integral [0, 1] [12*x < 5*t]*c d(x)", "5*c*dt/12*[0 < t < 12/5]"),
]


@pytest.mark.parametrize(("body", "read"), COLLECTED)
def test_what_is_alike_is_written_once(body: str, read: str) -> None:
    """To 1e-9, a digit above what integrals are asked for."""
    shown = Shown(f"def f(t, c) {body}\n", "f")
    assert read in shown.text.tangent
    assert shown.problems() == []
    module = shown.module()
    for t, c, dt, dc in ((0.37, 0.45, 0.3, 0.8), (0.82, 0.61, -0.4, 0.2)):
        along = module.eval(f"snd(deriv(f)(({t}, {dt}), ({c}, {dc})))").value
        assert near(module.eval(f"shown_1({t}, {c}, {dt}, {dc})").value, along, 1e-9)


def test_a_sum_is_not_divided_by_the_root_of_a_part() -> None:
    """Where t < 0, x^2 < t holds nowhere and nothing moves; the parts with 1/sqrt(t) count for nothing there. Where
    t > 0 the band from -sqrt(t) to t^2 moves by the bound and by the root."""
    shown = Shown("def f(t, c) integral [-c, t^2] [x^2 < t] d(x)\n", "f")
    assert shown.problems() == []
    module = shown.module()
    assert module.eval("shown_1(-0.5, 0.5, 1, 0)").value == 0
    assert module.eval("shown_1(0.25, 0.75, 1, 0)").value == pytest.approx(0.5 + 1, rel=1e-12, abs=1e-12)
