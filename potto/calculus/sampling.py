"""Values of terms at points, in plain Python numbers: for checks that symbols cannot decide.

Owns `sample_value` and the points. Nothing here integrates or runs a program: a term is evaluated as it stands, and
whatever is not a number there is nan.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence

from potto.core.terms import Branch, Const, If, Prim, Proj, Term, Tuple, Var, children, postorder_by

NAN = math.nan


def _pow(base: float, exponent: float) -> float:
    result = math.pow(base, exponent)
    return result


def _clamp(x: float, lo: float, hi: float) -> float:
    return min(max(x, lo), hi)


def _div(a: float, b: float) -> float:
    return a / b if b else NAN


_FUNCTIONS: dict[str, Callable[..., float]] = {
    "add": lambda *a: math.fsum(a),
    "mul": lambda *a: math.prod(a),
    "neg": lambda a: -a,
    "div": _div,
    "pow": _pow,
    "min": min,
    "max": max,
    "abs": abs,
    "clamp": _clamp,
    "hypot": math.hypot,
    "sign": lambda a: float((a > 0) - (a < 0)),
    "floor": lambda a: float(math.floor(a)),
    "ceil": lambda a: float(math.ceil(a)),
    "lt": lambda a, b: float(a < b),
    "le": lambda a, b: float(a <= b),
    "eq": lambda a, b: float(a == b),
    "ne": lambda a, b: float(a != b),
    "and": lambda *a: float(all(a)),
    "or": lambda *a: float(any(a)),
    "not": lambda a: float(not a),
}


def sample_value(term: Term, point: Mapping[str, float], known: dict[Term, float] | None = None) -> float:
    """The value of a number-valued term at a point; nan where it is not defined or cannot be told.

    known: the values there of terms that were met before.
    """
    values = {} if known is None else known
    for node in postorder_by(term, lambda node: () if node in values else children(node)):
        if node not in values:
            values[node] = _value(node, values, point)
    return values[term]


def _value(node: Term, values: Mapping[Term, float], point: Mapping[str, float]) -> float:
    match node:
        case Const(value=value):
            return value
        case Var(name=name):
            return point.get(name, NAN)
        case Branch():
            surface = values[node.surface]
            holds = surface > 0 if node.strict else surface >= 0
            return values[node.then] if holds else values[node.orelse]
        case If():
            return values[node.then] if values[node.condition] else values[node.orelse]
        case Prim(op=op, args=args):
            function = _FUNCTIONS.get(op) or getattr(math, op, None)
            numbers = [values[a] for a in args]
            if function is None or any(n != n for n in numbers):
                return NAN
            try:
                return float(function(*numbers))
            except (ValueError, OverflowError, ZeroDivisionError):
                return NAN
        case Tuple() | Proj():
            return NAN
        case _:
            return NAN


def points(
    names: Sequence[str], box: Mapping[str, tuple[float, float]], count: int, seed: int = 1
) -> Iterator[dict[str, float]]:
    """Random points, the same ones each time; a variable without bounds between -3 and 3."""
    source = random.Random(seed)
    for _ in range(count):
        yield {n: source.uniform(*_finite(box.get(n, (-3.0, 3.0)))) for n in names}


def _finite(bounds: tuple[float, float]) -> tuple[float, float]:
    lo, hi = min(bounds), max(bounds)
    if math.isinf(lo) and math.isinf(hi):
        return -3.0, 3.0
    return (hi - 6.0 if math.isinf(lo) else lo), (lo + 6.0 if math.isinf(hi) else hi)
