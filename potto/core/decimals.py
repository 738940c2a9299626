"""Elementary functions of decimal numbers, to 50 digits, without any library for numbers.

The entries of builtins name those that they are; the others are worked out by their formulas.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import Context, Decimal, localcontext

DIGITS = 50
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211706798")
_LARGE = Decimal(10) ** 6


class Undefined(Exception):
    """A function has no value at a point, or none that can be worked out."""


def _series(first: Decimal, ratio: Callable[[int], Decimal]) -> Decimal:
    """first * (1 + r(1) + r(1) r(2) + ...), until the terms no longer count."""
    result, term, k = first, first, 0
    while abs(term) > abs(result) * Decimal(10) ** -(DIGITS + 5) and k < 10_000:
        k += 1
        term *= ratio(k)
        result += term
    return result


def sin(x: Decimal) -> Decimal:
    if abs(x) > _LARGE:
        raise Undefined
    x -= 2 * PI * (x / (2 * PI)).to_integral_value()
    return _series(x, lambda k: -x * x / (2 * k * (2 * k + 1))) if x else x


def atan(x: Decimal) -> Decimal:
    if abs(x) > 1:
        return (PI / 2).copy_sign(x) - atan(1 / x)
    for _ in range(4):
        x = x / (1 + (1 + x * x).sqrt())
    term, result, k = x, x, 1
    while abs(term) > Decimal(10) ** -(DIGITS + 5):
        term *= -x * x
        k += 2
        result += term / k
    return 16 * result


def asin(x: Decimal) -> Decimal:
    rest = (1 - x * x).sqrt()
    return atan(x / rest) if rest else (PI / 2).copy_sign(x)


def atan2(y: Decimal, x: Decimal) -> Decimal:
    if x > 0:
        return atan(y / x)
    if x < 0:
        return atan(y / x) + (PI if y >= 0 else -PI)
    return (PI / 2).copy_sign(y) if y else Decimal(0)


def exp(x: Decimal) -> Decimal:
    if abs(x) > _LARGE:
        raise Undefined
    return x.exp()


def log(x: Decimal) -> Decimal:
    if x <= 0:
        raise Undefined
    return x.ln()


def erf(x: Decimal) -> Decimal:
    if abs(x) > 5:
        raise Undefined  # the series below would lose its digits
    with localcontext(Context(prec=DIGITS + 30)):
        series = _series(x, lambda k: -x * x * (2 * k - 1) / (k * (2 * k + 1))) if x else x
        return 2 * series / PI.sqrt()


def power(a: Decimal, b: Decimal) -> Decimal:
    if abs(b) > 1000 or (a <= 0 and b != b.to_integral_value()):
        raise Undefined
    return a**b if a or b else Decimal(1)


def sqrt(x: Decimal) -> Decimal:
    return x.sqrt()


def total(*args: Decimal) -> Decimal:
    return sum(args, Decimal(0))


def product(*args: Decimal) -> Decimal:
    result = Decimal(1)
    for arg in args:
        result *= arg
    return result


def negative(x: Decimal) -> Decimal:
    return -x


def divide(a: Decimal, b: Decimal) -> Decimal:
    return a / b


def magnitude(x: Decimal) -> Decimal:
    return abs(x)


def least(*args: Decimal) -> Decimal:
    return min(args)


def greatest(*args: Decimal) -> Decimal:
    return max(args)


def sign(x: Decimal) -> Decimal:
    return Decimal(1).copy_sign(x) if x else Decimal(0)


def floor(x: Decimal) -> Decimal:
    return x.to_integral_value("ROUND_FLOOR")


def ceil(x: Decimal) -> Decimal:
    return x.to_integral_value("ROUND_CEILING")


def less(a: Decimal, b: Decimal) -> bool:
    return a < b


def less_equal(a: Decimal, b: Decimal) -> bool:
    return a <= b


def equal(a: Decimal, b: Decimal) -> bool:
    return a == b


def not_equal(a: Decimal, b: Decimal) -> bool:
    return a != b


def logical_and(*parts: bool) -> bool:
    return all(parts)


def logical_or(*parts: bool) -> bool:
    return any(parts)


def logical_not(part: bool) -> bool:
    return not part
