"""Integrals over ranges of length zero: the value is 0, and the derivative is what comes in at bounds that move.

Answers by hand: with F the integrand, d/db of the integral from l(b) to h(b) is F(h) h' - F(l) l'.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import potto

EXACT = 1e-13  # relative: Gauss rules over what is left of the variables, and the rounding of the bars themselves

E = math.e
SMOOTH = [  # the function, where, its derivative there
    ("def f(b) integral [0, b] exp(x) d(x)", 0.0, 1.0),
    ("def f(b) integral [b, 0] exp(x) d(x)", 0.0, -1.0),
    ("def f(b) integral [b, 1] exp(x) d(x)", 1.0, -E),
    ("def f(b) integral [1 - b, 1 + b] exp(x) d(x)", 0.0, 2 * E),
    ("def f(b) integral [2*b, b] exp(x) d(x)", 0.0, -1.0),
    ("def f(b) integral [b, b] exp(x) d(x)", 0.7, 0.0),
    ("def f(b) integral [sin(b), tan(3*b)] (2 + x) d(x)", 0.0, 4.0),
    ("def f(b) integral ([0, b], [0, 1]) exp(x*y) d(x, y)", 0.0, 1.0),
    ("def f(b) integral ([0, 1], [0, b]) exp(x*y) d(x, y)", 0.0, 1.0),
    ("def f(b) integral ([0, 1], [0, b*y]) exp(x*y) d(y, x)", 0.0, 0.5),
    ("def f(b) integral [0, 1] (integral [0, b*y] exp(x*y) d(x)) d(y)", 0.0, 0.5),
    ("def f(b) integral ([0, b], [0, b]) exp(x*y) d(x, y)", 0.0, 0.0),
    ("def f(b) integral ([0, b], [0, 1], [0, 1]) exp(x)*y*z d(x, y, z)", 0.0, 0.25),
    ("def f(b) sin(integral [0, b] exp(x) d(x))", 0.0, 1.0),
    ("def f(b) exp(3*integral [1, b] x d(x))", 1.0, 3.0),
    ("def inner(b) integral [0, b] exp(x) d(x)\ndef f(b) inner(2*b) + 1", 0.0, 2.0),
    ("def w(g, lo, hi) integral [lo, hi] g(x) d(x)\ndef f(b) w(\\x . exp(x), 0, b)", 0.0, 1.0),
    ("def f(b) integral [0, max(b, 0)^2 + b] exp(x) d(x)", 0.0, 1.0),
    # what jumps inside: a stretch on either side
    ("def f(b) integral [0, b] [x < b/2]*exp(x) d(x)", 0.0, 0.5),
    ("def f(b) integral [0, b] (if [x < b/2] then 1 else 3) d(x)", 0.0, 2.0),
    ("def f(b) integral [-b, b] (if [x < 0] then 1 else 3) d(x)", 0.0, 4.0),
    ("def f(b) integral [-b, 2*b] abs(sin(x) - 1) d(x)", 0.0, 3.0),
    ("def f(b) integral ([0, 1], [0, b]) [y < 1/4]*exp(x) d(y, x)", 0.0, 0.25),
    ("def f(b) integral ([0, b], [0, 1]) [y < 1/4]*exp(x) d(x, y)", 0.0, 0.25),
]


def rate(text: str, b: Any, by: Any = 1.0) -> Any:
    return potto.deriv(potto.compile(text).f)((b, by))


@pytest.mark.parametrize(("text", "b", "exact"), SMOOTH, ids=[row[0] for row in SMOOTH])
def test_a_bound_that_moves_brings_in_the_integrand(text: str, b: float, exact: float) -> None:
    answer = rate(text, b)
    assert abs(answer.tangent - exact) <= answer.tangent_error + 1e-15 <= EXACT * max(1.0, abs(exact)) + 1e-15
    assert answer.converged and not answer.notes
    assert rate(text, b, -2.0).tangent == pytest.approx(-2 * exact, rel=1e-14, abs=1e-15)


SIDED = [  # another derivative for parameters that shrink and for those that grow: backward, forward
    ("def f(b) integral [0, b] [x < 0]*exp(x) d(x)", 1.0, 0.0),
    ("def f(b) integral [0, b] [x < 2*b]*exp(x) d(x)", 0.0, 1.0),
    ("def f(b) integral [0, b] [x > b/3]*[x < 2*b/3]*exp(x) d(x)", 0.0, 1 / 3),
    ("def f(b) integral [-b, b] (if [x < b/2] then 1 else 3) d(x)", 5.0, 3.0),
]


@pytest.mark.parametrize(("text", "backward", "forward"), SIDED, ids=[row[0] for row in SIDED])
def test_two_sides_are_told(text: str, backward: float, forward: float) -> None:
    (note,) = rate(text, 0.0).notes
    assert float(note.backward) == pytest.approx(backward, rel=1e-13, abs=1e-15)
    assert float(note.forward) == pytest.approx(forward, rel=1e-13, abs=1e-15)


def test_members_of_an_array_are_each_their_own() -> None:
    for count in (5, 201):  # few and many go different ways
        b = np.linspace(-1.0, 1.0, count)
        answer = rate("def f(b) integral [0, b] exp(x) d(x)", b, np.ones(count))
        assert (np.abs(answer.tangent - np.exp(b)) <= answer.tangent_error + 1e-15).all()
        assert (answer.tangent_error <= (1e-11 if count < 10 else 1e-13)).all()  # few go as numbers do


def test_second_derivatives() -> None:
    """Of the integral of exp(2x) from 0 to b it is 2 exp(2b)."""
    module = potto.compile("def g(b) integral [0, b] exp(2*x) d(x)\ndef f(b) snd(deriv(g)((b, 1)))")
    answer = potto.deriv(module.f)((0.0, 1.0))
    assert answer.value == pytest.approx(1.0, rel=1e-14, abs=0)
    assert abs(answer.tangent - 2.0) <= answer.tangent_error + 1e-15 <= 1e-13


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_samples_of_nothing(method: str) -> None:
    with potto.settings(method=method, seed=3):
        answer = rate("def f(b) integral ([0, b], [0, 1]) exp(x*y) d(x, y)", 0.0)
    assert abs(answer.tangent - 1.0) <= answer.tangent_error + 1e-15 <= 1e-12  # F is 1 all along x = 0


def test_colours_keep_their_components() -> None:
    answer = rate("def f(b) integral [0, b] (exp(x), 2 + x) d(x)", 0.0)
    assert tuple(answer.value) == (0.0, 0.0)
    assert tuple(answer.tangent) == pytest.approx((1.0, 2.0), rel=1e-14, abs=0)


def test_a_pole_at_the_place() -> None:
    """2 sqrt(b) has an infinite derivative at 0; of b log(b) - b it is minus infinity."""
    for body, exact in (("1/sqrt(x)", math.inf), ("log(x)", -math.inf)):
        answer = rate(f"def f(b) integral [0, b] {body} d(x)", 0.0)
        assert answer.tangent == exact and not answer.converged


def test_bounds_that_differ_by_rounding_alone_are_not_taken_for_equal_in_silence() -> None:
    """0.1 + 0.2 and 0.3 are 5.6e-17 apart: the value is that times exp(0.3), or 0; the bar covers both."""
    answer = potto.compile("def f(a) integral [a + 0.2, 0.3] exp(x) d(x)").f(0.1)
    assert abs(answer.value - (0.3 - (0.1 + 0.2)) * math.exp(0.3)) <= answer.error
    assert answer.error <= 1e-15


def test_a_searched_surface_at_the_place() -> None:
    """2b < exp(x) + x - 1 is x > b, to first order: of [b, -b/2] that is all for b < 0 and nothing for b > 0."""
    answer = rate("def f(b) integral [b, -b/2] (if [2*b - exp(x) - x + 1 <= 0] then 2 else 3) d(x)", 0.0)
    (note,) = answer.notes
    assert (float(note.backward), float(note.forward)) == pytest.approx((-3.0, -4.5), rel=1e-14, abs=0)
    away = rate("def f(b) integral [b, -b/2] (if [2*b - exp(x) - x + 1.5 <= 0] then 2 else 3) d(x)", 0.0)
    assert not away.notes and abs(away.tangent + 4.5) <= away.tangent_error < 1e-14
