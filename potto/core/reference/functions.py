"""The builtins on mpmath numbers.

Owns `function`, which finds what an entry names: a function of mpmath, or one of those below, which mpmath lacks or
takes for complex numbers. They share no code with numpy's, so that a slip in one of them shows.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import mpmath
from mpmath import mp

from potto.core.terms import Const
from potto.primitives import PRIMITIVES
from potto.primitives.registry import Primitive, of_python
from potto.primitives.walking import Domain

Number = Any  # an mpmath number; mpmath has no types
_TAKES_ANYTHING = frozenset({"add", "mul", "neg", "div", "abs"})  # of nan they make nan by themselves


def real(value: Number) -> Number:
    """nan for what has left the real line."""
    if isinstance(value, mpmath.mpc):
        return value.real if value.imag == 0 else mp.nan
    return mp.mpf(value)


def _real(f: Callable[..., Number], within: tuple[float, float]) -> Callable[..., Number]:
    """nan for nan, outside of where a builtin of one argument is defined, and for what is not real."""

    def run(*args: Number) -> Number:
        if any(mp.isnan(a) for a in args) or not within[0] <= args[-1] <= within[1]:
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


def sphericalj(n: Number, x: Number) -> Number:
    """By its series, which is the same on both sides of 0."""
    a = n + mp.mpf(1.5)
    return mp.sqrt(mp.pi) / 2 / mp.gamma(a) * (x / 2) ** int(n) * mp.hyp0f1(a, -x * x / 4)


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


def total(*args: Number) -> Number:
    return sum(args, mp.mpf(0))


def log1p(x: Number) -> Number:
    return mp.log1p(x) if x > -1 else mp.log(1 + x)


class _Exact(Domain[Number]):
    """The functions of mpmath that the entries of builtins name, and what these make of formulas."""

    def constant(self, node: Const) -> Number:
        return +mp.pi if node.name == "pi" else mp.mpf(node.value)

    def rule(self, entry: Primitive) -> Callable[..., Number] | None:
        where, _, name = entry.mpmath.rpartition(".")
        if not name:
            return None
        own = getattr(mp, name) if not where else globals()[name] if where == "potto" else of_python(entry.mpmath)
        return _real(own, entry.within) if not entry.truth and entry.name not in _TAKES_ANYTHING else own

    def unknown(self) -> Number:
        raise LookupError("a builtin that has neither a function of mpmath nor a formula")


_EXACT = _Exact()


@lru_cache(maxsize=256)
def function(op: str) -> Callable[..., Any]:
    """What a builtin gives: real or nan, infinite where IEEE arithmetic is."""
    if not _EXACT.knows(op):
        raise KeyError(f"{op} has no rule for mpmath's numbers")
    return _EXACT.rule(PRIMITIVES[op]) or (lambda *args: _EXACT.apply(op, args))
