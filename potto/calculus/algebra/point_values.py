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
# (near a zero of its own, where a random point seldom is, it would be more). A power enlarges them by its exponent, as
# long as they are small.
_CLEAR = 1e3
_AMPLIFIED = 1e4
_SMALL = 1e-3
_MOST_VALUES = 1 << 16
_TRIES = 8  # points that are tried until a term has a value at one
_values: list[dict[Term, tuple[float, float]]] = [{} for _ in range(_TRIES)]


def not_zero(term: Term) -> bool | None:
    """Whether a term's value at a point shows that it is not 0 everywhere, as a formula in what is not a builtin in it.

    False where it may be 0; None where no point was found at which it has a value.
    """
    for attempt, known in enumerate(_values):
        if len(known) > _MOST_VALUES:
            known.clear()
        for node in unknown(term, known):
            known[node] = _value_and_error(node, known, attempt)
        value, error = known[term]
        if math.isfinite(value):
            return abs(value) > _CLEAR * error
    return None


def _value_and_error(node: Term, known: Mapping[Term, tuple[float, float]], attempt: int) -> tuple[float, float]:
    """A value at a point, and how far off it may be by rounding: a running error analysis."""
    match node:
        case Const(value=value):
            return value, 0.0
        case Branch():
            side, error = known[node.surface]
            return known[node.then if side > 0 else node.orelse] if abs(side) > _CLEAR * error else (math.nan, 0.0)
        case If(condition=Prim(op="lt" | "le" | "eq" | "ne" as op, args=args)):
            (a, off), (b, also) = known[args[0]], known[args[1]]
            taken = node.then if FLOATS.apply(op, (a, b)) else node.orelse
            return known[taken] if abs(a - b) > _CLEAR * (off + also) else (math.nan, 0.0)
        case If():
            return math.nan, 0.0
        case Prim():
            return _of_builtin(node, known)
        case _:
            source = random.Random(node.digest + bytes(attempt))
            return (0.5 + source.random()) * (source.choice((1, -1)) if attempt % 2 else 1), 0.0


def _of_builtin(node: Prim, known: Mapping[Term, tuple[float, float]]) -> tuple[float, float]:
    values, errors = zip(*(known[a] for a in node.args), strict=True)
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
            error = abs(value) * _enlarged(node, relative) * (relative + _UNIT)
    return value, error + _UNIT * abs(value)


def _enlarged(node: Prim, relative: float) -> float:
    """How much a builtin enlarges relative errors."""
    match node:
        case Prim(op="sqrt") if relative < _SMALL:
            return 1.0
        case Prim(op="pow", args=(_, Const(value=exponent))) if relative * abs(exponent) < _SMALL:
            return 1.0 + abs(exponent)
        case _:
            return _AMPLIFIED


def points(names: Sequence[str], box: Mapping[str, tuple[float, float]], count: int) -> Iterator[dict[str, float]]:
    """Random points, the same ones each time; a variable without bounds between -3 and 3."""
    source = random.Random(1)
    for _ in range(count):
        yield {n: source.uniform(*_finite(box.get(n, (-3.0, 3.0)))) for n in names}


def _finite(bounds: tuple[float, float]) -> tuple[float, float]:
    lo, hi = min(bounds), max(bounds)
    if math.isinf(lo) and math.isinf(hi):
        return -3.0, 3.0
    return (hi - 6.0 if math.isinf(lo) else lo), (lo + 6.0 if math.isinf(hi) else hi)
