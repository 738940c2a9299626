"""The builtins on mpmath numbers.

Owns `FUNCTIONS`: what each builtin gives, real or nan, infinite where IEEE arithmetic is. Written apart from the
registry, which names numpy's functions, so that a slip in one of them shows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
from mpmath import mp

Number = Any  # an mpmath number; mpmath has no types


def real(value: Number) -> Number:
    """nan for what has left the real line."""
    if isinstance(value, mpmath.mpc):
        return value.real if value.imag == 0 else mp.nan
    return mp.mpf(value)


def _real(f: Callable[..., Number]) -> Callable[..., Number]:
    def run(*args: Number) -> Number:
        if any(mp.isnan(a) for a in args):
            return mp.nan
        try:
            return real(f(*args))
        except (ValueError, ZeroDivisionError, OverflowError):
            return mp.nan

    return run


def divide(a: Number, b: Number) -> Number:
    if b != 0:
        return a / b
    return mp.nan if a == 0 or mp.isnan(a) or mp.isnan(b) else mp.inf * mp.sign(a)


def power(a: Number, b: Number) -> Number:
    if a == 0 and not mp.isnan(b):
        return mp.mpf(1) if b == 0 else mp.mpf(0) if b > 0 else mp.inf
    return mp.power(a, b)


def minimum(*args: Number) -> Number:
    return mp.nan if any(mp.isnan(a) for a in args) else min(args)


def maximum(*args: Number) -> Number:
    return mp.nan if any(mp.isnan(a) for a in args) else max(args)


def clamp(x: Number, lo: Number, hi: Number) -> Number:
    return minimum(maximum(x, lo), hi)


def erfcinv(y: Number) -> Number:
    """The x with erfc(x) = y. Newton's method on log(erfc), since 1 - y has no digits for small y."""
    if not 0 < y < 2:
        return mp.inf if y == 0 else -mp.inf if y == 2 else mp.nan
    if y > 1:
        return -erfcinv(2 - y)
    x = mp.sqrt(-mp.log(y)) if y < mp.mpf("0.1") else mp.erfinv(1 - y)
    for _ in range(100):
        value = mp.erfc(x)
        step = (mp.log(value) - mp.log(y)) * value * mp.sqrt(mp.pi) / 2 * mp.exp(x * x)
        x += step
        if abs(step) <= mp.eps * (1 + abs(x)):
            return x
    raise ArithmeticError(f"erfcinv({y}) has not converged")


def product(*args: Number) -> Number:
    result = mp.mpf(1)
    for arg in args:
        result *= arg
    return result


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "add": lambda *args: sum(args, mp.mpf(0)),
    "mul": product,
    "neg": lambda x: -x,
    "div": divide,
    "pow": _real(power),
    "sqrt": _real(mp.sqrt),
    "exp": _real(mp.exp),
    "log": _real(mp.log),
    "log1p": _real(lambda x: mp.log1p(x) if x > -1 else mp.log(1 + x)),
    "expm1": _real(mp.expm1),
    "sin": _real(mp.sin),
    "cos": _real(mp.cos),
    "tan": _real(mp.tan),
    "asin": _real(mp.asin),
    "acos": _real(mp.acos),
    "atan": _real(mp.atan),
    "atan2": _real(mp.atan2),
    "hypot": _real(mp.hypot),
    "sinh": _real(mp.sinh),
    "cosh": _real(mp.cosh),
    "tanh": _real(mp.tanh),
    "asinh": _real(mp.asinh),
    "acosh": _real(mp.acosh),
    "atanh": _real(mp.atanh),
    "erf": _real(mp.erf),
    "erfc": _real(mp.erfc),
    "erfinv": _real(mp.erfinv),
    "erfcinv": _real(erfcinv),
    "abs": abs,
    "min": minimum,
    "max": maximum,
    "clamp": clamp,
    "sign": _real(mp.sign),
    "floor": _real(mp.floor),
    "ceil": _real(mp.ceil),
    "lt": lambda a, b: bool(a < b),
    "le": lambda a, b: bool(a <= b),
    "eq": lambda a, b: bool(a == b),
    "ne": lambda a, b: bool(a != b),
    "and": lambda *args: all(args),
    "or": lambda *args: any(args),
    "not": lambda a: not a,
}


def function(op: str) -> Callable[..., Any]:
    return FUNCTIONS[op]
