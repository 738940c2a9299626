"""`max_evals` limits every method, and the advice names the setting whose change helps: following it does."""

from __future__ import annotations

import math
from typing import Any

import pytest

import potto
from potto.integrate.adaptive.iterated import Iteration

WAVES = "integral [0, 1] sin(1e4*t*x) d(x)"
SURFACE = "integral ([0, 1], [0, 1]) [x*y < t]*exp(x + y) d(x, y)"
BALL = "integral ([0, 1], [0, 1], [0, 1]) [x*x + y*y + z*z < t] d(x, y, z)"
MANY = "integral ([0,1],[0,1],[0,1],[0,1],[0,1]) [x*y + y*z + z*u + u*v + v*x < t] d(x, y, z, u, v)"
RIDGE = "integral ([-1, 1], [-1, 1]) exp(-1000*(x^2 + y^2 - t)^2) d(x, y)"


@pytest.mark.parametrize("body", [WAVES, SURFACE, BALL, MANY, RIDGE])
@pytest.mark.parametrize("method", ["auto", "mc", "qmc"])
@pytest.mark.parametrize("most", [20_000, 100_000])
def test_evaluations_stay_within_their_limit(body: str, method: Any, most: int) -> None:
    """But for what a round of refinement takes that began within it: no more than that and a half again."""
    f = potto.compile(f"def f(t) {body}").f
    with potto.settings(method=method, max_evals=most, samples=10_000_000):
        for answer in (f(0.7), potto.deriv(f)((0.7, 1.0))):
            assert 0 < answer.evals <= 2.5 * most
            assert answer.converged or answer.reasons


@pytest.mark.parametrize("method", ["mc", "qmc"])
@pytest.mark.parametrize("body", [SURFACE, BALL, MANY])
def test_more_evaluations_help_where_they_are_what_is_missing(body: str, method: Any) -> None:
    f = potto.compile(f"def f(t) {body}").f
    with potto.settings(method=method, max_evals=4_000, samples=1_000_000, rtol=2e-3):
        short = f(0.7)
    assert not short.converged and "settings(max_evals=" in short.advice and "settings(samples=" not in short.advice
    with potto.settings(method=method, max_evals=1_000_000, samples=1_000_000, rtol=2e-3):
        longer = f(0.7)
    assert longer.evals > 20 * short.evals and longer.error < 0.5 * short.error


@pytest.mark.parametrize("method", ["mc", "qmc"])
@pytest.mark.parametrize("body", [SURFACE, BALL, MANY])
def test_more_samples_help_where_they_are_what_is_missing(body: str, method: Any) -> None:
    f = potto.compile(f"def f(t) {body}").f
    with potto.settings(method=method, samples=2_000, rtol=1e-9):
        short = f(0.7)
        more = f"{short.advice}"
    assert not short.converged and "settings(samples=" in more and "settings(max_evals=" not in more
    with potto.settings(method=method, samples=200_000, rtol=1e-9):
        longer = f(0.7)
    assert longer.evals > 20 * short.evals and longer.error < 0.5 * short.error
    with potto.settings(method=method, samples=2_000, rtol=1e-9, max_evals=1_000_000_000):
        # As the advice says: of no use here. Machine code may be there by now, and adds up in another order.
        assert f(0.7).error == pytest.approx(short.error, rel=1e-9)


def test_more_evaluations_help_quadrature() -> None:
    f = potto.compile(f"def f(t) {WAVES}").f
    exact = (1 - math.cos(1e4)) / 1e4
    with potto.settings(max_evals=2_000, rtol=1e-7):
        short = f(1.0)
    assert not short.converged and "settings(max_evals=" in short.advice
    with potto.settings(max_evals=2_000_000, rtol=1e-7):
        longer = f(1.0)
    assert longer.converged and abs(longer.value - exact) <= longer.error <= 1e-10


