"""Arithmetic with numbers that are off by a known amount: ufuncs on values, and errors to first order.

Owns `Operators`, `applied`, `reduced` and `operand`. The error of f(x, y) is |df/dx| times that of x plus |df/dy|
times that of y: errors of operands may be correlated (they are, in `r - r`), so they add up and never cancel. What
jumps (`floor`, `sign`, comparisons) has no error to first order; its answer is plain numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

Pair = tuple[Any, Any]  # values, and their errors: floats or arrays
ROUNDING = 2.0**-53  # of the result; what is exact stays so, as whole numbers mostly are
Slopes = Callable[..., tuple[Any, ...]]

# The derivatives by each argument. Of what has kinks, the largest slope beside them: |x| is off by no more than x.
SLOPES: Mapping[np.ufunc, Slopes] = {
    np.add: lambda x, y: (1.0, 1.0),
    np.subtract: lambda x, y: (1.0, -1.0),
    np.multiply: lambda x, y: (y, x),
    np.true_divide: lambda x, y: (1 / y, -x / y**2),
    np.power: lambda x, y: _slopes_of_power(x, y),
    np.float_power: lambda x, y: _slopes_of_power(x, y),
    np.remainder: lambda x, y: (1.0, np.floor_divide(x, y)),
    np.fmod: lambda x, y: (1.0, np.trunc(x / y)),
    np.hypot: lambda x, y: (x / np.hypot(x, y), y / np.hypot(x, y)),
    np.arctan2: lambda y, x: (x / (x**2 + y**2), y / (x**2 + y**2)),
    np.logaddexp: lambda x, y: (1 / (1 + np.exp(y - x)), 1 / (1 + np.exp(x - y))),
    np.copysign: lambda x, y: (1.0, 0.0),
    np.negative: lambda x: (1.0,),
    np.positive: lambda x: (1.0,),
    np.absolute: lambda x: (1.0,),
    np.fabs: lambda x: (1.0,),
    np.conjugate: lambda x: (1.0,),
    np.square: lambda x: (2 * x,),
    np.sqrt: lambda x: (0.5 / np.sqrt(x),),
    np.cbrt: lambda x: (1 / (3 * np.cbrt(x) ** 2),),
    np.reciprocal: lambda x: (1 / x**2,),
    np.exp: lambda x: (np.exp(x),),
    np.exp2: lambda x: (np.exp2(x) * np.log(2),),
    np.expm1: lambda x: (np.exp(x),),
    np.log: lambda x: (1 / x,),
    np.log2: lambda x: (1 / (x * np.log(2)),),
    np.log10: lambda x: (1 / (x * np.log(10)),),
    np.log1p: lambda x: (1 / (1 + x),),
    np.sin: lambda x: (np.cos(x),),
    np.cos: lambda x: (np.sin(x),),
    np.tan: lambda x: (1 / np.cos(x) ** 2,),
    np.arcsin: lambda x: (1 / np.sqrt(1 - x**2),),
    np.arccos: lambda x: (1 / np.sqrt(1 - x**2),),
    np.arctan: lambda x: (1 / (1 + x**2),),
    np.sinh: lambda x: (np.cosh(x),),
    np.cosh: lambda x: (np.sinh(x),),
    np.tanh: lambda x: (1 / np.cosh(x) ** 2,),
    np.arcsinh: lambda x: (1 / np.sqrt(1 + x**2),),
    np.arccosh: lambda x: (1 / np.sqrt(x**2 - 1),),
    np.arctanh: lambda x: (1 / (1 - x**2),),
    np.degrees: lambda x: (180 / np.pi,),
    np.rad2deg: lambda x: (180 / np.pi,),
    np.radians: lambda x: (np.pi / 180,),
    np.deg2rad: lambda x: (np.pi / 180,),
}
# Of these the error is at most the largest of the operands' errors.
EXTREMES = (np.maximum, np.minimum, np.fmax, np.fmin)


def _slopes_of_power(x: Any, y: Any) -> tuple[Any, Any]:
    return np.where(y == 0, 0.0, y * np.power(x, np.where(y == 0, 1.0, y - 1.0))), np.power(x, y) * np.log(np.abs(x))


def applied(ufunc: np.ufunc, operands: Sequence[Pair], **options: Any) -> tuple[Any, Any | None]:
    """What a ufunc makes of numbers, and how far that may be off; None where nothing is known of its slope."""
    values = [value for value, _ in operands]
    with np.errstate(all="ignore"):
        value = ufunc(*values, **options)
        if any(np.iscomplexobj(part) for part in values):
            return value, None
        if ufunc in EXTREMES:
            return value, np.maximum(*(np.asarray(error, dtype=float) for _, error in operands))
        if ufunc is np.matmul:
            return value, _error_of_product(*operands)
        slopes = SLOPES.get(ufunc)
        if slopes is None:
            return value, None
        parts = [_part(s, error) for s, (_, error) in zip(slopes(*values), operands, strict=True)]
        error = np.broadcast_to(np.asarray(sum(parts)), np.shape(value))
        return value, np.where(error > 0, error + np.abs(value) * ROUNDING, error)


def _error_of_product(first: Pair, second: Pair) -> Any:
    """The error of a matrix product of arrays, with what is rounded in its sums."""
    (x, dx), (y, dy) = ((np.abs(value), np.broadcast_to(error, np.shape(value))) for value, error in (first, second))
    error = x @ dy + dx @ y
    return np.where(error > 0, error + np.shape(x)[-1] * ROUNDING * (x @ y), error)


def _part(slope: Any, error: Any) -> Any:
    """What one operand contributes: nothing if it is exact, whatever the slope; all, where the slope is not finite."""
    error = np.asarray(error, dtype=float)
    size = np.abs(np.asarray(slope, dtype=float)) * error
    return np.where(error == 0, 0.0, np.where(np.isnan(size), np.inf, size))


def reduced(ufunc: np.ufunc, pair: Pair, **options: Any) -> tuple[Any, Any | None]:
    """The same of `ufunc.reduce`: of sums, and of the least and the largest."""
    value, error = pair
    found = ufunc.reduce(value, **options)
    plain = {name: option for name, option in options.items() if name in ("axis", "keepdims")}
    if ufunc is np.add:
        return found, np.add.reduce(error, **plain)
    if ufunc in EXTREMES:
        return found, np.maximum.reduce(error, **plain)
    return found, None


def operand(other: object) -> Pair | None:
    """A number or an array as an operand without error; None for what is neither."""
    if isinstance(other, bool | int | float):
        return _double(other), 0.0
    if isinstance(other, str | bytes | tuple | dict | set) or other is None:
        return None
    try:
        array = np.asarray(other)
        if array.dtype.kind == "c":
            return array if array.ndim else complex(array), 0.0
        if array.dtype.kind not in "Obiuf":
            return None
        array = array.astype(float)
    except (TypeError, ValueError, OverflowError):
        return None
    return array if array.ndim else float(array), 0.0


def _double(number: float) -> float:
    try:
        return float(number)
    except OverflowError:
        return np.inf if number > 0 else -np.inf


def _of_one(ufunc: np.ufunc) -> Callable[[Operators], Any]:
    return lambda own: own._computed(ufunc, own)


def _of_two(ufunc: np.ufunc) -> tuple[Callable[[Operators, Any], Any], Callable[[Operators, Any], Any]]:
    """An operator, and the same with what is on its left."""
    return lambda own, other: own._computed(ufunc, own, other), lambda own, other: own._computed(ufunc, other, own)


def _comparison(ufunc: np.ufunc) -> Callable[[Operators, object], Any]:
    return lambda own, other: own._compared(ufunc, other)


class Operators:
    """The operators, sums and extremes of a class that says what a ufunc makes of it, and is an array to numpy."""

    __slots__ = ()

    def _computed(self, ufunc: np.ufunc, *operands: Any, **options: Any) -> Any:
        """What a ufunc makes of operands; NotImplemented where one of them is not a number."""
        raise NotImplementedError

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        raise NotImplementedError

    def _compared(self, ufunc: np.ufunc, other: object) -> Any:
        if isinstance(other, complex) and ufunc is not np.equal:
            return NotImplemented
        found = self._computed(ufunc, self, other)
        return bool(found) if isinstance(found, np.bool_) else found

    __lt__, __le__, __gt__, __ge__ = map(_comparison, (np.less, np.less_equal, np.greater, np.greater_equal))
    __neg__, __pos__, __abs__ = map(_of_one, (np.negative, np.positive, np.absolute))
    __add__, __radd__ = _of_two(np.add)
    __sub__, __rsub__ = _of_two(np.subtract)
    __mul__, __rmul__ = _of_two(np.multiply)
    __truediv__, __rtruediv__ = _of_two(np.true_divide)
    __floordiv__, __rfloordiv__ = _of_two(np.floor_divide)
    __mod__, __rmod__ = _of_two(np.remainder)
    __pow__, __rpow__ = _of_two(np.power)
    __matmul__, __rmatmul__ = _of_two(np.matmul)

    def __divmod__(self, other: Any) -> Any:
        whole = self.__floordiv__(other)
        return whole if whole is NotImplemented else (whole, self.__mod__(other))

    def __rdivmod__(self, other: Any) -> Any:
        whole = self.__rfloordiv__(other)
        return whole if whole is NotImplemented else (whole, self.__rmod__(other))

    def sum(self, axis: Any = None, out: Any = None, **options: Any) -> Any:
        """The sum along axes, all of them if none is named, as of an array; errors add up."""
        return np.add.reduce(self, axis=axis, out=out, **options)

    def min(self, axis: Any = None, out: Any = None, **options: Any) -> Any:
        """The least number along axes, as of an array; off by no more than the largest error."""
        return np.minimum.reduce(self, axis=axis, out=out, **options)

    def max(self, axis: Any = None, out: Any = None, **options: Any) -> Any:
        """The largest number along axes, as of an array; off by no more than the largest error."""
        return np.maximum.reduce(self, axis=axis, out=out, **options)

    def mean(self, axis: Any = None, out: Any = None, **options: Any) -> Any:
        """The mean along axes, as of an array; off by the mean of the errors."""
        total = self.sum(axis, out, **options)
        return total * (np.size(total) / np.size(self))
