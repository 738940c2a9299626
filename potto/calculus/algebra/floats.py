"""Builtins of plain Python numbers, without numpy: for questions about terms, not for results.

Owns `FLOATS` (terms at a point, nan where they have no value) and `OPS`, the arithmetic that the rules
of enclosure get where they are asked about single intervals.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from potto.core.terms import Branch, Const, If, Term
from potto.primitives import PRIMITIVES
from potto.primitives.registry import Primitive, of_python
from potto.primitives.walking import Domain

NAN = math.nan


def total(*args: float) -> float:
    return math.fsum(args)


def product(*args: float) -> float:
    return math.prod(args)


def sign(x: float) -> float:
    return float((x > 0) - (x < 0))


class Floats(Domain[float]):
    """Terms at a point: nan where they have no value, or none that can be told."""

    def constant(self, node: Const) -> float:
        return node.value

    def rule(self, entry: Primitive) -> Callable[..., float] | None:
        return _rule(entry.name)

    def unknown(self) -> float:
        return NAN

    def other(self, node: Term, known: Mapping[Term, float]) -> float:
        if isinstance(node, Branch):
            surface = known[node.surface]
            return known[node.then if (surface > 0 if node.strict else surface >= 0) else node.orelse]
        if isinstance(node, If):
            return known[node.then if known[node.condition] else node.orelse]
        return NAN


FLOATS = Floats()


@lru_cache(maxsize=256)
def _rule(op: str) -> Callable[..., float] | None:
    entry = PRIMITIVES[op]
    if entry.scalar:
        where, _, name = entry.scalar.rpartition(".")
        return _guarded(globals()[name] if where == "potto" else of_python(entry.scalar), entry)
    return None if entry.formula is not None else _guarded(_by_mpmath(op), entry)


def _by_mpmath(op: str) -> Callable[..., float]:
    def run(*args: float) -> float:
        from potto.core.reference import function  # slow to import, and seldom needed

        return float(function(op)(*args))

    return run


def _guarded(f: Callable[..., float], entry: Primitive) -> Callable[..., float]:
    """nan for nan and where there is no value; infinite beyond all numbers."""

    def run(*args: float) -> float:
        if any(x != x for x in args) or not entry.within[0] <= args[-1] <= entry.within[1]:
            return NAN
        try:
            return float(f(*args))
        except OverflowError:
            signed = entry.parity < 0 or math.isinf(args[-1])  # an infinity has no floor in Python, and is its own
            return math.copysign(math.inf, args[-1]) if signed else math.inf
        except (ValueError, ZeroDivisionError, ArithmeticError):
            return NAN

    return run


class _Ops:
    """`Elementwise` of floats."""

    def of(self, name: str) -> Callable[..., float]:
        return lambda *args: FLOATS.apply(name, args)

    def where(self, condition: Any, a: float, b: float) -> float:
        return a if condition else b

    def least(self, a: float, b: float) -> float:
        return NAN if a != a or b != b else min(a, b)

    def most(self, a: float, b: float) -> float:
        return NAN if a != a or b != b else max(a, b)

    def finite(self, x: float) -> bool:
        return math.isfinite(x)


OPS = _Ops()
