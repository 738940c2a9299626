"""Which values a term can take, as far as its form and the ranges of its variables show.

Owns `ranges` (interval arithmetic over a whole term) and the sign tests on top of it. Everything is conservative: a
range may be too wide, never too narrow; bounds are rounded outwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from potto.core.terms import Branch, Const, If, Prim, Term, Var, children, postorder


@dataclass(frozen=True, slots=True)
class Range:
    """Values lie in [lo, hi]; `zero` says whether 0 may be one of them (exp never is)."""

    lo: float
    hi: float
    zero: bool = True

    @property
    def positive(self) -> bool:
        return self.lo > 0 or (self.lo >= 0 and not self.zero)

    @property
    def negative(self) -> bool:
        return self.hi < 0 or (self.hi <= 0 and not self.zero)


ANYTHING = Range(-math.inf, math.inf)
_POSITIVE = Range(0.0, math.inf, False)
_NONNEGATIVE = Range(0.0, math.inf)


def _range(lo: float, hi: float, zero: bool = True) -> Range:
    """Rounded outwards; nan (inf - inf, 0 * inf) becomes no bound. A sign that was certain stays."""
    low = -math.inf if lo != lo else (lo if lo == 0 or math.isinf(lo) else math.nextafter(lo, -math.inf))
    high = math.inf if hi != hi else (hi if hi == 0 or math.isinf(hi) else math.nextafter(hi, math.inf))
    return Range(low, high, zero and low <= 0 <= high)


def ranges(term: Term, box: Mapping[str, tuple[float, float]] | None = None) -> dict[Term, Range]:
    """The range of every subterm; `box` bounds variables."""
    box = box or {}
    found: dict[Term, Range] = {}
    for node in postorder(term):
        found[node] = _node(node, found, box)
    return found


# What the form alone shows, kept as long as the term lives: roots are built up and asked about step by step.
_known: WeakKeyDictionary[Term, Range] = WeakKeyDictionary()


def range_of(term: Term, box: Mapping[str, tuple[float, float]] | None = None) -> Range:
    if box:
        return ranges(term, box)[term]
    stack = [term]
    while stack:
        node = stack[-1]
        missing = [c for c in children(node) if c not in _known]
        if node in _known or not missing:
            stack.pop()
            if node not in _known:
                _known[node] = _node(node, _known, {})
        else:
            stack.extend(missing)
    return _known[term]


def positive(term: Term) -> bool:
    """Whether a term is > 0 wherever it is defined, as far as its form shows."""
    return range_of(term).positive


def nonnegative(term: Term) -> bool:
    return range_of(term).lo >= 0


def _node(node: Term, found: Mapping[Term, Range], box: Mapping[str, tuple[float, float]]) -> Range:
    match node:
        case Const(value=value) if value == value:
            return Range(value, value, value == 0)
        case Var(name=name) if name in box:
            lo, hi = min(box[name]), max(box[name])
            return Range(lo, hi, lo <= 0 <= hi)
        case If() | Branch():
            then, orelse = found[node.then], found[node.orelse]
            return Range(min(then.lo, orelse.lo), max(then.hi, orelse.hi), then.zero or orelse.zero)
        case Prim(op=op, args=args) if op in _RULES:
            return _RULES[op](node, [found[a] for a in args])
        case _:
            return ANYTHING


def _add(node: Prim, args: list[Range]) -> Range:
    lo, hi = math.fsum(a.lo for a in args if a.lo != -math.inf), math.fsum(a.hi for a in args if a.hi != math.inf)
    low = -math.inf if any(a.lo == -math.inf for a in args) else lo
    high = math.inf if any(a.hi == math.inf for a in args) else hi
    up = all(a.lo >= 0 for a in args) and any(a.positive for a in args)
    down = all(a.hi <= 0 for a in args) and any(a.negative for a in args)
    return _range(low, high, not (up or down))


def _neg(node: Prim, args: list[Range]) -> Range:
    return Range(-args[0].hi, -args[0].lo, args[0].zero)


def _times(a: Range, b: Range) -> Range:
    corners = [0.0 if x == 0 or y == 0 else x * y for x in (a.lo, a.hi) for y in (b.lo, b.hi)]
    return _range(min(corners), max(corners), a.zero or b.zero)


def _mul(node: Prim, args: list[Range]) -> Range:
    result = Range(1.0, 1.0, False)
    counts: dict[Term, int] = {}
    by_term = dict(zip(node.args, args, strict=True))
    for arg in node.args:
        counts[arg] = counts.get(arg, 0) + 1
    for arg, count in counts.items():
        result = _times(result, _whole_power(by_term[arg], count))
    return result


def _inverse(a: Range) -> Range:
    if a.positive or a.negative:
        lo = 1 / a.hi if a.hi else -math.inf
        hi = 1 / a.lo if a.lo else math.inf
        return _range(lo, hi, False)
    return Range(-math.inf, math.inf, False)


def _div(node: Prim, args: list[Range]) -> Range:
    top, below = args
    return _times(top, _inverse(below))


def _whole_power(a: Range, n: int) -> Range:
    def raised(x: float) -> float:
        try:
            return float(x**n)
        except OverflowError:
            return math.inf if x > 0 or n % 2 == 0 else -math.inf

    ends = (raised(a.lo), raised(a.hi))
    if n % 2 == 0:
        inside = a.lo <= 0 <= a.hi
        return _range(0.0 if inside else min(ends), max(ends), a.zero)
    return _range(*ends, a.zero)


def _pow(node: Prim, args: list[Range]) -> Range:
    base, exponent = args[0], node.args[1]
    if isinstance(exponent, Const) and exponent.value == exponent.value:
        power = exponent.value
        if power.is_integer() and 0 < abs(power) < 1e6:
            whole = _whole_power(base, int(abs(power)))
            return whole if power > 0 else _inverse(whole)
        return _POSITIVE if base.positive or power < 0 else _NONNEGATIVE
    return _POSITIVE if base.positive else ANYTHING


def _monotone(function: Callable[[float], float]) -> Callable[[Prim, list[Range]], Range]:
    def run(node: Prim, args: list[Range]) -> Range:
        ends = []
        for x in (args[0].lo, args[0].hi):
            try:
                ends.append(function(x))
            except OverflowError:
                ends.append(math.copysign(math.inf, x))
            except ValueError:
                ends.append(math.nan)
        # A libm may be off by a few last places: leave room for eight.
        slack = [abs(e) * 2e-15 if math.isfinite(e) else 0.0 for e in ends]
        return _range(ends[0] - slack[0], ends[1] + slack[1], args[0].zero)

    return run


def _exp(node: Prim, args: list[Range]) -> Range:
    wide = _monotone(math.exp)(node, args)
    return Range(max(wide.lo, 0.0), wide.hi, False)


def _cosh(node: Prim, args: list[Range]) -> Range:
    return Range(1.0, math.inf, False)


def _sqrt(node: Prim, args: list[Range]) -> Range:
    return _POSITIVE if args[0].positive else _NONNEGATIVE


def _abs(node: Prim, args: list[Range]) -> Range:
    (a,) = args
    inside = a.lo <= 0 <= a.hi
    return Range(0.0 if inside else min(abs(a.lo), abs(a.hi)), max(abs(a.lo), abs(a.hi)), a.zero)


def _hypot(node: Prim, args: list[Range]) -> Range:
    return Range(0.0, math.inf, all(a.zero for a in args))


def _unit(node: Prim, args: list[Range]) -> Range:
    return Range(-1.0, 1.0)


def _min(node: Prim, args: list[Range]) -> Range:
    return Range(min(a.lo for a in args), min(a.hi for a in args), any(a.zero for a in args))


def _max(node: Prim, args: list[Range]) -> Range:
    return Range(max(a.lo for a in args), max(a.hi for a in args), any(a.zero for a in args))


def _log(node: Prim, args: list[Range]) -> Range:
    lo = math.log(args[0].lo) if args[0].lo > 0 else -math.inf
    hi = math.log(args[0].hi) if args[0].hi > 0 else math.inf
    return _range(lo * (1 - 1e-15) if lo > 0 else lo * (1 + 1e-15), hi * (1 + 1e-15) if hi > 0 else hi * (1 - 1e-15))


_RULES: dict[str, Callable[[Prim, list[Range]], Range]] = {
    "add": _add,
    "neg": _neg,
    "mul": _mul,
    "div": _div,
    "pow": _pow,
    "exp": _exp,
    "cosh": _cosh,
    "sqrt": _sqrt,
    "abs": _abs,
    "hypot": _hypot,
    "sin": _unit,
    "cos": _unit,
    "tanh": _monotone(math.tanh),
    "atan": _monotone(math.atan),
    "sinh": _monotone(math.sinh),
    "erf": _monotone(math.erf),
    "expm1": _monotone(math.expm1),
    "erfc": lambda node, args: Range(0.0, 2.0, False),
    "min": _min,
    "max": _max,
    "log": _log,
}
