"""Which values a term can take, as far as its form and the ranges of its variables show.

Owns `ranges` (interval arithmetic over a whole term) and the sign tests on top of it. Everything is conservative: a
range may be too wide, never too narrow; bounds are rounded outwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from weakref import WeakKeyDictionary

from msgspec import Struct

from potto.calculus.algebra.floats import OPS
from potto.core.terms import Branch, Const, If, Prim, Term, unknown
from potto.primitives import PRIMITIVES
from potto.primitives.bounds import between_turns
from potto.primitives.registry import Primitive
from potto.primitives.walking import Domain

Box = Mapping[str, tuple[float, float]]  # of each variable the lowest and the highest value


class ValueRange(Struct, frozen=True):
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


ANYTHING = ValueRange(-math.inf, math.inf)
_POSITIVE = ValueRange(0.0, math.inf, False)
_NONNEGATIVE = ValueRange(0.0, math.inf)


def _range(lo: float, hi: float, zero: bool = True) -> ValueRange:
    """Rounded outwards; nan (inf - inf, 0 * inf) becomes no bound. A sign that was certain stays."""
    low = -math.inf if lo != lo else (lo if lo == 0 or math.isinf(lo) else math.nextafter(lo, -math.inf))
    high = math.inf if hi != hi else (hi if hi == 0 or math.isinf(hi) else math.nextafter(hi, math.inf))
    return ValueRange(low, high, zero and low <= 0 <= high)


def ranges(term: Term, box: Mapping[str, tuple[float, float]] | None = None) -> dict[Term, ValueRange]:
    """The range of every subterm; `box` bounds variables."""
    bounds = {name: (min(ends), max(ends)) for name, ends in (box or {}).items()}
    found: dict[Term, ValueRange] = {}
    RANGES.walk((term,), {name: ValueRange(lo, hi, lo <= 0 <= hi) for name, (lo, hi) in bounds.items()}, found)
    return found


# What the form alone shows, kept as long as the term lives: roots are built up and asked about step by step.
_known: WeakKeyDictionary[Term, ValueRange] = WeakKeyDictionary()


def range_of(term: Term, box: Mapping[str, tuple[float, float]] | None = None) -> ValueRange:
    if box:
        return ranges(term, box)[term]
    for node in unknown(term, _known):
        _known[node] = RANGES.node(node, {}, _known)
    return _known[term]


def positive(term: Term) -> bool:
    """Whether a term is > 0 wherever it is defined, as far as its form shows."""
    return range_of(term).positive


def vanishing(term: Term) -> Iterator[Term]:
    """What a term is 0 with: its factors, but for those that show by their form that they never are."""
    waiting = [term]
    while waiting:
        match waiting.pop():
            case Prim(op="mul", args=args):
                waiting.extend(reversed(args))
            case Prim(op="neg" | "div", args=(inner, *_)):
                waiting.append(inner)
            case Prim(op="pow", args=(inner, exponent)) if not range_of(exponent).hi <= 0:
                waiting.append(inner)
            case Prim(op=op, args=(inner,)) if PRIMITIVES[op].roots == (0.0,):
                waiting.append(inner)
            case factor if factor.free and not positive(factor):
                yield factor
            case _:
                pass


def nonnegative(term: Term) -> bool:
    return range_of(term).lo >= 0


class _Ranges(Domain[ValueRange]):
    """Ranges of builtins: arithmetic as below, everything else by the rules of the entries."""

    def constant(self, node: Const) -> ValueRange:
        return ValueRange(node.value, node.value, node.value == 0) if node.value == node.value else ANYTHING

    def unknown(self) -> ValueRange:
        return ANYTHING

    def other(self, node: Term, known: Mapping[Term, ValueRange]) -> ValueRange:
        if not isinstance(node, If | Branch):
            return ANYTHING
        then, orelse = known[node.then], known[node.orelse]
        return ValueRange(min(then.lo, orelse.lo), max(then.hi, orelse.hi), then.zero or orelse.zero)

    def builtin(self, node: Prim, known: Mapping[Term, ValueRange]) -> ValueRange:
        rule = ARITHMETIC.get(node.op)
        args = [known[arg] for arg in node.args]
        return rule(node, args) if rule is not None else self.apply(node.op, args)

    def does(self, op: str) -> bool:
        return op in ARITHMETIC

    def rule(self, entry: Primitive) -> Callable[..., ValueRange] | None:
        return _rule(entry.name)


RANGES = _Ranges()


@lru_cache(maxsize=256)
def _rule(op: str) -> Callable[..., ValueRange] | None:
    entry = PRIMITIVES[op]
    if entry.interval is None and not entry.piecewise_monotone:
        return None
    return lambda *args: _bounded(entry, args)


def _bounded(entry: Primitive, args: tuple[ValueRange, ...]) -> ValueRange:
    """By the entry's rule, with room for what a libm may be off; a sign that is certain stays."""
    bounds = [(a.lo, a.hi) for a in args]
    if entry.interval is not None:
        lo, hi = entry.interval(OPS, *bounds)[:2]
    else:
        lo, hi, nowhere = between_turns(OPS, entry.name, entry.within, entry.turns or (), bounds[0])
        if nowhere:
            return ANYTHING
    places = max(1.0, *(entry.places(*ends) for ends in zip(*bounds, strict=True)))
    room = 2e-15 * places if places < math.inf else 0.0  # eight of the last places of a good one
    off = max(0.0, *(entry.strays(*ends) for ends in zip(*bounds, strict=True)))  # nan at infinity
    low, high = ((e + s * (room * abs(e) + off) if math.isfinite(e) else e) for e, s in ((lo, -1), (hi, 1)))
    found = _range(low, high, _may_vanish(entry, args))
    return ValueRange(max(found.lo, entry.image[0]), min(found.hi, entry.image[1]), found.zero)


