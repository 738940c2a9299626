"""Digits that an error estimate supports."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import potto
from potto.runtime.answers.printing import (
    MISSED,
    concisely,
    format_bounds,
    format_digits,
    format_error,
    format_number,
    format_numbers,
    holds,
    with_error,
    written_tolerance,
)
from potto.runtime.answers.shown import format_answer, interval


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.5, 1e-15, "0.5"),
        (1 / 3, 0.0, "0.3333333333333333"),
        (0.49987, 2e-3, "0.50"),  # +-0.002 leaves the second decimal certain to half a unit
        (0.0886123456789, 1.2e-14, "0.0886123456789"),
        (0.754, 5.5e-3, "0.75"),  # 0.004 are lost in rounding: with the error less than a unit
        (0.756, 7e-3, "0.8"),  # 0.76 may be off by 0.011
        (0.027, 5.1e-3, "0.03"),
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
    assert format_error(1.234e-13) == "1.3e-13"  # rounded up: the interval must not shrink
    assert format_error(1.2e-13) == "1.2e-13"
    assert format_error(9.91e-5) == "1.0e-4"
    assert format_error(0.0) == "0"
    assert format_error(3e5) == "3.0e5"
    assert format_error(5.1) == "5.1" and format_error(math.inf) == "inf" and format_error(math.nan) == "nan"


# A value beside its error


@pytest.mark.parametrize(
    ("value", "error", "bar", "concise"),
    [
        (0.027, 0.0051, "0.0270 ± 0.0051", "0.0270(51)"),
        (-0.027, 0.0051, "-0.0270 ± 0.0051", "-0.0270(51)"),
        (0.0273, 0.0051, "0.0273 ± 0.0051", "0.0273(51)"),
        (0.02734, 0.0051, "0.0273 ± 0.0052", "0.0273(52)"),  # 0.00004 were lost in rounding the value
        (9.996, 0.0996, "10.00 ± 0.11", "10.00(11)"),  # 0.0996 + 0.004 needs three digits: one place further
        (1.99, 7.6, "2.0 ± 7.7", "2.0(77)"),
        (76.6, 76.6, "77 ± 77", "77(77)"),
        (0.3, 51.0, "0 ± 52", "0(52)"),
        (218.0, 1122.0, "0.2e3 ± 1.2e3", "0.2(12)e3"),
        (123456.0, 50.0, "123456 ± 50", "123456(50)"),
        (0.0, 1e-17, "0.0e-17 ± 1.0e-17", "0.0(10)e-17"),
        (0.3, 4e-16, "0.30000000000000000 ± 4.2e-16", "0.30000000000000000(42)"),  # the double is 1.1e-17 below 0.3
        (1.0, 1e-300, "1.00000000000000000 ± 1e-17", "1.00000000000000000(1)"),
        (1e300, 3.1e290, "1.00000000000e300 ± 3.2e290", None),
        (1e-300, 3.05e-305, "1.000000e-300 ± 3.1e-305", None),
        (5e-324, 5e-324, "5.0e-324 ± 5.1e-324", None),
        (1 / 3, 0.0, "0.3333333333333333", "0.3333333333333333"),
        (0.5, math.inf, "0.5 (error unknown)", "0.5 (error unknown)"),
        (0.5, math.nan, "0.5 (error unknown)", "0.5 (error unknown)"),
        (math.inf, 0.0, "inf", "inf"),
        (-math.inf, 1.0, "-inf", "-inf"),
        (math.nan, 1.0, "nan", "nan"),
    ],
)
def test_a_value_beside_its_error(value: float, error: float, bar: str, concise: str | None) -> None:
    assert with_error(value, error) == bar
    assert concise is None or concisely(value, error) == concise


DOUBLES = st.floats(allow_nan=False, allow_infinity=False)
ERRORS = st.floats(0, exclude_min=True, allow_infinity=False)
NEAR = st.tuples(st.floats(1e-9, 1e9), st.floats(1e-17, 10)).map(lambda pair: (pair[0], pair[0] * pair[1]))
PAIRS = st.tuples(DOUBLES, ERRORS) | NEAR | NEAR.map(lambda pair: (-pair[0], pair[1]))


def read(text: str) -> tuple[Decimal, Decimal]:
    """Value and error as a person reads them, in either form."""
    if "±" in text:
        value, error = text.split(" ± ")
        return Decimal(value), Decimal(error)
    mantissa, error, exponent = re.fullmatch(r"(-?[\d.]+)\((\d+)\)(e-?\d+)?", text).groups()  # type: ignore[union-attr]
    value = Decimal(mantissa + (exponent or ""))
    return value, Decimal(error).scaleb(value.as_tuple().exponent)  # type: ignore[arg-type]


@given(PAIRS)
def test_the_interval_that_one_reads_contains_the_one_computed(pair: tuple[float, float]) -> None:
    value, error = pair
    for text in (with_error(value, error), concisely(value, error)):
        shown, bar = map(Fraction, read(text))
        bar *= 1 + Fraction(1, 10**11)  # few decimals are doubles: what that comes to is below the last digit shown
        assert shown - bar <= Fraction(value) - Fraction(error)
        assert shown + bar >= Fraction(value) + Fraction(error)


@given(PAIRS)
def test_errors_have_at_most_two_digits_and_values_no_fewer_places(pair: tuple[float, float]) -> None:
    value, bar = read(with_error(*pair))
    digits = str(bar.as_tuple().digits and int("".join(map(str, bar.as_tuple().digits))))
    assert len(digits) <= 2
    assert value.as_tuple().exponent <= bar.as_tuple().exponent  # type: ignore[operator]
    assert read(concisely(*pair)) == (value, bar)  # both forms say the same


@given(PAIRS)
def test_bars_are_not_much_larger_than_the_error(pair: tuple[float, float]) -> None:
    value, error = pair
    _, bar = read(with_error(value, error))
    # rounding up adds less than a unit, rounding of the value half of one, and a unit is a tenth of the error at most;
    # of errors below the last digits of a double those digits are left, which are half a unit in the last place off
    assert Fraction(bar) <= (Fraction(error) + Fraction(abs(value)) * Fraction(2) ** -53) * Fraction(13, 10)


@given(DOUBLES, st.floats(0, 2.0**-60))
def test_a_value_known_to_its_last_bit_reads_back_as_itself(value: float, share: float) -> None:
    shown = with_error(value, abs(value) * share).partition(" ± ")[0]
    assert float(shown) == value


@given(PAIRS)
def test_alone_the_last_digit_is_off_by_one_at_most(pair: tuple[float, float]) -> None:
    value, error = pair
    # the last digit shown is 10^p at most, where 2 * error <= 10^p; zeros behind it may have been dropped
    unit = Fraction(10) ** next(p for p in range(-330, 330) if 2 * Decimal(repr(error)) <= Decimal(10) ** p)
    assert abs(Fraction(format_number(value, error)) - Fraction(value)) + Fraction(error) <= unit + Fraction(
        math.ulp(value)
    )


# Tuples, lists, arrays, duals


def test_every_number_of_a_tuple_has_its_own_digits() -> None:
    assert with_error((0.5, 0.25), (1e-5, 0.0)) == "(0.500000, 0.25) ± (1.0e-5, 0)"
    assert with_error((0.5, (0.25, 2.0)), (1e-2, (0.0, 0.3))) == "(0.500, (0.25, 2.00)) ± (0.010, (0, 0.30))"
    assert with_error((0.5, 0.25), (1e-5, math.inf)) == "(0.500000 ± 1.0e-5, 0.25 (error unknown))"
    assert with_error((0.5, 2.0), (0.0, 0.0)) == "(0.5, 2)"
    assert with_error([0.5, 2.0], [1e-3, 1e-2]) == "[0.5000, 2.000] ± (0.0010, 0.010)"
    assert concisely((0.5, [1.0, 2.0]), (1e-3, [0.0, 0.1])) == "(0.5000(10), [1, 2.00(10)])"
    assert format_bounds((0.011, (0.0, 0.3))) == "(1.1e-2, (0, 3.0e-1))"


def test_one_bar_serves_a_whole_array() -> None:
    values, errors = np.array([0.5, 0.27182]), np.array([1e-3, 5e-4])
    text, _, bar = with_error(values, errors).partition(" ± at most ")
    assert text == "[0.5000, 0.27182]" and float(bar) >= 1e-3
    assert with_error(values, np.zeros(2)) == "[0.5, 0.27182]"
    assert format_numbers(np.linspace(0, 1, 20), 0.0).endswith(", ...]")
    assert concisely(values, 1e-3) == "[0.5000(10), 0.2718(11)]"


def test_labels_have_the_digits_that_were_asked_for() -> None:
    assert [format_digits(x) for x in (0.1 + 0.2, 1e6, 1234567.0, -0.0, 1e-7, math.inf, -math.inf, math.nan)] == [
        "0.3", "1e6", "1.23457e6", "0", "1e-7", "inf", "-inf", "nan",
    ]  # fmt: skip
    assert format_digits(1 / 3, 4) == "0.3333"


# Answers


PROGRAM = "def f(t, w) integral [0, 1] [x < t]*w*x d(x)\n"


def test_an_estimate_is_one_line_in_python() -> None:
    f = potto.compile(PROGRAM).f
    line = repr(f(0.3, 1.0))
    assert re.fullmatch(r"0\.0450+\(\d\d?\)  [\d,]+ evaluations  [\d.]+ m?s", line), line
    assert abs(read(line.split("  ")[0])[0] - Decimal("0.045")) <= read(line.split("  ")[0])[1]
    assert re.fullmatch(r"\(0\.045.*, 0\.30.*\)  .* evaluations  .*", repr(potto.deriv(f)((0.3, 1), (1.0, 0))))
    assert re.fullmatch(r"\[0\(?.*, 0\.125.*\]  .*", repr(f(np.array([0.0, 0.5]), 1.0)))
    assert repr(potto.grad(f, ["t", "w"])(t=0.3, w=1.0)).startswith("(0.045")


def test_what_missed_its_tolerance_says_so_on_the_same_line() -> None:
    good = potto.Estimate(0.027, 0.0051)
    bad = potto.Estimate(0.027, 0.0051, converged=False)
    dual = potto.Estimate(0.5, 0.0, 0.027, 0.0051, converged=False)
    assert format_answer(good) == "0.03" and interval(good) == "0.0270 ± 0.0051"
    assert format_answer(bad) == interval(bad) == f"{MISSED}0.0270 ± 0.0051"
    assert format_answer(dual) == f"{MISSED}(0.5, 0.0270) ± (0, 0.0051)"
    assert repr(bad).startswith(f"{MISSED}0.0270(51)  ") and MISSED not in repr(good)
    unknown = potto.Estimate(0.5, math.inf, converged=False)
    assert format_answer(unknown) == f"{MISSED}0.5 (error unknown)"


@pytest.mark.parametrize("method", ["quadrature", "mc", "qmc"])
def test_as_many_printed_intervals_hold_as_computed_ones(method: str) -> None:
    """integral of [x < t]*x^2*3 over [0, 1] is t^3: printing loses no interval that held."""
    f = potto.compile("def f(t) integral [0, 1] [x < t]*3*x^2 d(x)\n").f
    computed = printed = 0
    for seed in range(60):
        t = 0.2 + seed / 100
        with potto.settings(method=method, samples=300, seed=seed, max_evals=2000):
            r = f(t)
        truth = Fraction(t) ** 3
        computed += abs(Fraction(r.value) - truth) <= Fraction(r.error)
        value, bar = (Fraction(part) for part in read(interval(r).removeprefix(MISSED)))
        printed += abs(value - truth) <= bar
    assert printed >= computed


def test_a_summary_shows_every_field_and_note() -> None:
    answer = potto.deriv(potto.compile("def f(t) integral [0, 1] [x < t] d(x)").f)((0.0, 1.0))
    lines = answer.summary().split("\n")
    assert lines[:2] == ["value: 0.0", "error: 0.0"] and "converged: True" in lines
    assert lines[-1].startswith("note: the surface") and "0 backward, 1 forward" in lines[-1]


# Ten thousand numbers


def test_thousands_of_printed_intervals_contain_their_values() -> None:
    """Values and errors of all sizes and of any ratio: what a person reads contains the value and the whole interval
    around it, in every form in which a number is printed."""
    random = np.random.default_rng(17)
    values = random.choice([-1.0, 1.0], 3_000) * 10 ** random.uniform(-25, 25, 3_000)
    values[::7] = np.round(random.uniform(-1000, 1000, len(values[::7])), 2)
    values[::50] = 0.0
    errors = np.where(values == 0, 1.0, np.abs(values)) * 10 ** random.uniform(-17, 1.5, 3_000)
    for value, error in zip(values.tolist(), errors.tolist(), strict=True):
        exact, off = Fraction(value), Fraction(error)
        low, high = exact - off, exact + off
        estimate = potto.Estimate(value, error)
        for text in (interval(estimate), str(estimate), repr(estimate).split("  ")[0], f"{estimate}"):
            middle, bar = (Fraction(part) for part in read(text))
            slack = max(abs(low), abs(high)) / 10**15 if text == interval(estimate) else 0
            assert middle - bar <= exact <= middle + bar, (value, error, text)
            wider = bar + slack + bar / 10**10
            assert middle - wider <= low and high <= middle + wider, text
        alone = Fraction(format_number(value, error))
        assert abs(alone - exact) <= 10 * off + abs(exact) / 10**15, (value, error)


@pytest.mark.parametrize(
    ("written", "total"),
    [
        ("[i^2 for i in 0..99]", 328350),
        ("2*[1, 2, 3]", 12),
        ("sum i in 1..99 (3*i)", 14850),
        ("sum k in [1, 5] (k*k)", 26),
    ],
)
def test_whole_numbers_in_arrays_are_exact(written: str, total: int) -> None:
    answer = potto.compile(f"f = {written}").f
    assert not np.any(answer.error) and np.sum(answer.value) == total


def test_what_is_rounded_in_sums_is_told() -> None:
    many = potto.compile("f = sum i in 1..7 (2^51*i + i)\ng = sum i in 1..3 (i/10)")
    for answer, exact in ((many.f, 28 * Fraction(2**51 + 1)), (many.g, Fraction(6, 10))):
        assert 0 < abs(Fraction(float(answer.value)) - exact) <= Fraction(float(answer.error))
