"""Numbers as text, to the digits that their error estimates support.

Owns the choice of digits for every face, and the comparison of a value with digits that somebody wrote (`#= 0.333`).
Knows nothing of terms, estimates or terminals, and does without numpy: arrays are told by their `ndim`.

Beside its error a value has the error's second digit, and the error is rounded up by what the value lost when it was
rounded: so the interval that one reads contains the interval that was computed. Alone it has the last digit that the
error leaves certain to one unit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from msgspec import Struct

from potto.runtime.answers.named import Named

ROUNDING = 8 * 2.0**-52  # a few rounding errors: what remains of an error estimate of zero
MISSED = "not converged: "  # stands in front of an answer that missed its tolerance
# The roughest accuracy that is proposed, and how much worse it is than what was reached: asked for less, integration
# takes another way to it, which may reach less.
MOST_ASKED, SPARE = 0.05, 5.0
MOST_ITEMS = 12  # of an array that are shown
DOUBLE = 18  # significant digits: one more than tell all doubles apart, so that rounding to them loses nothing
SMALLEST = -5  # the power of ten from which on numbers are written without an exponent
SMALLEST_ERROR = -4  # the same of errors
# Of a unit of the last digit: 0.027 is not a double, and the one nearest to it is not to cost a unit of the error.
BLUR = Fraction(1, 2**40)


# One number


def format_number(value: float, error: float = 0.0) -> str:
    """`value` alone, to the last digit that `error` leaves certain.

    With what rounding takes off, the error is at most one unit of the last digit shown. Zeros at the end are kept while
    they say something (a value known to three digits reads `0.500`) and dropped when the value is known to nearly all
    digits of a double.
    """
    if not math.isfinite(value):
        return not_finite(value)
    if not math.isfinite(error):
        return f"{format_digits(value, 3)} (error unknown)"
    if error == 0 or error < abs(value) * 2.0**-54:
        return _shorten(repr(float(value)))
    bound = _decimal(abs(error))
    place = _exponent(bound)
    while bound + abs(_decimal(value) - _rounded(value, place) * _power(place)) > _power(place):
        place += 1
    count = _rounded(value, place)
    if count == 0:
        return "0" if place <= -9 else _positional(0, min(place, 0))
    if len(str(abs(count))) < 9:
        return _written(count, place)
    return _shorten(_written(count, place))


def format_digits(value: float, digits: int = 6) -> str:
    """`value` to so many significant digits: for labels and progress, where no error is known."""
    if not math.isfinite(value):
        return not_finite(value)
    return _shorten(f"{value:.{digits}g}")


def format_error(error: float) -> str:
    """An error estimate to two digits, rounded up."""
    if error == 0 or not math.isfinite(error):
        return _shorten(repr(float(error)))
    place = _exponent(_decimal(abs(error))) - 1
    count = math.ceil(_decimal(abs(error)) / _power(place) - BLUR)
    if count == 100:
        count, place = 10, place + 1
    return f"{'-' if error < 0 else ''}{_scientific(count, place, place + 1)}"


def format_concise(value: float, error: float) -> str:
    """`0.0270(51)`: the error in units of the last digit."""
    found = _interval(value, error)
    return format_number(value, error) if found is None else found.concise


class _Interval(Struct, frozen=True):
    """count * 10^place, off by at most error * 10^place; the error has at most two digits."""

    count: int
    error: int
    place: int

    @property
    def scale(self) -> int:
        """The power of ten of the first digit of value or error."""
        return len(str(max(abs(self.count), self.error))) - 1 + self.place

    @property
    def plain(self) -> bool:
        """Whether it is written without an exponent."""
        return self.place <= 0 and self.scale >= SMALLEST

    @property
    def value(self) -> str:
        return _positional(self.count, self.place) if self.plain else _scientific(self.count, self.place, self.scale)

    @property
    def bound(self) -> str:
        scale = len(str(self.error)) - 1 + self.place
        plain = self.plain and scale >= SMALLEST_ERROR
        return _positional(self.error, self.place) if plain else _scientific(self.error, self.place, scale)

    @property
    def concise(self) -> str:
        mantissa, mark, exponent = self.value.partition("e")
        return f"{mantissa}({self.error}){mark}{exponent}"


def _interval(value: float, error: float) -> _Interval | None:
    """The digits of a value beside its error; None where one is not finite or the error is zero."""
    if not (math.isfinite(value) and math.isfinite(error)) or error == 0:
        return None
    exact, bound = Fraction(value), _decimal(abs(error))
    place = _exponent(bound) - 1
    if value:
        place = max(place, _exponent(abs(exact)) - DOUBLE + 1)
    while True:
        unit = _power(place)
        count = _rounded(value, place)
        total = max(math.ceil(bound / unit + abs(count - exact / unit) - BLUR), 1)
        if total < 100:
            return _Interval(count, total, place)
        place += 1


def _decimal(value: float) -> Fraction:
    """The shortest decimal that stands for a double."""
    return Fraction(repr(float(value)))


def _rounded(value: float, place: int) -> int:
    """A value in units of 10^place. Its shortest decimal is rounded, so that 0.3 has zeros behind the three."""
    return round(_decimal(value) / _power(place))


def _power(place: int) -> Fraction:
    return Fraction(10) ** place


def _exponent(value: Fraction) -> int:
    """The power of ten of the first digit of a positive number."""
    guess = len(str(value.numerator)) - len(str(value.denominator))
    return guess if value >= _power(guess) else guess - 1


def _written(count: int, place: int) -> str:
    """count * 10^place with all the digits of the count; not zero."""
    scale = len(str(abs(count))) - 1 + place
    return _positional(count, place) if place <= 0 and scale >= SMALLEST else _scientific(count, place, scale)


def _positional(count: int, place: int) -> str:
    """`0.0270`; place is at most 0."""
    sign, digits = "-" if count < 0 else "", str(abs(count)).rjust(1 - place, "0")
    return f"{sign}{digits}" if place == 0 else f"{sign}{digits[:place]}.{digits[place:]}"


def _scientific(count: int, place: int, scale: int) -> str:
    """`2.70e-7`: with the exponent `scale`, which is at least that of the first digit."""
    return f"{_positional(count, place - scale)}{f'e{scale}' if scale else ''}"


def not_finite(value: float) -> str:
    """An infinity, or what is not a number, as a program writes it."""
    return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")


def _shorten(text: str) -> str:
    """Without zeros that end a fraction, without `+` and leading zeros in an exponent, without the sign of zero."""
    mantissa, _, exponent = text.partition("e")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    if mantissa in ("-0", "0"):
        return "0"
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def format_seconds(time: float) -> str:
    """A time as people read it."""
    return f"{time:.2f} s" if time >= 1 else f"{time * 1e3:.0f} ms" if time >= 0.01 else f"{time * 1e3:.1f} ms"


def format_count(number: int, thing: str) -> str:
    """`1 evaluation`, `1,234 evaluations`."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def computed_by(stats: Mapping[str, Any]) -> str:
    """What came up with the numbers of an evaluation."""
    points = stats.get("points by machine code", 0)
    return f"{format_count(points, 'point')} by machine code, the rest by numpy" if points else "by numpy"