def _may_vanish(entry: Primitive, args: tuple[ValueRange, ...]) -> bool:
    """Whether 0 may be a value, by where the roots are."""
    if entry.roots is None:
        return True
    if entry.arity == 1:
        (a,) = args
        return any(a.zero if root == 0 else a.lo <= root <= a.hi for root in entry.roots)
    return entry.roots != (0.0,) or all(a.zero for a in args)


def _add(node: Prim, args: list[ValueRange]) -> ValueRange:
    lo, hi = math.fsum(a.lo for a in args if a.lo != -math.inf), math.fsum(a.hi for a in args if a.hi != math.inf)
    low = -math.inf if any(a.lo == -math.inf for a in args) else lo
    high = math.inf if any(a.hi == math.inf for a in args) else hi
    up = all(a.lo >= 0 for a in args) and any(a.positive for a in args)
    down = all(a.hi <= 0 for a in args) and any(a.negative for a in args)
    return _range(low, high, not (up or down))


def _neg(node: Prim, args: list[ValueRange]) -> ValueRange:
    return ValueRange(-args[0].hi, -args[0].lo, args[0].zero)


def _times(a: ValueRange, b: ValueRange) -> ValueRange:
    corners = [0.0 if x == 0 or y == 0 else x * y for x in (a.lo, a.hi) for y in (b.lo, b.hi)]
    return _range(min(corners), max(corners), a.zero or b.zero)


def _mul(node: Prim, args: list[ValueRange]) -> ValueRange:
    result = ValueRange(1.0, 1.0, False)
    counts: dict[Term, int] = {}
    by_term = dict(zip(node.args, args, strict=True))
    for arg in node.args:
        counts[arg] = counts.get(arg, 0) + 1
    for arg, count in counts.items():
        result = _times(result, _whole_power(by_term[arg], count))
    return result


def _inverse(a: ValueRange) -> ValueRange:
    if a.positive or a.negative:
        lo = 1 / a.hi if a.hi else -math.inf
        hi = 1 / a.lo if a.lo else math.inf
        return _range(lo, hi, False)
    return ValueRange(-math.inf, math.inf, False)


def _div(node: Prim, args: list[ValueRange]) -> ValueRange:
    top, below = args
    return _times(top, _inverse(below))


def _whole_power(a: ValueRange, n: int) -> ValueRange:
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


def _pow(node: Prim, args: list[ValueRange]) -> ValueRange:
    base, exponent = args[0], node.args[1]
    if isinstance(exponent, Const) and exponent.value == exponent.value:
        power = exponent.value
        if power.is_integer() and 0 < abs(power) < 1e6:
            whole = _whole_power(base, int(abs(power)))
            return whole if power > 0 else _inverse(whole)
        return _POSITIVE if base.positive or power < 0 else _NONNEGATIVE
    return _POSITIVE if base.positive else ANYTHING


ARITHMETIC: dict[str, Callable[[Prim, list[ValueRange]], ValueRange]] = {
    "add": _add,
    "neg": _neg,
    "mul": _mul,
    "div": _div,
    "pow": _pow,
}
