"""What an operation rounds off at most, which is nothing where whole numbers give a whole number.

Owns `ROUNDING`: for each operation of which that can be told from single numbers a function of its value and its
arguments. So 2*x is 6, and not 6 give or take something, where x is 3. A batch is not looked through.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

UNIT_ROUNDOFF = 2.0**-53
LARGEST = 2.0**53  # up to here every whole number is a double
HIGHEST = 64.0  # powers that are worked out again


def _whole(*numbers: Any) -> bool:
    return all(isinstance(x, float) and x.is_integer() for x in numbers)


def add(value: Any, *args: Any) -> Any:
    exact = _whole(*args) and sum(map(abs, args)) <= LARGEST
    return 0.0 if exact else UNIT_ROUNDOFF * abs(value)


def mul(value: Any, *args: Any) -> Any:
    exact = _whole(*args) and abs(value) <= LARGEST
    return 0.0 if exact else UNIT_ROUNDOFF * abs(value)


def div(value: Any, above: Any, below: Any) -> Any:
    exact = _whole(value, above, below) and abs(above) <= LARGEST and value * below == above
    return 0.0 if exact else UNIT_ROUNDOFF * abs(value)


def power(value: Any, base: Any, exponent: Any) -> Any:
    exact = _whole(value, base, exponent) and abs(value) <= LARGEST and 0 <= exponent <= HIGHEST
    if exact and int(base) ** int(exponent) == int(value):
        return 0.0
    return UNIT_ROUNDOFF * abs(value)


ROUNDING: dict[str, Callable[..., Any]] = {
    "add": add,
    "mul": mul,
    "div": div,
    "pow": power,
}
# Their values are those of an argument, perhaps with the other sign.
SELECTING = frozenset({"neg", "abs", "min", "max", "clamp"})
