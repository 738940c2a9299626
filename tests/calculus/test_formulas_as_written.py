"""Formulas in the words of their program: its names, the order of its conditions, and its way with numbers; what is the
same in them is one."""

from __future__ import annotations

import pytest
from formulas import Shown

from potto.checking.facts import derivative_facts
from potto.checking.library import Library

COLLECTED = [
    ("integral [0, 1] exp(-t*x) d(x) + integral [0, 1] exp(-t*y) d(y)", "-2*dt*(integral [0, 1] x*exp(-t*x) d(x))"),
    (
        "1/2*integral [0, 1] x*exp(-t*x) d(x) + integral [0, 1] x^2*exp(-t*x) d(x)"
        " - integral [0, 1] exp(-t*y)*y^2 d(y)",
        "-dt/2*(integral [0, 1] x^2*exp(-t*x) d(x))",
    ),
    ("(integral [0, 1] exp(-t*x) d(x))/(integral [0, 1] exp(-t*y) d(y))", "0"),
    (  # the mean of x under the density exp(-t*x) falls by its variance
        "(integral [0, 1] x*exp(-t*x) d(x))/(integral [0, 1] exp(-t*x) d(x))",
        "((integral [0, 1] x*exp(-t*x) d(x))^2"
        " - (integral [0, 1] x^2*exp(-t*x) d(x))*(integral [0, 1] exp(-t*x) d(x)))"
        "*dt/(integral [0, 1] exp(-t*x) d(x))^2",
    ),
    # a variable that an inner integral has as well, or a parameter has, is told apart
    (
        "integral [0, 1] (integral [0, x] exp(-t*x*y) d(y))^2 d(x)",
        "-2*dt*(integral [0, 1] x*(integral [0, x] exp(-t*x*y) d(y))*(integral [0, x] y*exp(-t*x*y) d(y)) d(x))",
    ),
]


@pytest.mark.parametrize(("body", "read"), COLLECTED)
def test_the_same_integral_is_one(body: str, read: str) -> None:
    shown = Shown(f"def f(t) {body}\n", "f")
    assert shown.text.tangent == read
    assert shown.problems() == []
    along = shown.module().eval("snd(deriv(f)((0.7, 0.3)))").value
    assert shown.module().eval("shown_1(0.7, 0.3)").value == pytest.approx(along, rel=1e-9, abs=1e-12)


def test_conditions_have_the_order_of_the_program_behind_those_of_the_domain() -> None:
    shown = Shown("def f(a, b, t) integral ([0, 1], [0, 1]) [x < t]*[a < y]*[y < b] d(x, y)\n", "f").text
    (item,) = shown.integrals
    assert item.deltas == (
        "dt*[a < y < b]*delta(t - x)",
        "-da*[x < t and y < b]*delta(y - a)",
        "db*[x < t and a < y]*delta(b - y)",
    )
    assert shown.tangent == (
        "dt*(integral [0, 1] [0 < t < 1 and a < y < b] d(y))"
        " - da*(integral [0, 1] [0 < a < 1 and x < t and a < b] d(x))"
        " + db*(integral [0, 1] [0 < b < 1 and x < t and a < b] d(x))"
    )


NUMBERS = [
    ("integral [-1/2, 1/2] [x < t]*(x + 1/2) d(x)", "(t + 1/2)*dt*[-1/2 < t < 1/2]"),
    ("integral [-0.5, 0.5] [x < t]*(x + 0.5) d(x)", "(t + 0.5)*dt*[-0.5 < t < 0.5]"),
    ("integral [0, 1] [2*x < t]*x d(x)", "t*dt/4*[0 < t < 2]"),
    ("integral [0, 1] [x/2 < t] d(x)", "2*dt*[0 < t < 1/2]"),  # of whole numbers alone
    ("integral [0, 1] [0.1*x < t] d(x)", "10*dt*[0 < t < 0.1]"),
    ("integral [0, 1/3] [x < t] d(x)", "dt*[0 < t < 1/3]"),
    ("integral [0, 1/10] [x < t] d(x)", "dt*[0 < t < 1/10]"),
    ("integral [-1/3, 1/3] [x < t] d(x)", "dt*[-1/3 < t < 1/3]"),
    ("integral [0, 1] [x < (1/2)^t]*(3/4)^x d(x)", "(3/4)^(1/2)^t*(1/2)^t*log(1/2)*dt*[(1/2)^t < 1]"),
]


@pytest.mark.parametrize(("body", "read"), NUMBERS)
def test_numbers_are_fractions_unless_the_program_has_decimals(body: str, read: str) -> None:
    program = f"def f(t) {body}\n"
    shown = Shown(program, "f")
    assert read in shown.text.tangent
    library = Library()
    facts = derivative_facts(library.db, library.put("<text>", program), "f")
    assert facts is not None and facts.derivative == shown.text.tangent
    assert shown.problems() == []
    along = shown.module().eval("snd(deriv(f)((0.08, 0.3)))").value
    assert shown.module().eval("shown_1(0.08, 0.3)").value == pytest.approx(along, rel=1e-9)
