"""Interval arithmetic over batches: which values a term can take on boxes.

Owns `enclosure`, `INTERVALS` and `CLOSE_INTERVALS`. Bounds are wide enough to hold every value that the term takes,
rounding included, and get closer as the boxes get smaller; where nothing is known they are infinite, and where the term
has no value anywhere on a box (the root of what is negative all over) they are nan. Close ones hold what the term is
worth in exact arithmetic, which is all that a proof asks. (Moore, Kearfott and Cloud, Introduction to Interval
Analysis, 2009.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from potto.core.terms import Branch, Const, If, Prim, Term, postorder
from potto.integrate.rules.gauss import EPS
from potto.kernels.support import OPS
from potto.primitives import PRIMITIVES, Primitive
from potto.primitives.bounds import between_turns
from potto.primitives.walking import Domain

Interval = tuple[Any, Any]  # lower and upper bounds, numbers or arrays

ANYTHING: Interval = (-np.inf, np.inf)
ROUNDING = 4 * EPS  # of one operation, functions of libraries included, relative


def everywhere(term: Term) -> bool:
    """Whether a term has a value wherever it is evaluated, poles aside."""
    return not any(isinstance(n, Prim) and (_narrow(n.op) or _fractional(n)) for n in postorder(term))


def _narrow(op: str) -> bool:
    return PRIMITIVES[op].within != ANYTHING


def _fractional(node: Prim) -> bool:
    exponent = node.args[-1]
    return node.op == "pow" and not (isinstance(exponent, Const) and exponent.value.is_integer())


def enclosure(terms: tuple[Term, ...], box: Mapping[str, Interval]) -> list[Interval]:
    """Bounds of the values of terms, which are `enclosable`, for variables in a box."""
    with np.errstate(all="ignore"):
        env = {name: marked(*ends) for name, ends in box.items()}
        known: dict[Term, Interval] = {}
        for node in _order(terms):
            known[node] = INTERVALS.node(node, env, known)
    return [known[term] for term in terms]


@lru_cache(maxsize=4096)
def _order(terms: tuple[Term, ...]) -> tuple[Term, ...]:
    return tuple(postorder(*terms))


class _Finite(tuple[Any, Any]):
    """Bounds of which none is infinite or nan: what could come of those need not be looked for in what they lead to."""

    __slots__ = ()


def marked(lo: Any, hi: Any) -> Interval:
    """Bounds, with whether they are finite everywhere found out by one sum: infinities and nans stay what they are."""
    both = lo + hi
    finite = math.isfinite(np.add.reduce(both, None) if isinstance(both, np.ndarray) else both)
    return _Finite((lo, hi)) if finite else (lo, hi)


def _all_finite(args: Sequence[Interval]) -> bool:
    return set(map(type, args)) == {_Finite}


class _Intervals(Domain[Interval]):
    """Bounds of batches: arithmetic as below, everything else by the rules of the entries."""

    def constant(self, node: Const) -> Interval:
        return marked(node.value, node.value)  # nan is what a guard leaves where there is no value

    def unknown(self) -> Interval:
        return ANYTHING

    def builtin(self, node: Prim, known: Mapping[Term, Interval]) -> Interval:
        args = [known[arg] for arg in node.args]
        rule = _ARITHMETIC.get(node.op)
        return _defined(args, rule(node, args)) if rule is not None else self.apply(node.op, args)

    def does(self, op: str) -> bool:
        return op in _ARITHMETIC

    def rule(self, entry: Primitive) -> Callable[..., Interval] | None:
        return _rule(entry.name)

    def other(self, node: Term, known: Mapping[Term, Interval]) -> Interval:
        if not isinstance(node, Branch | If):
            return ANYTHING
        a, b = known[node.then], known[node.orelse]
        either = np.fmin(a[0], b[0]), np.fmax(a[1], b[1])
        if isinstance(node, If):
            return either
        lo, hi = known[node.surface]
        least, most = (np.where(lo > 0, x, np.where(hi < 0, y, z)) for x, y, z in zip(a, b, either, strict=True))
        return least, most


class _CloseIntervals(_Intervals):
    """Bounds of what a term is worth in exact arithmetic. What computed values are off by is not within: only the
    operations that find the bounds are rounded, correctly, so that an EPS of its result is enough for each."""

    def builtin(self, node: Prim, known: Mapping[Term, Interval]) -> Interval:
        args = [known[arg] for arg in node.args]
        roundings = _roundings(node)
        if roundings is None or not _all_finite(args):
            return super().builtin(node, known)
        if node.op == "add":
            return marked(*_sum(args))
        return _defined(args, _ARITHMETIC[node.op](node, args), roundings * EPS)


INTERVALS, CLOSE_INTERVALS = _Intervals(), _CloseIntervals()


@lru_cache(maxsize=256)
def _rule(op: str) -> Callable[..., Interval] | None:
    found = interval_of(PRIMITIVES[op])
    return None if found is None else lambda *args: _by_entry(PRIMITIVES[op], found, args)


def interval_of(entry: Primitive) -> Callable[..., tuple[Any, ...]] | None:
    """The bounds of a builtin's values before they are rounded, by an arithmetic and the bounds of its arguments."""
    if entry.interval is not None or not entry.piecewise_monotone:
        return entry.interval
    return lambda ops, a: between_turns(ops, entry.name, entry.within, entry.turns or (), a)


