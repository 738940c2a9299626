"""What a sum rounds off is part of its error, also where terms cancel on the way; and nothing is where nothing is."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import potto

M = potto.compile("""
def lost(t) 1e16 + t - 1e16
def kept(t) 2e8 - t - 1e8
def three(a, b, c) a + b + c
def four(a, b, c, d) a - b + c - d
""")


def test_a_number_that_is_lost_between_large_ones() -> None:
    answer = M.lost(0.3)
    assert answer.value == 0.0 and answer.error == 0.3 and not answer.converged


def test_nearby_numbers_are_subtracted_exactly() -> None:
    answer = M.kept(1e8 + 0.25)
    assert answer.value == -0.25 and answer.error == 0.0


@pytest.mark.parametrize("t", [float("inf"), float("-inf")])
def test_infinite_sums_have_no_error_that_is_nan(t: float) -> None:
    answer = M.three(t, 1.0, 2.0)
    assert answer.value == t and not np.isnan(answer.error)


numbers = st.floats(-1e20, 1e20) | st.floats(-1.0, 1.0)


@settings(deadline=None, max_examples=200)
@given(st.lists(st.tuples(numbers, numbers, numbers, numbers), min_size=1, max_size=3))
def test_errors_cover(rows: list[tuple[float, float, float, float]]) -> None:
    batch = M.four(*(np.array(column) for column in zip(*rows, strict=True)))
    for i, (a, b, c, d) in enumerate(rows):
        exact = Fraction(a) - Fraction(b) + Fraction(c) - Fraction(d)
        alone = M.four(a, b, c, d)
        for value, error in ((alone.value, alone.error), (batch.value[i], batch.error[i])):
            assert abs(Fraction(float(value)) - exact) <= Fraction(float(error)) * (1 + Fraction(1, 2**40))


SUMS = potto.compile("""
def range(n, t) sum i in 0..n-1 (0.1*t)
def elements(xs: [n] Real, t) sum x in xs (x*t)
""")


@pytest.mark.parametrize("n", [10, 1000, 30_000, 600_000])
@pytest.mark.parametrize("t", [0.7, np.array([0.7, 0.2])], ids=["a number", "a batch"])
def test_sums_cover_what_they_round_off(n: int, t: object) -> None:
    """Equal summands: rounding goes the same way at each. The last sums come in chunks."""
    for answer in (potto.grad(SUMS.range, "t")(n, t), potto.grad(SUMS.elements, "t")(np.full(n, 0.1), t)):
        slope = n * Fraction(0.1)
        for value, error, at in zip(*map(np.ravel, (answer.value, answer.error, t)), strict=True):
            assert abs(Fraction(float(value)) - slope * Fraction(float(at))) <= Fraction(float(error)) < 1e-14 * slope
        for tangent, error in zip(*map(np.ravel, (answer.tangent, answer.tangent_error)), strict=True):
            assert abs(Fraction(float(tangent)) - slope) <= Fraction(float(error)) < 1e-14 * slope


def test_slopes_that_are_whole_numbers_are_exact() -> None:
    answer = potto.grad(potto.compile("def f(t) sum i in 1..100 (i*t)").f)(0.25)
    assert answer.tangent == 5050 and answer.tangent_error == 0.0


PICKED = potto.compile("""
def evenly(a: [50] Real, n) sum i in 0..n-1 (0.1*a[i - 50*floor(i/50)])
def mostly_the_last(a: [50] Real, n) sum i in 0..n-1 (0.1*a[min(i, 49)])
""")


@pytest.mark.parametrize("n", [5000, 500_000])
def test_gradients_cover_what_they_round_off(n: int) -> None:
    """By so many elements a gradient is swept back: what comes to an element from all who read it is added up."""
    for f, often in ((PICKED.evenly, [n // 50] * 50), (PICKED.mostly_the_last, [1] * 49 + [n - 49])):
        answer = potto.grad(f, "a")(np.full(50, 0.3), n)
        for slope, error, times in zip(*map(np.ravel, (answer.tangent, answer.tangent_error)), often, strict=True):
            exact = times * Fraction(0.1)
            assert abs(Fraction(float(slope)) - exact) <= Fraction(float(error)) < 1e-11 * exact