def test_sampling_that_is_chosen_says_what_it_lacks() -> None:
    """In many variables `auto` samples; what it lacks at first are samples, then evaluations."""
    f = potto.compile(f"def f(t) {MANY}").f
    with potto.settings(rtol=1e-5, samples=5_000):
        first = f(0.7)
    assert first.method == "qmc" and "settings(samples=" in first.advice
    with potto.settings(rtol=1e-5, samples=10_000_000, max_evals=100_000):
        second = f(0.7)
    assert "settings(max_evals=" in second.advice and "settings(samples=" not in second.advice
    with potto.settings(rtol=1e-5, samples=10_000_000, max_evals=1_500_000):
        third = f(0.7)
    assert first.error > 2 * second.error > 4 * third.error


def test_a_peak_that_the_budget_does_not_reach_has_no_bound() -> None:
    """0.25*pi*1e-6*(1 + erf...)... of it nothing is seen but that it is there: the error says that nothing is known."""
    f = potto.compile("def f(t) integral ([0, 1], [0, 1]) exp(-((x - 1/3)/t)^2 - ((y - 1/3)/t)^2) d(x, y)").f
    with potto.settings(max_evals=2_000):
        answer = f(1e-3)
    assert not answer.converged and abs(answer.value - math.pi * 1e-6) <= answer.error


def test_a_summand_takes_nothing_from_another() -> None:
    """2,000 evaluations each: a sum is as well known as its parts. Its value by mpmath, from the integral cosine and by
    60 panels: 1.78652083129009."""
    hard, easier = "t*(integral [0, 1] sin(1/(x + 1e-6)) d(x))", "(integral [0, 1] exp(sin(60*y + t)) d(y))"
    module = potto.compile(f"def hard(t) {hard}\ndef easier(t) {easier}\ndef both(t) {hard} + {easier}")
    with potto.settings(max_evals=2_000):
        first, second, both = module.hard(1.0), module.easier(1.0), module.both(1.0)
    assert not first.converged and second.converged
    assert abs(both.value - 1.78652083129009) <= both.error <= 1.01 * (first.error + second.error)


def test_places_beside_a_fold_are_not_looked_at_once_far_more_than_the_budget_is_spent() -> None:
    """A circle that touches the bound z = 1 at t = 1: six looks beside t took 16 million evaluations of 200,000. By
    mpmath, from the integral over the circle, and over what is within it."""
    condition = "y^2 - z^2 <= 0.4*y or y^2 + z^2 >= t or x - y < t"
    f = potto.compile(
        "def f(t) integral [-inf, inf] (integral [-1, 2] (integral (z ~ triangular(-1, 0, 1))"
        f" (if [{condition}] then exp(-x^2) else 0) d(z)) d(y)) d(x)"
    ).f
    with potto.settings(max_evals=200_000):
        slope = potto.deriv(f)((1.0, 1.0))
    assert slope.evals <= 5 * 200_000 and not slope.converged
    assert abs(slope.tangent - 0.14774903088707887) <= slope.tangent_error < 1e-3


def test_an_end_with_a_value_of_its_own_is_not_looked_for_everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """atan2(y - t, z) > 1/4 holds nowhere but at y = t, where it does for z < 0: value and derivative are 0. The nodes
    of variables further out, which count as no evaluations, were 5.8 million."""
    nodes = []
    run = Iteration.run
    monkeypatch.setattr(Iteration, "run", lambda self, number, env, batch, *more: (
        nodes.append(batch) or run(self, number, env, batch, *more)))  # fmt: skip
    inner = "integral [0, t] (integral [-1, 1] (if [atan2(y - t, z) > 0.25] then x else 0) d(z)) d(y)"
    f = potto.compile(f"def f(t) integral [0, 1] ({inner}) d(x)").f
    slope = potto.deriv(f)((2.0, 1.0))
    assert (slope.value, slope.tangent, slope.converged) == (0.0, 0.0, True)
    assert sum(nodes) < 200_000
