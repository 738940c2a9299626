"""What helps where an answer missed its tolerance: followed, it does."""

from __future__ import annotations

import re

import mpmath
import numpy as np
import pytest

import potto
from potto.projects.settings import respelled
from potto.runtime.answers.printing import attainable

# Programs that a small budget is too little for, and their values by mathematics.
HARD = {
    "integral [0, 1] sin(1/x) d(x)": lambda: mpmath.sin(1) - mpmath.ci(1),
    "integral [0, 1] abs(x - 1/3)^0.3*cos(300*x) d(x)": lambda: sum(
        mpmath.re(mpmath.quad(lambda x: abs(x - mpmath.mpf(1) / 3) ** mpmath.mpf("0.3") * mpmath.cos(300 * x), piece))
        for piece in ([k / mpmath.mpf(120) for k in range(41)], [k / mpmath.mpf(120) for k in range(40, 121)])
    ),
    "integral ([0, 1], [0, 1]) sqrt(abs(x - y)) d(x, y)": lambda: mpmath.mpf(8) / 15,
}


@pytest.mark.slow
@pytest.mark.parametrize("text", HARD)
@pytest.mark.parametrize("budget", [200, 2_000])
def test_the_accuracy_that_is_proposed_can_be_had(text: str, budget: int) -> None:
    module = potto.compile("")
    with potto.settings(max_evals=budget):
        answer = module.eval(text)
    if answer.converged:
        return
    assert str(answer).startswith("not converged: ")
    proposed = re.search(r"`potto.settings\(rtol=([\d.e-]+)\)`", answer.advice)
    if proposed is None:
        assert not answer.error <= 0.05 * abs(answer.value)  # there is nothing to propose
        return
    with potto.settings(max_evals=budget, rtol=float(proposed[1])):
        again = module.eval(text)
    assert again.converged and "not converged" not in repr(again)
    assert abs(again.value - float(HARD[text]())) <= float(proposed[1]) * abs(again.value)


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_samples_without_a_bound_are_sent_to_quadrature(method: str) -> None:
    module = potto.compile("")
    with potto.settings(method=method):
        answer = module.eval("integral [0, 1] x^(-0.9) d(x)")
    assert not answer.converged and '`potto.settings(method="quadrature")`' in answer.advice
    with potto.settings(method="quadrature"):
        again = module.eval("integral [0, 1] x^(-0.9) d(x)")
    assert again.converged and abs(again - 10) <= again.error + 1e-13  # 1/(1 - 0.9), to the rounding of 0.9


def test_what_is_proposed() -> None:
    assert attainable(2.0, 1e-5) == 3e-5  # five times 5e-6, rounded up
    assert attainable((2.0, 4.0), (1e-5, 1e-4)) == 2e-4 and attainable((2.0, 4.0), (0.0, 1e-4)) == 2e-4
    assert attainable(0.0, 1e-5) is None and attainable(1.0, 0.5) is None and attainable(1.0, float("nan")) is None
    assert attainable(2.0, 0.0) is None and attainable((2.0, 0.0), (1e-5, 1e-5)) is None


def test_an_infinite_derivative_has_converged_to_nothing() -> None:
    """sqrt rises infinitely at 0: asked for in whatever form, alone, beside other numbers or in a batch."""
    root = potto.compile("def f(x) sqrt(x)\n").f
    both = potto.compile("def f(x, y) (y^2, sqrt(x))\n").f
    at, dual = np.array([0.0, 4.0]), (np.array([0.0, 4.0]), 1.0)
    for one in (potto.grad(root)(0.0), potto.deriv(root)((0.0, 1.0)), potto.deriv(both)((0.0, 1.0), (1.0, 0.0))):
        assert not one.converged
        assert [why.message for why in one.shortfalls] == ["the derivative is infinite here"]
    for many in (potto.grad(root)(at), potto.deriv(root)(dual)):
        assert many.member_converged.tolist() == [False, True]
    assert potto.grad(root)(4.0).converged


def test_no_integral_is_to_blame_where_there_is_none() -> None:
    """The derivative of sqrt(k*x) by x at k = 0 is infinity times 0."""
    one = potto.grad(potto.compile("def f(k, x) sqrt(k*x)\n").f, "x")(0.0, 1.0)
    assert not one.converged and [why.message for why in one.shortfalls] == ["the value is not a number"]


def test_only_settings_are_spelled_as_another_face_has_them():
    advice = "sample more (`--samples`), integrate by `--method quadrature`, or leave out `--over c=0..1`"
    spelled = respelled(advice, lambda name, value: f"{name}={value}")
    assert spelled == "sample more (`samples=None`), integrate by `method=quadrature`, or leave out `--over c=0..1`"