def _by_entry(entry: Primitive, bounds: Callable[..., tuple[Any, ...]], args: tuple[Interval, ...]) -> Interval:
    result = bounds(OPS, *args)
    room = ROUNDING
    if entry.ulp != 1:
        lower, upper = (entry.places(*ends) for ends in zip(*args, strict=True))
        room = np.minimum(ROUNDING + EPS * np.maximum(lower, upper), 1.0)
    off = entry.off
    if callable(off):
        off = np.fmax(np.fmax(*(off(*ends) for ends in zip(*args, strict=True))), 0.0)  # nan at infinity
    lo, hi = _defined(args, result, room, off)
    least, most = entry.image
    return (lo if least == -np.inf else np.maximum(lo, least)), (hi if most == np.inf else np.minimum(hi, most))


def _defined(args: Sequence[Interval], result: tuple[Any, ...], room: Any = ROUNDING, off: Any = 0.0) -> Interval:
    """Rounded outwards; nan (inf - inf) becomes no bound, but where an argument has no value, neither has the result.

    Neither has what is infinite all over. A third item of the result says where the builtin itself is not defined.
    """
    lo, hi = result[0], result[1]
    below, above = lo - room * abs(lo), hi + room * abs(hi)
    if off.__class__ is not float or off:
        below, above = below - off, above + off
    unsure = [a[0] for a in args if a.__class__ is not _Finite]
    found = marked(below, above)
    if len(result) == 2 and not unsure and found.__class__ is _Finite:
        return found
    nowhere = (lo == np.inf) | (hi == -np.inf)
    if len(result) == 3:
        nowhere = nowhere | result[2]
    for low in unsure:
        nowhere = nowhere | np.isnan(low)
    below, above = np.fmax(below, -np.inf), np.fmin(above, np.inf)
    if np.any(nowhere):
        below, above = np.where(nowhere, np.nan, below), np.where(nowhere, np.nan, above)
    return marked(below, above)


def _add(node: Prim, args: list[Interval]) -> Interval:
    (lo, hi), finite = args[0], _all_finite(args)
    for a in args[1:]:
        lo, hi = lo + a[0], hi + a[1]
        slack = EPS * (np.maximum(abs(lo), abs(hi)) + _largest(a))  # of operands that cancel
        if not finite:
            slack = np.where(np.isfinite(slack), slack, 0.0)
        lo, hi = lo - slack, hi + slack
    return lo, hi


