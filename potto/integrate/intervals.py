"""Interval arithmetic over batches: which values a term can take on boxes.

Owns `enclosure`. Bounds are wide enough to hold every value that the term takes, rounding included, and get closer as
the boxes get smaller; where nothing is known they are infinite. (Moore, Kearfott and Cloud, Introduction to Interval
Analysis, 2009.)
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
ROUNDING = 4 * EPS  # of one operation, functions of libraries included, relative


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
            return (value, value) if value == value else ANYTHING
        case Var(name=name):
            return box[name]
        case Prim(op=op, args=args) if op in _RULES:
            return _outwards(*_RULES[op](node, [found[a] for a in args]))
        case Prim(op=op, args=(arg,)) if monotone(op):
            return _outwards(*_along(op, found[arg]))
        case Branch() | If():
            a, b = found[node.then], found[node.orelse]
            return np.minimum(a[0], b[0]), np.maximum(a[1], b[1])
        case _:
            return ANYTHING


def _outwards(lo: Any, hi: Any) -> Interval:
    """Rounded outwards; nan (inf - inf, a root of something negative) becomes no bound."""
    return (
        np.where(np.isnan(lo), -np.inf, lo - ROUNDING * np.abs(lo)),
        np.where(np.isnan(hi), np.inf, hi + ROUNDING * np.abs(hi)),
    )


def _along(op: str, a: Interval) -> Interval:
    entry = PRIMITIVES[op]
    f = function(entry.numpy)
    ends = f(a[0]), f(a[1])
    if entry.increasing < 0:
        ends = ends[1], ends[0]
    bad = np.isnan(ends[0]) | np.isnan(ends[1])  # beyond an edge of the domain: what is on it, is not told apart
    return np.where(bad, -np.inf, ends[0]), np.where(bad, np.inf, ends[1])


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
    return np.where(apart, 1 / a[1], -np.inf), np.where(apart, 1 / a[0], np.inf)


def _div(node: Prim, args: list[Interval]) -> Interval:
    return _times(args[0], _inverse(args[1]))


def _whole_power(a: Interval, n: int) -> Interval:
    if n == 1:
        return a
    p, q = np.power(a[0], float(n)), np.power(a[1], float(n))
    if n % 2:
        return p, q
    inside = (a[0] <= 0) & (a[1] >= 0)
    return np.where(inside, 0.0, np.minimum(p, q)), np.maximum(p, q)


def _pow(node: Prim, args: list[Interval]) -> Interval:
    base, (low, high) = args
    exponent = node.args[1]
    if isinstance(exponent, Const) and exponent.value == 0:
        return np.ones_like(base[0]), np.ones_like(base[1])  # also at 0
    if isinstance(exponent, Const) and exponent.value.is_integer() and 0 < abs(exponent.value) < 1e6:
        whole = _whole_power(base, int(abs(exponent.value)))
        return whole if exponent.value > 0 else _inverse(whole)
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


_RULES: dict[str, Callable[[Prim, list[Interval]], Interval]] = {
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
