"""Whole numbers stay whole through names and calls, and say so: their error is 0. What is rounded has one."""

from __future__ import annotations

from fractions import Fraction

import pytest

import potto

NAMES = """
x = 3
y = 2*x
z = y/x
big = 2^53
half = 0.5
tenth = 0.1
def poly(a) a^3 - 7*a + (a + 1)^2
"""


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("x", 3), ("y", 6), ("z", 2), ("x^2 - y", 3), ("-y + z", -4), ("poly(x)", 22), ("max(y, abs(-x), z)", 6),
        ("clamp(y, 0, x)", 3), ("2^x", 8), ("big - 1", 2**53 - 1),
    ],
)  # fmt: skip
def test_nothing_is_rounded(expression: str, expected: int) -> None:
    got = potto.compile(NAMES).eval(expression)
    assert got.value == expected and got.error == 0


@pytest.mark.parametrize(
    ("expression", "exact"),
    [
        ("y/7", Fraction(6, 7)),
        ("tenth*x", 3 * Fraction(0.1)),
        ("tenth + half", Fraction(0.1) + Fraction(1, 2)),
        ("big + x", 2**53 + 3),
        ("big*x + x", 3 * 2**53 + 3),
        ("tenth^x", Fraction(0.1) ** 3),
        ("(half + tenth)*10", (Fraction(1, 2) + Fraction(0.1)) * 10),  # it comes out whole by rounding
    ],
)
def test_what_is_rounded_has_an_error_that_covers_it(expression: str, exact: Fraction) -> None:
    got = potto.compile(NAMES).eval(expression)
    assert got.error > 0 and abs(Fraction(got.value) - exact) <= Fraction(got.error)
