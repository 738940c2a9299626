"""Derivatives that stand in textbooks, written as there; each has the values of the derivative, by numbers.

To 1e-9: both sides are quadrature to the default tolerance of 1e-10 or closed forms.
"""

from __future__ import annotations

import random

import pytest
from formulas import Shown, near

TEXTBOOK = {
    "softmax": (
        "exp(a)/(exp(a) + exp(b))",
        "exp(a)*(exp(b)*da - exp(b)*db)/(exp(a) + exp(b))^2",
    ),
    "quotient": ("a/(1 + a^2)", "(1 - a^2)*da/(a^2 + 1)^2"),
    "inverse of a matrix": ("a/(a*b - 2)", "-(2*da + a^2*db)/(a*b - 2)^2"),
    "kernel of heat": (
        "exp(-b^2/(4*a))/sqrt(4*pi*a)",
        "exp(-b^2/(4*a))*((b^2 - 2*a)*da - 2*a*b*db)/(4*a^2*sqrt(4*pi*a))",
    ),
    "potential": ("1/sqrt(a^2 + b^2)", "-(a*da + b*db)/(a^2 + b^2)^(3/2)"),
    "cube": ("a^3 - 3*a^2*b + 3*a*b^2 - b^3", "3*(a - b)^2*(da - db)"),
    "arccosine": ("integral [0, pi] [cos(x) < a] d(x)", "if [-1 < a < 1] then da/sqrt(1 - a^2) else 0"),
    "area of a disc beside the origin": (
        "integral ([-3, 3], [-3, 3]) [(x - a)^2 + y^2 < b^2] d(x, y)",
        "2*(integral [-3, 3] ((x - a)*da + b*db)/sqrt(b^2 - (x - a)^2)*[(x - a)^2 <= b^2 < (x - a)^2 + 9] d(x))",
    ),
    "Reynolds": (
        "integral [0, 1] [b*x < a] d(x)",
        "(b*da - a*db)/(b*abs(b))*[a/b < 1 and a*b > 0]",
    ),
    "a bound between two": (
        "integral [0, 1] [b*x < a - 1/2] d(x)",
        "(b*da - (a - 1/2)*db)/(b*abs(b))*[0 < (a - 1/2)/b < 1]",
    ),
    "factors in one order": ("integral [0, 1] [x < b*a] d(x)", "(b*da + a*db)*[0 < a*b < 1]"),
    "a bound on either side": ("integral [0, b] [x < a]*x d(x)", "b*db*[b < a] + a*da*([0 < a < b] - [b < a < 0])"),
    "a threshold": ("integral [0, 1] [1/4 <= a*x^2] d(x)", "if [a > 1/4] then da/(4*a*sqrt(a)) else 0"),
    "a fall": ("integral [0, 1] [3*x^2 < a] d(x)", "if [0 < a < 3] then da/(2*sqrt(3*a)) else 0"),
    "a cube root": ("integral [0, 1] [x^3 < a] d(x)", "if [0 < a < 1] then da/(3*a^(2/3)) else 0"),
    "a product of sums": (
        "(a + b)*(1 - a)*(b + 1)",
        "(b + 1)*(1 - 2*a - b)*da + (1 - a)*(2*b + a + 1)*db",
    ),
    "a number's root leads": ("1/(sqrt(2)*(a + b) + 2)", "-sqrt(2)*(da + db)/(sqrt(2)*(a + b) + 2)^2"),
    "reach of an arm": (
        "integral [0, pi] [b*cos(x/2) < a] d(x)",
        "if [-1 <= a/b < 1 and 2*acos(a/b) < pi] then 2*(b*da - a*db)/(b*sqrt(b^2 - a^2)) else 0",
    ),
    "a mean": (
        "integral [-inf, inf] x^2*exp(-(x - a)^2/2)/sqrt(2*pi) d(x)",
        "da/sqrt(2*pi)*(integral [-inf, inf] x^2*(x - a)*exp(-(x - a)^2/2) d(x))",
    ),
    "a coin": ("integral (k ~ bernoulli(a)) exp(b*k) d(k)", "exp(b)*(da + a*db) - da"),
}


@pytest.mark.parametrize(("body", "formula"), TEXTBOOK.values(), ids=TEXTBOOK)
def test_textbook(body: str, formula: str) -> None:
    shown = Shown(f"def f(a, b) {body}\n", "f")
    assert shown.text.tangent == formula
    assert shown.problems() == []
    given, module = shown.given(random.Random(body)), shown.module()
    assert near(module.eval(shown.formula(given)).value, module.eval(shown.derivative(given)).value)


def test_a_surface_has_no_rubbish_of_rounding() -> None:
    ((item,),) = [Shown("def f(t) integral [0, 1] [x < 0.1*t + 0.2*t] d(x)\n", "f").text.integrals]
    assert [surface.equation for surface in item.surfaces] == ["x = 0.3*t"]


def test_small_numbers_are_written_as_people_do() -> None:
    assert Shown("def f(t) t/(t^2 + 1e-8)\n", "f").text.tangent == "(1e-8 - t^2)*dt/(t^2 + 1e-8)^2"


def test_the_norm_of_an_array_has_no_number_that_cancels() -> None:
    shown = Shown("def f(x: [n] Real) sqrt(sum i in 0..n-1 (x[i]^2))\n", "f")
    assert shown.text.tangent == "(sum i in 0..len(x) - 1 (x[i]*dx[i]))/sqrt(sum i in 0..len(x) - 1 (x[i]^2))"