def _sum(args: list[Interval]) -> Interval:
    """Rounded outwards at each addend."""
    lo, hi = args[0]
    for low, high in args[1:]:
        lo, hi = lo + low, hi + high
        lo, hi = lo - EPS * abs(lo), hi + EPS * abs(hi)
    return lo, hi


def _roundings(node: Prim) -> int | None:
    """How many correctly rounded operations an arithmetic one is here, one after the other; None if it is others."""
    match node.op, node.args:
        case "neg", _:
            return 0
        case "add", _:
            return 1
        case "mul", args if max(map(args.count, args)) <= 2:
            return len(args) - 1
        case "div", _:
            return 2  # by the reciprocal
        case "pow", (_, Const(value=2.0)):
            return 1
        case _:
            return None


def _largest(a: Interval) -> Any:
    """How large an interval's values may be."""
    return abs(a[0]) if a[0] is a[1] else np.maximum(abs(a[0]), abs(a[1]))


def _neg(node: Prim, args: list[Interval]) -> Interval:
    return -args[0][1], -args[0][0]


def _times(a: Interval, b: Interval, finite: bool) -> Interval:
    for c, (low, high) in ((_number(a), b), (_number(b), a)) if finite else ():
        if c is not None:
            return (low * c, high * c) if c >= 0 else (high * c, low * c)
    if finite:
        corners = [x * y for x in a for y in b]
    else:
        corners = [np.where((x == 0) | (y == 0), 0.0, x * y) for x in a for y in b]
    lo, hi = corners[0], corners[0]
    for c in corners[1:]:
        lo, hi = np.minimum(lo, c), np.maximum(hi, c)
    return lo, hi


def _number(a: Interval) -> float | None:
    """The number that a constant is."""
    return a[0] if a[0].__class__ is float and a[0] == a[1] else None


def _mul(node: Prim, args: list[Interval]) -> Interval:
    by_term, finite = dict(zip(node.args, args, strict=True)), _all_finite(args)
    powers = [_whole_power(interval, node.args.count(arg)) for arg, interval in by_term.items()]
    result = powers[0]
    for power in powers[1:]:
        result = _times(result, power, finite)
    return result


def _inverse(a: Interval) -> Interval:
    apart = (a[0] > 0) | (a[1] < 0)
    return np.where(apart, np.divide(1.0, a[1]), -np.inf), np.where(apart, np.divide(1.0, a[0]), np.inf)


def _div(node: Prim, args: list[Interval]) -> tuple[Any, Any] | tuple[Any, Any, Any]:
    above, (lo, hi) = args
    if _all_finite(args) and np.all((lo > 0) | (hi < 0)):
        return _times(above, (np.divide(1.0, hi), np.divide(1.0, lo)), True)
    return *_times(above, _inverse(args[1]), False), _zero(args[1])


def _zero(a: Interval) -> Any:
    """Where a divisor is 0 all over: the quotient is not a number anywhere."""
    return (np.asarray(a[0]) == 0) & (np.asarray(a[1]) == 0)


def _whole_power(a: Interval, n: int) -> Interval:
    if n == 1:
        return a
    p, q = (a[0] * a[0], a[1] * a[1]) if n == 2 else (np.power(a[0], float(n)), np.power(a[1], float(n)))
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
    whole = (low == high) & (low == np.rint(low))
    fine = (base[0] > 0) | ((base[1] < 0) & whole)
    least, most = np.where(fine, corners.min(axis=0), -np.inf), np.where(fine, corners.max(axis=0), np.inf)
    return least, most, (base[1] < 0) & ~whole  # of what is negative it is one at whole exponents only


_ARITHMETIC: dict[str, Callable[[Prim, list[Interval]], tuple[Any, ...]]] = {
    "add": _add,
    "neg": _neg,
    "mul": _mul,
    "div": _div,
    "pow": _pow,
}