def format_range(low: float, high: float, digits: int = 6) -> str:
    """`0 to 0.25`: what numbers go from and to."""
    return f"{format_digits(low, digits)} to {format_digits(high, digits)}"


# Tuples, lists and arrays of them, with errors of the same form


def format_numbers(value: Any, error: Any) -> str:
    """A number, or a tuple, list or array of them, to the digits that the errors support."""
    return _joined(value, error, format_number)


def concisely(value: Any, error: Any) -> str:
    """The same, each with its error behind it: `(0.0270(51), 1)`."""
    return _joined(value, error, format_concise)


def _joined(value: Any, error: Any, form: Callable[[float, float], str]) -> str:
    if isinstance(value, tuple | list):
        shown = value[:MOST_ITEMS] if isinstance(value, list) else value
        parts = [_joined(v, e, form) for v, e in zip(shown, error, strict=False)]
        return together(value, parts) if isinstance(value, tuple) else format_list(parts, len(value))
    if isinstance(value, dict):
        return format_fields({name: _joined(item, error[name], form) for name, item in value.items()})
    if value is None:
        return "<function>"
    if getattr(value, "ndim", 0):
        return _rows(value, error, form)
    return form(float(value), float(error))


def together(whole: tuple[Any, ...], parts: Sequence[str]) -> str:
    """A tuple or a record of its parts as texts."""
    return whole.written(parts) if isinstance(whole, Named) else format_tuple(parts)


