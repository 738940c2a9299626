"""Derivatives of the oracle: differences of values that were computed to more digits.

Owns `derivative` and `call`. A dual is a family: what a value is when all parameters have moved by h along their
tangents. The derivative of a function maps families to families; only a number at the end is differentiated, at h = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mpmath import mp
from msgspec import Struct

Value = Any
Family = Callable[[Any], Value]

# The central difference of order 8 on 8 points: the error is h^8/630 of the ninth derivative.
_WEIGHTS = ((4, 5), (-1, 5), (4, 105), (-1, 280))


class Dual(Struct, frozen=True):
    """The derivative of a function, as a family of functions; called with duals it gives a dual."""

    family: Family
    digits: int

    def __call__(self, *args: Value) -> Value:
        families = [family_of(arg) for arg in args]

        def moved(h: Any) -> Value:
            return call(self.family(h), tuple(f(h) for f in families))

        return _dual(moved, self.digits)

    @property
    def arity(self) -> int:
        return getattr(self.family(mp.mpf(0)), "arity", 1)


def derivative(function: Value, digits: int) -> Value:
    """`deriv` of a function; of a number it is the dual with tangent 0."""
    return _dual(lambda h: function, digits)


def family_of(value: Value) -> Family:
    """A dual (value, tangent), a tuple of duals, the derivative of a function, or a number that does not move.

    The dual of an array is (its values, their tangents).
    """
    if isinstance(value, Dual):
        return value.family
    if isinstance(value, tuple) and len(value) == 2 and all(isinstance(part, list) for part in value):
        return lambda h: _shifted(*value, h)
    if isinstance(value, tuple):
        if len(value) == 2 and not any(isinstance(v, tuple) or callable(v) for v in value):
            return lambda h: value[0] + h * value[1]
        parts = [family_of(v) for v in value]
        return lambda h: tuple(p(h) for p in parts)
    if callable(value):
        return lambda h: _Moved(value, h)
    return lambda h: value


def _shifted(value: Value, tangent: Value, h: Any) -> Value:
    """An array (or what is in one) moved along a tangent of its own shape."""
    if isinstance(value, list | tuple):
        return type(value)(_shifted(v, t, h) for v, t in zip(value, tangent, strict=True))
    return value + h * tangent


class _Moved(Struct, frozen=True):
    """A function from duals to duals, given by hand, as the function of numbers that it is at h."""

    function: Value
    h: Any

    def __call__(self, *args: Value) -> Value:
        return _along(self.function(*((arg, mp.mpf(0)) for arg in args)), self.h)

    @property
    def arity(self) -> int:
        return getattr(self.function, "arity", 1)


def _along(dual: Value, h: Any) -> Value:
    if isinstance(dual, tuple) and len(dual) == 2 and not isinstance(dual[0], tuple):
        return dual[0] + h * dual[1]
    if isinstance(dual, tuple):
        return tuple(_along(part, h) for part in dual)
    return dual


def _dual(family: Family, digits: int) -> Value:
    value = family(mp.mpf(0))
    if callable(value):
        return Dual(family, digits)
    h = mp.mpf(10) ** -(mp.mpf(digits) / 8 + 0.5)
    points = {k: family(k * h) for k in range(-4, 5) if k}
    return _pair(value, points, h)


def _pair(value: Value, points: dict[int, Value], h: Any) -> Value:
    if isinstance(value, tuple):
        return tuple(_pair(v, {k: p[i] for k, p in points.items()}, h) for i, v in enumerate(value))
    if isinstance(value, list) and not any(map(callable, value)):
        return value, _slopes(value, points, h)
    if isinstance(value, list):
        return [_pair(v, {k: p[i] for k, p in points.items()}, h) for i, v in enumerate(value)]
    return value, _slopes(value, points, h)


def _slopes(value: Value, points: dict[int, Value], h: Any) -> Value:
    if isinstance(value, list | tuple):
        return type(value)(_slopes(v, {k: p[i] for k, p in points.items()}, h) for i, v in enumerate(value))
    return sum((points[k] - points[-k]) * mp.mpf(a) / b for k, (a, b) in enumerate(_WEIGHTS, 1)) / h


def call(function: Value, args: tuple[Value, ...]) -> Value:
    """One group of arguments; a group of n parameters also takes one tuple of n, and back."""
    arity = getattr(function, "arity", len(args))
    if arity != len(args) and len(args) == 1 and isinstance(args[0], tuple):
        args = args[0]
    elif arity != len(args) and arity == 1:
        args = (args,)
    return function(*args)
