"""Values of terms at points, in plain Python numbers: for checks that symbols cannot decide.

Owns `sample_value`, `not_zero` and the points. Nothing here integrates or runs a program: a term is evaluated as it
stands, and whatever is not a number there is nan.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping, Sequence

from potto.calculus.algebra.floats import FLOATS
from potto.core.terms import Branch, Const, If, Prim, Term, Var, unknown


def sample_value(term: Term, point: Mapping[str, float], known: dict[Term, float] | None = None) -> float:
    """The value of a number-valued term at a point; nan where it is not defined or cannot be told.

    known: the values there of terms that were met before.
    """
    values = {} if known is None else known
    for node in unknown(term, values):
        values[node] = point.get(node.name, math.nan) if isinstance(node, Var) else FLOATS.node(node, {}, values)
    return values[term]


_UNIT = 2.0**-53
# How much larger than its error a value is that is told from 0; how much a builtin enlarges relative errors, at most
# (near a zero of its own, where a random point seldom is, it would be more).
_CLEAR = 1e3
_AMPLIFIED = 1e4
_MOST_VALUES = 1 << 16
_values: dict[Term, tuple[float, float]] = {}


def not_zero(term: Term) -> bool:
    """Whether a term's value at one point shows that it is not 0 everywhere, as a formula in what is no builtin in it.

    False also where that is not known.
    """
    if len(_values) > _MOST_VALUES:
        _values.clear()
    for node in unknown(term, _values):
        _values[node] = _value_and_error(node)
    value, error = _values[term]
    return math.isfinite(value) and abs(value) > _CLEAR * error


def _value_and_error(node: Term) -> tuple[float, float]:
    """A value at a point, and how far off it may be by rounding: a running error analysis."""
    if isinstance(node, Const):
        return node.value, 0.0
    if isinstance(node, Branch):
        side, error = _values[node.surface]
        return _values[node.then if side > 0 else node.orelse] if abs(side) > _CLEAR * error else (math.nan, 0.0)
    if isinstance(node, If):
        return math.nan, 0.0
    if not isinstance(node, Prim):
        return 0.5 + random.Random(node.digest).random(), 0.0
    values, errors = zip(*(_values[a] for a in node.args), strict=True)
    value = FLOATS.apply(node.op, values)
    match node.op:
        case "add":
            error = sum(errors)
        case "neg":
            return value, errors[0]
        case "mul":
            whole = math.prod(abs(v) + e for v, e in zip(values, errors, strict=True))
            error = whole - math.prod(map(abs, values)) + len(values) * _UNIT * whole
        case "div" if abs(values[1]) > errors[1]:
            error = (errors[0] + abs(value) * errors[1]) / (abs(values[1]) - errors[1])
        case _:
            relative = max((e / abs(v) if v else math.inf for v, e in zip(values, errors, strict=True)), default=0.0)
            error = abs(value) * _AMPLIFIED * (relative + _UNIT)
    return value, error + _UNIT * abs(value)


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
