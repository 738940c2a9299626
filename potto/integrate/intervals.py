"""Interval arithmetic over batches: which values a term can take on boxes.

Owns `enclosure`. Bounds are wide enough to hold every value that the term takes, rounding included, and get closer as
the boxes get smaller; where nothing is known they are infinite, and where the term has no value anywhere on a box
(the root of what is negative all over) they are nan. (Moore, Kearfott and Cloud, Introduction to Interval Analysis,
2009.)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from potto.calculus.enclosable import monotone
from potto.core.terms import Branch, Const, If, Prim, Term, Var, postorder
from potto.integrate.rules import EPS
from potto.kernels.support import function
from potto.primitives import PRIMITIVES

Interval = tuple[Any, Any]  # lower and upper bounds, numbers or arrays

ANYTHING: Interval = (-np.inf, np.inf)
NOWHERE: Interval = (np.nan, np.nan)  # of a term that has no value on a box
ROUNDING = 4 * EPS  # of one operation, functions of libraries included, relative


def everywhere(term: Term) -> bool:
    """Whether a term has a value wherever it is evaluated, poles aside."""
    return not any(isinstance(n, Prim) and (n.op in _DOMAINS or _fractional(n)) for n in postorder(term))


def _fractional(node: Prim) -> bool:
    exponent = node.args[-1]
    return node.op == "pow" and not (isinstance(exponent, Const) and exponent.value.is_integer())


def enclosure(terms: tuple[Term, ...], box: Mapping[str, Interval]) -> list[Interval]:
    """Bounds of the values of terms, which are `enclosable`, for variables in a box."""
    found: dict[Term, Interval] = {}
    with np.errstate(all="ignore"):
        for node in postorder(*terms):
            found[node] = _node(node, found, box)
    return [found[term] for term in terms]


def _node(node: Term, found: Mapping[Term, Interval], box: Mapping[str, Interval]) -> Interval:
    match node:
        case Const(value=value):
            return value, value  # nan is what a guard leaves where there is no value
        case Var(name=name):
            return box[name]
        case Prim(op=op, args=args) if op in _RULES:
            return _defined([found[a] for a in args], _RULES[op](node, [found[a] for a in args]))
        case Prim(op=op, args=(arg,)) if monotone(op):
            return _defined([found[arg]], _along(op, found[arg]))
        case Branch():
            a, b = found[node.then], found[node.orelse]
            lo, hi = found[node.surface]
            either = np.fmin(a[0], b[0]), np.fmax(a[1], b[1])
            least, most = (
                np.where(lo > 0, x, np.where(hi < 0, y, z)) for x, y, z in zip(a, b, either, strict=True)
            )
            return least, most
        case If():
            a, b = found[node.then], found[node.orelse]
            return np.fmin(a[0], b[0]), np.fmax(a[1], b[1])
        case _:
            return ANYTHING


def _defined(args: list[Interval], result: tuple[Any, Any] | tuple[Any, Any, Any]) -> Interval:
    """Rounded outwards; nan (inf - inf) becomes no bound, but where an argument has no value, neither has the result.

    Neither has what is infinite all over. A third item of the result says where the builtin itself is not defined.
    """
    lo, hi = result[0], result[1]
    nowhere = (lo == np.inf) | (hi == -np.inf)
    lo = np.where(np.isnan(lo), -np.inf, lo - ROUNDING * np.abs(lo))
    hi = np.where(np.isnan(hi), np.inf, hi + ROUNDING * np.abs(hi))
    if len(result) == 3:
        nowhere = nowhere | result[2]
    for a in args:
        nowhere = nowhere | np.isnan(a[0])
    if np.any(nowhere):
        lo, hi = np.where(nowhere, np.nan, lo), np.where(nowhere, np.nan, hi)
    return lo, hi


# Where the monotone builtins that are not defined everywhere are; the others are everywhere.
_DOMAINS = {
    "sqrt": (0.0, np.inf), "log": (0.0, np.inf), "log1p": (-1.0, np.inf), "acosh": (1.0, np.inf),
    "asin": (-1.0, 1.0), "acos": (-1.0, 1.0), "atanh": (-1.0, 1.0), "erfinv": (-1.0, 1.0), "erfcinv": (0.0, 2.0),
}  # fmt: skip


def _along(op: str, a: Interval) -> tuple[Any, Any, Any]:
    """A monotone builtin of the part of an interval on which it is defined."""
    entry = PRIMITIVES[op]
    least, most = _DOMAINS.get(op, ANYTHING)
    f = function(entry.numpy)
    ends = f(np.clip(a[0], least, most)), f(np.clip(a[1], least, most))
    if entry.increasing < 0:
        ends = ends[1], ends[0]
    return ends[0], ends[1], (a[1] < least) | (a[0] > most)


def _add(node: Prim, args: list[Interval]) -> Interval:
    lo, hi = args[0]
    for a in args[1:]:
        lo, hi = lo + a[0], hi + a[1]
        size = np.maximum(np.abs(lo), np.abs(hi)) + np.maximum(np.abs(a[0]), np.abs(a[1]))
        slack = np.where(np.isfinite(size), EPS * size, 0.0)  # of operands that cancel
        lo, hi = lo - slack, hi + slack
    return lo, hi


def _neg(node: Prim, args: list[Interval]) -> Interval:
    return -args[0][1], -args[0][0]


def _times(a: Interval, b: Interval) -> Interval:
    corners = [np.where((x == 0) | (y == 0), 0.0, x * y) for x in a for y in b]
    lo, hi = corners[0], corners[0]
    for c in corners[1:]:
        lo, hi = np.minimum(lo, c), np.maximum(hi, c)
    return lo, hi


def _mul(node: Prim, args: list[Interval]) -> Interval:
    by_term = dict(zip(node.args, args, strict=True))
    result: Interval = (1.0, 1.0)
    for arg, interval in by_term.items():
        result = _times(result, _whole_power(interval, node.args.count(arg)))
    return result


def _inverse(a: Interval) -> Interval:
    apart = (a[0] > 0) | (a[1] < 0)
    return np.where(apart, np.divide(1.0, a[1]), -np.inf), np.where(apart, np.divide(1.0, a[0]), np.inf)


def _div(node: Prim, args: list[Interval]) -> tuple[Any, Any, Any]:
    return *_times(args[0], _inverse(args[1])), _zero(args[1])


def _zero(a: Interval) -> Any:
    """Where a divisor is 0 all over: the quotient is no number anywhere."""
    return (np.asarray(a[0]) == 0) & (np.asarray(a[1]) == 0)


def _whole_power(a: Interval, n: int) -> Interval:
    if n == 1:
        return a
    p, q = np.power(a[0], float(n)), np.power(a[1], float(n))
    if n % 2:
        return p, q
    inside = (a[0] <= 0) & (a[1] >= 0)
    return np.where(inside, 0.0, np.minimum(p, q)), np.maximum(p, q)


def _pow(node: Prim, args: list[Interval]) -> tuple[Any, Any] | tuple[Any, Any, Any]:
    base, (low, high) = args
    exponent = node.args[1]
    if isinstance(exponent, Const) and exponent.value == 0:
        return np.ones_like(base[0]), np.ones_like(base[1])  # also at 0
    if isinstance(exponent, Const) and exponent.value.is_integer() and 0 < abs(exponent.value) < 1e6:
        whole = _whole_power(base, int(abs(exponent.value)))
        return whole if exponent.value > 0 else (*_inverse(whole), _zero(whole))
    if isinstance(exponent, Const) and exponent.value > 0:
        least, most = (np.power(np.maximum(end, 0.0), exponent.value) for end in base)
        return least, most, base[1] < 0
    corners = np.stack(np.broadcast_arrays(*(np.power(b, e) for b in base for e in (low, high))))
    fine = base[0] > 0
    return np.where(fine, corners.min(axis=0), -np.inf), np.where(fine, corners.max(axis=0), np.inf)


def _abs(node: Prim, args: list[Interval]) -> Interval:
    ((lo, hi),) = args
    small, large = np.minimum(np.abs(lo), np.abs(hi)), np.maximum(np.abs(lo), np.abs(hi))
    return np.where((lo <= 0) & (hi >= 0), 0.0, small), large


def _cosh(node: Prim, args: list[Interval]) -> Interval:
    lo, hi = _abs(node, args)
    return np.cosh(lo), np.cosh(hi)


def _hypot(node: Prim, args: list[Interval]) -> Interval:
    a, b = (_abs(node, [x]) for x in args)
    return np.hypot(a[0], b[0]), np.hypot(a[1], b[1])


def _sine(a: Interval, shift: float) -> Interval:
    """sin(x + shift): 1 where a peak lies inside, -1 where a trough does, as far as their places are known."""
    lo, hi = a[0] + shift, a[1] + shift
    slack = 2 * EPS * np.maximum(np.abs(lo), np.abs(hi))
    p, q = np.sin(lo), np.sin(hi)
    turns = 2 * np.pi

    def meets(place: float) -> Any:
        return np.floor((hi + slack - place) / turns) > np.floor((lo - slack - place) / turns)

    everywhere = ~(np.isfinite(lo) & np.isfinite(hi)) | (hi - lo >= turns)
    low = np.where(everywhere | meets(-np.pi / 2), -1.0, np.minimum(p, q) - slack)
    high = np.where(everywhere | meets(np.pi / 2), 1.0, np.maximum(p, q) + slack)
    return np.maximum(low, -1.0), np.minimum(high, 1.0)


def _tan(node: Prim, args: list[Interval]) -> Interval:
    ((lo, hi),) = args
    slack = 2 * EPS * np.maximum(np.abs(lo), np.abs(hi))
    pole = np.floor((hi + slack) / np.pi + 0.5) != np.floor((lo - slack) / np.pi + 0.5)
    pole = pole | ~(np.isfinite(lo) & np.isfinite(hi))
    p, q = np.tan(lo), np.tan(hi)
    return np.where(pole, -np.inf, p - slack * (1 + p * p)), np.where(pole, np.inf, q + slack * (1 + q * q))


def _extreme(pick: Any) -> Callable[[Prim, list[Interval]], Interval]:
    def run(node: Prim, args: list[Interval]) -> Interval:
        lo, hi = args[0]
        for a in args[1:]:
            lo, hi = pick(lo, a[0]), pick(hi, a[1])
        return lo, hi

    return run


def _atan2(node: Prim, args: list[Interval]) -> Interval:
    """Of a rectangle that neither holds the origin nor meets the cut, the corners are the extremes."""
    y, x = args
    corners = np.stack(np.broadcast_arrays(*(np.arctan2(b, a) for b in y for a in x)))
    cut = (x[0] <= 0) & (y[0] < 0) & (y[1] >= 0)
    origin = (x[0] <= 0) & (x[1] >= 0) & (y[0] <= 0) & (y[1] >= 0)
    lo = np.where(origin, 0.0, corners.min(axis=0))
    return np.where(cut, -np.pi, lo), np.where(cut | origin, np.pi, corners.max(axis=0))


def _sign(node: Prim, args: list[Interval]) -> Interval:
    return np.sign(args[0][0]), np.sign(args[0][1])


def _clamp(node: Prim, args: list[Interval]) -> Interval:
    x, lo, hi = args
    return np.minimum(np.maximum(x[0], lo[0]), hi[0]), np.minimum(np.maximum(x[1], lo[1]), hi[1])


_RULES: dict[str, Callable[[Prim, list[Interval]], tuple[Any, Any] | tuple[Any, Any, Any]]] = {
    "add": _add,
    "neg": _neg,
    "mul": _mul,
    "div": _div,
    "pow": _pow,
    "abs": _abs,
    "cosh": _cosh,
    "hypot": _hypot,
    "sin": lambda node, args: _sine(args[0], 0.0),
    "cos": lambda node, args: _sine(args[0], np.pi / 2),
    "tan": _tan,
    "min": _extreme(np.minimum),
    "max": _extreme(np.maximum),
    "clamp": _clamp,
    "atan2": _atan2,
    "sign": _sign,
}