def _rows(value: Any, error: Any, form: Callable[[float, float], str]) -> str:
    """An array in as many brackets as it has axes: the first rows, as many as have few enough numbers together."""
    if not getattr(value, "ndim", 0):
        return form(float(value), float(error))
    shown = min(len(value), max(1, MOST_ITEMS // max(1, math.prod(value.shape[1:]))))
    parts = [_rows(value[i], error[i] if getattr(error, "ndim", 0) else error, form) for i in range(shown)]
    return f"[{', '.join(parts)}{', ...' if len(value) > shown else ''}]"


def _first(value: Any, error: Any) -> list[tuple[float, float]]:
    """The items of an array that are shown, each with its error."""
    flat = value.ravel()[:MOST_ITEMS].tolist()
    if not getattr(error, "ndim", 0):
        return [(v, float(error)) for v in flat]
    return list(zip(flat, error.ravel()[:MOST_ITEMS].tolist(), strict=True))


def with_error(value: Any, error: Any) -> str:
    """`0.300 ± 0.012`, `(0.300, 1) ± (0.012, 0)`; without the error where it is zero or not known."""
    if not 0 < largest(error) < math.inf or (isinstance(value, int | float) and not math.isfinite(value)):
        if isinstance(value, tuple) and any(0 < largest(e) < math.inf for e in error):
            return together(value, [with_error(v, e) for v, e in zip(value, error, strict=True)])
        return format_numbers(value, error)
    return " ± ".join(format_bars(value, error))


def format_bars(value: Any, error: Any) -> tuple[str, str]:
    """The two sides of the `±`."""
    return _joined(value, error, lambda v, e: _bar(v, e)[0]), _bars(value, error)


def _bars(value: Any, error: Any) -> str:
    if isinstance(value, tuple | list):
        if isinstance(value, list) and len(value) > MOST_ITEMS:
            return f"at most {format_error(largest(error))}"
        return format_tuple([_bars(v, e) for v, e in zip(value, error, strict=True)])
    if isinstance(value, dict):
        return format_fields({name: _bars(item, error[name]) for name, item in value.items()})
    if getattr(value, "ndim", 0):
        bars = [_bar(v, e)[1] for v, e in _first(value, error)]
        return f"at most {max([*bars, format_error(largest(error))], key=float)}"
    return _bar(float(value), float(error))[1]


def _bar(value: float, error: float) -> tuple[str, str]:
    found = _interval(value, error)
    if found is None:
        return format_number(value, error), format_error(error)
    return found.value, found.bound


def led(text: str, converged: bool) -> str:
    """An answer as text; one that missed its tolerance says so first, what is not a number that it is none."""
    return text if converged else MISSED + text if text != "nan" else "nan (not converged)"


def format_bounds(error: Any) -> str:
    """Error estimates to two digits, in the form of the value."""
    if isinstance(error, tuple | list):
        return format_tuple([format_bounds(item) for item in error])
    if isinstance(error, dict):
        return format_fields({name: format_bounds(item) for name, item in error.items()})
    if getattr(error, "ndim", 0):
        return f"at most {format_error(largest(error))}"
    return format_error(float(error))


def largest(error: Any) -> float:
    """The largest of the errors of a value."""
    if getattr(error, "ndim", 0):
        return float(error.max(initial=0.0))
    if isinstance(error, tuple | list):
        return max((largest(item) for item in error), default=0.0)
    if isinstance(error, dict):
        return largest(tuple(error.values()))
    return float(error) if error is not None and error == error else math.inf


def attainable(value: Any, error: Any) -> float | None:
    """The relative accuracy, rounded up to a digit, that all numbers of an answer have with something to spare; None
    where that is none to speak of."""
    worst = _relative(value, error)
    if not 0 < worst <= MOST_ASKED:  # nan as well
        return None
    place = _exponent(_decimal(SPARE * worst))
    return float(math.ceil(_decimal(SPARE * worst) / _power(place)) * _power(place))


def _relative(value: Any, error: Any) -> float:
    """The largest error of the numbers of an answer beside their size; infinite where that is not known."""
    if isinstance(value, dict):
        return _relative(list(value.values()), [error[name] for name in value])
    if isinstance(value, tuple | list):
        each = [_relative(v, e) for v, e in zip(value, error, strict=True)]
    elif hasattr(value, "ravel"):
        each = [_relative(v, e) for v, e in zip(value.ravel().tolist(), error.ravel().tolist(), strict=True)]
    else:
        return 0.0 if error == 0 else float(error) / abs(value) if value else math.inf
    return math.inf if any(part != part for part in each) else max(each, default=0.0)


def format_list(parts: Sequence[str], size: int) -> str:
    """`[a, b]`, and how many more there are."""
    more = size - len(parts)
    return f"[{', '.join([*parts, *([f'… {more} more'] if more else [])])}]"


def format_tuple(parts: Sequence[str]) -> str:
    """`(a, b)`."""
    return f"({', '.join(parts)})"


def format_fields(parts: dict[str, str]) -> str:
    """`(a=1, b=2)`."""
    return format_tuple([f"{name}={text}" for name, text in parts.items()])


# Digits that somebody wrote


def written_tolerance(text: str) -> float:
    """How far a value may be from the number that `text` writes: half a unit of its last digit.

    A whole number without a decimal point is exact, and so is anything that is not a number but an expression.
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
