r"""Derivatives as notebooks typeset them: integrals, deltas, Greek letters, and `dt` as `\partial t`."""

from __future__ import annotations

import re

import pytest

import potto
from potto.syntax.typesetting import latex as typeset

PROGRAM = potto.compile(r"""
def f(theta) integral [0, 1] [x < theta]*x d(x)
def bounded(t) integral [0, t] sin(x) d(x)
def plain(t) t^2/2
def both(t) f(t)^2 + t
df = deriv(f)
def steps(t) fold s = t for i in 1..3 (s*t)
""")
INTERIOR, BOUNDARY = r"}_{\text{interior}}", r"}_{\text{boundary}}"


@pytest.mark.parametrize(
    ("text", "latex"),
    [
        ("a*(b + c)/2", r"\frac{a \, \left(b + c\right)}{2}"),
        ("2*3*x", r"2 \cdot 3 \, x"),
        ("a - (b - c)", r"a - \left(b - c\right)"),
        ("(a/b)^2", r"\left(\frac{a}{b}\right)^{2}"),
        ("-2*x", r"-2 \, x"),
        ("θ + alpha_1*x2", r"\theta + \alpha_{1} \, x_{2}"),
        ("Omega*μ*pi", r"\Omega \, \mu \, \pi"),
        ("speed*dt^2", r"\mathrm{speed} \, \left(\partial t\right)^{2}"),
        ("[a <= x and x != b]", r"\left[a \le x \wedge x \ne b\right]"),
        ("abs(x) + sqrt(2*x)", r"\left|x\right| + \sqrt{2 \, x}"),
        ("exp(-x^2)*2.5e-3", r"\exp\left(-x^{2}\right) \cdot 2.5 \times 10^{-3}"),
        ("if x < 1 then a else b", r"\begin{cases} a & x < 1 \\ b & \text{else} \end{cases}"),
        ("sum i in 0..n-1 (w[i])", r"\sum_{i = 0}^{n - 1} w\left[i\right]"),
        ("delta(x - t)*dt", r"\delta\left(x - t\right) \, \partial t"),
        ("deriv(f)((t, dt))", r"\partial f\left(\left(t, \partial t\right)\right)"),
        (
            "integral ([0, 1], [x, inf]) y d(x, y)",
            r"\int_{x = 0}^{1} \int_{y = x}^{\infty} y\, \mathrm{d}x\, \mathrm{d}y",
        ),
        (
            "integral (x ~ normal(m, 1)) [x < t] d(x)",
            r"\int_{x \sim \mathrm{normal}\left(m, 1\right)} \left[x < t\right]\, \mathrm{d}x",
        ),
    ],
)
def test_expressions_look_as_mathematics_writes_them(text: str, latex: str) -> None:
    assert typeset(text, frozenset({"dt"})) == latex


def test_what_mathematics_cannot_write_is_not_typeset() -> None:
    assert typeset("fold s = 0 for i in 0..3 (s + i)") is None
    assert typeset("1 +") is None
    assert potto.deriv(PROGRAM.steps)._repr_latex_() is None


def test_a_derivative_is_an_integral_of_both_parts_and_integrated() -> None:
    r"""d/dθ of the integral of [x < θ] x: nothing inside, and θ where x reaches it."""
    text = potto.grad(PROGRAM.f)._repr_latex_()
    assert text == (
        r"$\begin{aligned}\partial f &= \int_{0}^{1} \underbrace{x \, \partial \theta \, \delta\left(\theta - x\right)"
        + BOUNDARY
        + r"\, \mathrm{d}x \\  &= \theta \, \partial \theta \, \left[0 < \theta < 1\right]"
        + r"\end{aligned}$"
    )
    assert potto.deriv(PROGRAM.f)._repr_latex_() == text
    assert PROGRAM.f._repr_latex_() is None  # a function that is no derivative


def test_moving_bounds_and_what_has_no_integral() -> None:
    assert r"\underbrace{\sin\left(t\right) \, \partial t}_{\text{moving bound}}" in str(
        potto.deriv(PROGRAM.bounded)._repr_latex_()
    )
    assert (
        potto.deriv(PROGRAM.plain)._repr_latex_()
        == r"$\begin{aligned}\partial \mathrm{plain} &= t \, \partial t\end{aligned}$"
    )


@pytest.mark.parametrize("name", ["f", "bounded", "plain", "both"])
def test_what_is_opened_is_closed(name: str) -> None:
    function = getattr(PROGRAM, name)
    for text in (potto.deriv(function)._repr_latex_(), potto.deriv(potto.deriv(function))._repr_latex_()):
        assert text is not None and text.count("{") == text.count("}")
        assert len(re.findall(r"\\left\b", text)) == len(re.findall(r"\\right\b", text))
