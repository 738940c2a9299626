"""Digits that an error estimate supports."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from potto.runtime.printing import format_error, format_number, holds, written_tolerance


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.5, 1e-15, "0.5"),
        (1 / 3, 0.0, "0.3333333333333333"),
        (0.49987, 2e-3, "0.50"),  # +-0.002 leaves the second decimal certain to half a unit
        (0.0886123456789, 1.2e-14, "0.0886123456789"),
        (3.0, 0.0, "3"),
        (0.1 + 0.2, 5.6e-17, "0.3"),  # the last digits of the double are rounding
        (math.sqrt(2), 2.3e-16, "1.414213562373095"),
        (-0.0, 0.0, "0"),
        (0.0, 1e-17, "0"),
        (1e-17, 1e-15, "0"),
        (1e20, 0.0, "1e20"),
        (123456.0, 50.0, "1.235e5"),
        (1.23456e-7, 1e-10, "1.23e-7"),
        (math.inf, 0.0, "inf"),
        (-math.inf, math.nan, "-inf"),
        (math.nan, 0.0, "nan"),
        (0.5, math.inf, "0.5 (error unknown)"),
    ],
)
def test_digits(value: float, error: float, text: str) -> None:
    assert format_number(value, error) == text


@given(st.floats(-1e12, 1e12), st.floats(1e-18, 1e3))
def test_what_is_printed_lies_within_the_error_and_half_a_unit(value: float, error: float) -> None:
    text = format_number(value, error)
    # the last digit was chosen such that 2 * error <= unit < 20 * error: rounding moves by at most half a unit
    assert abs(float(text) - value) <= 10 * error * (1 + 1e-6) + 1e-15 * abs(value)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_an_exact_number_reads_back_as_itself(value: float) -> None:
    assert float(format_number(value)) == value


@pytest.mark.parametrize(
    ("text", "tolerance"),
    [("0.333", 5e-4), ("1", 0.0), ("1.0", 0.05), ("1.5e-3", 5e-5), (".5", 0.05), ("-0.25", 5e-3), ("pi/2", 0.0)],
)
def test_what_written_digits_allow(text: str, tolerance: float) -> None:
    assert math.isclose(written_tolerance(text), tolerance)


def test_holding() -> None:
    assert holds(1 / 3, 0.0, 0.333, 5e-4)
    assert not holds(1 / 3, 0.0, 0.334, 5e-4)
    assert holds(0.7, 0.01, 0.705)
    assert not holds(0.7, 0.0, 1.0)
    assert holds(math.nan, 0.0, math.nan) and not holds(math.nan, 0.0, 0.0) and not holds(0.0, 0.0, math.nan)
    assert holds(math.inf, 0.0, math.inf) and not holds(math.inf, 0.0, 1e308)
    assert holds(1e-300, 0.0, 0.0)  # below what an evaluation around 1 can tell from zero


def test_error_estimates_are_shown_to_two_digits() -> None:
    assert format_error(1.234e-13) == "1.2e-13"
    assert format_error(0.0) == "0"
    assert format_error(3e5) == "3.0e5"
