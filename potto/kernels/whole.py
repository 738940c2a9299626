"""What an operation rounds off, where that is known better than as half a unit in the last place of its result.

Owns `ROUNDING`, for each such operation a function of its value and its arguments, `slopes`, which says the same of a
tangent, `FUNCTIONS`, all of them by name, and `looked_through`. What a sum
rounds off is known exactly, term by term (Knuth's TwoSum), whatever cancels on the way: nothing in 2e8 - (1e8 + 0.5), 1
in 1e16 + 1 - 1e16. Products, quotients and powers of whole numbers are exact where they are whole, so that 2*x is 6,
and not 6 give or take something, where x is 3; a batch is looked through for those only where that is asked for.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

UNIT_ROUNDOFF = 2.0**-53
# What numpy's pairwise sums round off, as a part of what is added up: at most 6.7 units for equal numbers, of which
# rounding goes one way, of 3,000 from 8 to 260,000.
PAIRWISE = 8 * UNIT_ROUNDOFF
TWICE = 2 * UNIT_ROUNDOFF  # a product and the sum that it goes into
LARGEST = 2.0**53  # up to here every whole number is a double
HIGHEST = 64.0  # powers that are worked out again
SHORT = 1024  # elements that are looked at one by one: what people read


class _Looking(threading.local):
    """The largest batches whose members are looked at one by one, in this thread."""

    most = 0.0


_looking = _Looking()


@contextmanager
def looked_through(most: float = math.inf) -> Iterator[None]:
    """Batches of up to so many members are as exact as single numbers in this block: where they are the steps of a loop
    or the elements of an array."""
    before, _looking.most = _looking.most, max(most, _looking.most)
    try:
        yield
    finally:
        _looking.most = before


def _rounded(value: Any, exact: Any) -> Any:
    return np.where(exact, 0.0, UNIT_ROUNDOFF * abs(value))


def _all_whole(*numbers: Any) -> Any:
    found = True
    for x in numbers:
        found = found & (x.is_integer() if isinstance(x, float) else np.rint(x) == x)
    return found


def _whole(*numbers: Any) -> bool:
    # Asked at every operation, and `all` of a generator takes twice as long.
    for x in numbers:  # noqa: SIM110
        if not isinstance(x, float) or not x.is_integer():
            return False
    return True


def add(value: Any, *args: Any) -> Any:
    """The sum of what each addition rounds off, from left to right.

    Of a batch the last one counts as half a unit in the last place, which takes two passes and not six: only what was
    lost on the way may be more than the value tells.
    """
    array = isinstance(value, np.ndarray)
    batch = array and value.size > _looking.most
    if batch and len(args) == 2:
        return UNIT_ROUNDOFF * abs(value)
    off = UNIT_ROUNDOFF * abs(value) if batch else 0.0
    total = args[0]
    for number, arg in enumerate(args[1:], 2):
        if number == len(args) and batch:
            break
        longer = value if number == len(args) else total + arg
        part = longer - total
        off = off + abs((total - (longer - part)) + (arg - part))
        total = longer
    if batch:
        known = np.add.reduce(off, None) < math.inf
        return off if known else np.where(np.isfinite(off), off, UNIT_ROUNDOFF * abs(value))
    if array:
        return np.where(off < math.inf, off, UNIT_ROUNDOFF * abs(value))
    return off if off < math.inf else UNIT_ROUNDOFF * abs(value)  # an infinite sum rounds off nan


def mul(value: Any, *args: Any) -> Any:
    if isinstance(value, np.ndarray):
        if value.size > _looking.most:
            return UNIT_ROUNDOFF * abs(value)
        return _rounded(value, _all_whole(*args) & (abs(value) <= LARGEST))
    exact = _whole(*args) and abs(value) <= LARGEST
    return 0.0 if exact else UNIT_ROUNDOFF * abs(value)


def div(value: Any, above: Any, below: Any) -> Any:
    if isinstance(value, np.ndarray):
        if value.size > _looking.most:
            return UNIT_ROUNDOFF * abs(value)
        kept = _all_whole(value, above, below) & (abs(above) <= LARGEST)
        return _rounded(value, kept & (value * below == above))
    exact = _whole(value, above, below) and abs(above) <= LARGEST and value * below == above
    return 0.0 if exact else UNIT_ROUNDOFF * abs(value)


def power(value: Any, base: Any, exponent: Any) -> Any:
    if isinstance(value, np.ndarray):
        if value.size > _looking.most:
            return UNIT_ROUNDOFF * abs(value)
        whole = _all_whole(value, base, exponent) & (abs(value) <= LARGEST) & (exponent >= 0)
        return _rounded(value, whole & (np.broadcast_to(exponent, np.shape(value)) <= HIGHEST))
    exact = _whole(value, base, exponent) and abs(value) <= LARGEST and 0 <= exponent <= HIGHEST
    if exact and int(base) ** int(exponent) == int(value):
        return 0.0
    return UNIT_ROUNDOFF * abs(value)


def slopes(tangent: Any, *factors: Any) -> Any:
    """What a tangent rounds off that is a sum of slopes times tangents, given one after the other, where the slopes are
    exact: nothing as long as all are whole, so that the slope of 2*x is 2, and not 2 give or take something. Summands
    may cancel."""
    if isinstance(tangent, np.ndarray) and tangent.size > _looking.most:
        return max(len(factors) // 2, 2) * UNIT_ROUNDOFF * _sizes(factors)
    pairs = list(zip(factors[::2], factors[1::2], strict=True))
    products = [a * b for a, b in pairs]
    off = sum(0.0 if _is_one(a) or _is_one(b) else mul(p, a, b) for p, (a, b) in zip(products, pairs, strict=True))
    return off if len(pairs) == 1 else off + add(tangent, *products)


def _sizes(factors: Sequence[Any]) -> Any:
    """The sum of the sizes of products, of slopes and tangents one after the other; the slopes of sums are 1."""
    total = None
    for at in range(0, len(factors), 2):
        a, b = factors[at], factors[at + 1]
        size = abs(b if a.__class__ is float and (a == 1.0 or a == -1.0) else a * b)
        total = size if total is None else total + size
    return total


def _is_one(x: Any) -> bool:
    return x.__class__ is float and abs(x) == 1


ROUNDING: dict[str, Callable[..., Any]] = {
    "add": add,
    "mul": mul,
    "div": div,
    "pow": power,
}

FUNCTIONS = {**ROUNDING, "slopes": slopes}
