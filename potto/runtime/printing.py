"""Numbers as text, to the digits that their error estimates support.

Owns the choice of digits, and the comparison of a value with digits that somebody wrote (`#= 0.333`).
Knows nothing of terms or terminals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

ROUNDING = 8 * 2.0**-52  # a few rounding errors: what remains of an error estimate of zero


def format_number(value: float, error: float = 0.0) -> str:
    """`value` to the last digit that `error` leaves certain.

    The error is at most half a unit of the last digit shown. Zeros at the end are kept while they say something (a
    value known to three digits reads `0.500`) and dropped when the value is known to nearly all digits of a double.
    """
    if math.isnan(value) or math.isinf(value):
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    if math.isnan(error) or math.isinf(error):
        return f"{_shorten(f'{value:.3g}')} (error unknown)"
    if error == 0 or error < abs(value) * 2.0**-54:
        return _shorten(repr(value))
    place = math.ceil(math.log10(2 * error) - 1e-9)  # the power of ten of the last digit
    return _rounded(value, place)


def _rounded(value: float, place: int) -> str:
    if value == 0:
        return "0" if place <= -9 else _plain(0.0, place)
    size = math.floor(math.log10(abs(value)))
    digits = size - place + 1  # significant ones
    if digits >= 17:
        return _shorten(repr(value))
    if digits == 0 and abs(value) >= 0.5 * 10.0**place:  # rounds up to one unit of the last digit
        unit = math.copysign(10.0**place, value)
        return _exponent(f"{unit:.0e}", False) if place > 0 or place < -5 else f"{unit:.{-place}f}"
    if digits <= 0:
        return "0" if place <= -9 else _plain(0.0, place)
    if place > 0 or size < -5:
        return _exponent(f"{value:.{digits - 1}e}", digits >= 9)
    text = f"{value:.{-place}f}"
    return _shorten(text) if digits >= 9 else text


def _plain(value: float, place: int) -> str:
    return f"{value:.{max(-place, 0)}f}"


def _exponent(text: str, shorten: bool) -> str:
    mantissa, exponent = text.split("e")
    return f"{_shorten(mantissa) if shorten else mantissa}e{int(exponent)}"


def _shorten(text: str) -> str:
    """Without zeros that end a fraction, without `+` and leading zeros in an exponent, without the sign of zero."""
    mantissa, _, exponent = text.partition("e")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    if mantissa in ("-0", "0"):
        return "0"
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def format_error(error: float) -> str:
    """An error estimate to two digits."""
    if error == 0 or math.isnan(error) or math.isinf(error):
        return format_number(error)
    return f"{error:.1e}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


def format_tuple(parts: Sequence[str]) -> str:
    """`(a, b)`."""
    return f"({', '.join(parts)})"


def written_tolerance(text: str) -> float:
    """How far a value may be from the number that `text` writes: half a unit of its last digit.

    A whole number without a decimal point is exact, and so is anything that is no number but an expression.
    """
    mantissa, _, exponent = text.strip().lstrip("+-").lower().partition("e")
    whole, point, fraction = mantissa.partition(".")
    if not point or not (whole + fraction).isdigit():
        return 0.0
    try:
        return 0.5 * 10.0 ** (int(exponent or 0) - len(fraction))
    except (ValueError, OverflowError):
        return 0.0


def holds(value: float, error: float, expected: float, tolerance: float = 0.0) -> bool:
    """Whether a value with an error estimate is the expected one, given the digits in which that was written."""
    if math.isnan(expected) or math.isnan(value):
        return math.isnan(expected) and math.isnan(value)
    if math.isinf(expected) or math.isinf(value):
        return value == expected
    slack = 0.0 if math.isnan(error) or math.isinf(error) else error
    return abs(value - expected) <= slack + tolerance + ROUNDING * max(abs(expected), abs(value), 2.0**-40)
