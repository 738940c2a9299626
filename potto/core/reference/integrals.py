"""Integrals of the oracle: iterated tanh-sinh quadrature between the points where the integrand decides differently.

Owns `integrate` and traces. The integrand is evaluated on a grid with its trace; where the trace changes between two
points, the place is found by bisection. Where a number that decides comes close to 0 without changing sign, its
extremum is looked at too, so that two roots between two points of the grid are found.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any, Protocol

from mpmath import mp
from msgspec import Struct

from potto.core.terms import Delta, Integral, Term

Value = Any  # an mpmath number, a tuple or list of values, a truth value, or a function of values
Environment = Mapping[str, Value]

_SAMPLES = 64  # points of an interval that are looked at in search of places where the integrand jumps or bends
_MOST_SPLITS = 6  # halvings of a piece on which quadrature does not settle
_MOST_TRIES = 4  # at finding a root faster than by halving
_MOST_STEPS = 40  # towards the bottom of a dip


class NotAccurate(ArithmeticError):
    """The oracle cannot vouch for the digits asked for."""


class Trace(Struct):
    """What was decided in one evaluation, in order, and the numbers that decided."""

    sides: list[object] = []
    values: list[Any] = []


class Oracle(Protocol):
    """Who evaluates integrands and bounds, and writes the trace. `forced`: the delta that counts as 1."""

    digits: int
    trace: Trace | None
    deciding: int
    deltas: int
    forced: int | None

    def run(self, term: Term, env: Environment) -> Value: ...


def integrate(oracle: Oracle, term: Integral, env: Environment) -> Value:
    """The iterated integral. In a trace it counts as the sequence of the traces of its pieces."""
    return _level(oracle, term, dict(env), 0)


def _level(oracle: Oracle, term: Integral, env: dict[str, Any], level: int) -> Value:
    if level == len(term.variables):
        return oracle.run(term.body, env)
    lo, hi = (oracle.run(bound, env) for bound in term.bounds[level])
    if lo > hi:
        return _scaled(_between(oracle, term, env, level, hi, lo), -1)
    return _between(oracle, term, env, level, lo, hi)


def _between(oracle: Oracle, term: Integral, env: dict[str, Any], level: int, lo: Any, hi: Any) -> Value:
    def inner(x: Any) -> Value:
        return _level(oracle, term, {**env, term.variables[level]: x}, level + 1)

    outside, forced = oracle.trace, oracle.forced
    oracle.forced = None
    try:
        look = _Look(oracle, inner)
        hints = [oracle.run(hint, env) for hint in term.hints[level]]
        cuts = look.cuts(lo, hi, hints) if lo < hi else []
        if outside is not None and not oracle.deciding:
            look.note(outside, lo, hi, cuts)
            return _zero_like(look.value(_inside(lo, hi))) if lo < hi else mp.mpf(0)
        if not lo < hi:
            return _zero_like(inner(lo)) if mp.isfinite(lo) else mp.mpf(0)
        oracle.trace = None
        value = _pieces(oracle, inner, [lo, *cuts, hi])
        return plus(value, [look.delta_at(cut) for cut in cuts])
    finally:
        oracle.trace, oracle.forced = outside, forced


class _Look:
    """An integrand looked at point by point: its trace, and what it is without looking further."""

    def __init__(self, oracle: Oracle, inner: Callable[[Any], Value]) -> None:
        self.oracle = oracle
        self.inner = inner

    def trace(self, x: Any) -> Trace:
        before = self.oracle.trace
        self.oracle.trace, self.oracle.deltas = Trace(), 0
        try:
            self.inner(x)
            assert self.oracle.trace is not None
            return self.oracle.trace
        finally:
            self.oracle.trace = before

    def value(self, x: Any) -> Value:
        before, self.oracle.trace = self.oracle.trace, None
        try:
            self.oracle.trace = Trace()  # inner integrals are not worked out while a trace is written
            return self.inner(x)
        finally:
            self.oracle.trace = before

    def cuts(self, lo: Any, hi: Any, hints: list[Any]) -> list[Any]:
        """Where the trace changes, and the hints inside."""
        grid = _grid(lo, hi, _SAMPLES, hints)
        traces = [self.trace(x) for x in grid]
        found: set[Any] = set()
        for (a, at_a), (b, at_b) in zip(zip(grid, traces), zip(grid[1:], traces[1:])):
            self.bisect(a, at_a, b, at_b, found)
        for i in range(1, len(grid) - 1):
            self.dips(grid[i - 1 : i + 2], traces[i - 1 : i + 2], found)
        found.update(h for h in hints if lo < h < hi)
        tiny = 64 * mp.eps * max(abs(x) for x in (lo, hi, 0) if mp.isfinite(x))
        return sorted(x for x in found if lo + tiny < x < hi - tiny)

    def bisect(self, a: Any, at_a: Trace, b: Any, at_b: Trace, found: set[Any]) -> None:
        """Every change of trace between a and b, as far as halving sees it."""
        stack = [(a, at_a, b, at_b, _MOST_TRIES)]
        while stack:
            a, at_a, b, at_b, tries = stack.pop()
            if at_a.sides == at_b.sides:
                continue
            root = self.root(a, at_a, b, at_b) if tries else None
            if root is not None:
                found.add(root)
                continue
            middle = (a + b) / 2
            if b - a <= 8 * mp.eps * max(abs(a), abs(b), mp.mpf(10) ** -mp.dps):
                found.add(middle)
                continue
            at_middle = self.trace(middle)
            stack.append((middle, at_middle, b, at_b, max(tries - 1, 0)))
            stack.append((a, at_a, middle, at_middle, max(tries - 1, 0)))

    def root(self, a: Any, at_a: Trace, b: Any, at_b: Trace) -> Any:
        """The only change of trace between a and b, if it is the root of a number: found faster than by halving."""
        pairs = zip(at_a.sides, at_b.sides)
        k = next((k for k, (side, other) in enumerate(pairs) if side != other), None)
        if k is None or at_a.values[k] is None or at_b.values[k] is None:
            return None
        tiny = 64 * mp.eps * max(abs(a), abs(b), mp.mpf(10) ** -mp.dps)
        lo, hi, f_lo, f_hi = a, b, at_a.values[k], at_b.values[k]
        x = lo
        for _ in range(_MOST_STEPS):
            if not f_lo * f_hi < 0:
                break
            x, before = (lo * f_hi - hi * f_lo) / (f_hi - f_lo), x
            trace = self.trace(x)
            if len(trace.values) <= k or trace.sides[:k] != at_a.sides[:k]:
                return None
            value = trace.values[k]
            if value == 0 or abs(x - before) < tiny / 8:
                break
            if value * f_hi < 0:
                lo, f_lo, hi, f_hi = hi, f_hi, x, value
            else:
                hi, f_hi, f_lo = x, value, f_lo / 2  # Illinois: an end that stays counts for less each time
        if not a < x - tiny < x + tiny < b:
            return None
        alone = self.trace(x - tiny).sides == at_a.sides and self.trace(x + tiny).sides == at_b.sides
        return x if alone else None

    def dips(self, points: list[Any], traces: list[Trace], found: set[Any]) -> None:
        """Two changes of one sign between neighbours: a number that decides has a dip there."""
        left, middle, right = traces
        if not left.sides == middle.sides == right.sides:
            return
        for k, value in enumerate(middle.values):
            if value is None or left.values[k] is None or right.values[k] is None:
                continue
            if abs(value) <= abs(left.values[k]) and abs(value) <= abs(right.values[k]) and value != 0:
                bottom = self.bottom(points, traces, k)
                if bottom is not None:
                    at_bottom = self.trace(bottom)
                    self.bisect(points[0], left, bottom, at_bottom, found)
                    self.bisect(bottom, at_bottom, points[2], right, found)

    def bottom(self, points: list[Any], traces: list[Trace], k: int) -> Any:
        """A point near the dip of number k at which the trace is another one; None if there is none."""
        x, f = list(points), [abs(t.values[k]) for t in traces]
        for _ in range(_MOST_STEPS):
            vertex, depth = _parabola(x, f)
            if vertex is None or not x[0] < vertex < x[2]:
                return None
            if abs(vertex - x[1]) <= mp.mpf(10) ** -(mp.dps // 2) * max(abs(vertex), 1):
                return None
            trace = self.trace(vertex)
            if trace.sides != traces[1].sides:
                return vertex
            height = abs(trace.values[k])
            if abs(height - depth) < height / 1000 and height > max(f) / 1000:
                return None  # well described by the parabola, and far from 0
            _narrow(x, f, vertex, height)
        return None

    def note(self, outside: Trace, lo: Any, hi: Any, cuts: list[Any]) -> None:
        """What an outer integral sees of this one: the traces at both ends, then those between cuts in order.

        The ends come first because a number decides there, whose root is found faster than by halving.
        """
        if not lo < hi:
            outside.sides.append("empty")
            outside.values.append(None)
            return
        for x in (lo, hi):
            if mp.isfinite(x):
                trace = self.trace(x)
                outside.sides += _touching(trace)
                outside.values += trace.values
        middles = [tuple(self.trace(_inside(a, b)).sides) for a, b in pairwise([lo, *cuts, hi])]
        outside.sides.append(tuple(m for i, m in enumerate(middles) if i == 0 or m != middles[i - 1]))
        outside.values.append(None)

    def delta_at(self, x: Any) -> Value:
        """The factors of the deltas that have their root here, over the slopes of what is under them."""
        step = mp.mpf(10) ** -(mp.dps // 3) * max(abs(x), 1)
        before, after = self.trace(x - step), self.trace(x + step)
        total = mp.mpf(0)
        number = -1
        for k, (side, other) in enumerate(zip(before.sides, after.sides)):
            if not (isinstance(side, tuple) and isinstance(side[0], Delta)):
                continue
            number += 1
            if side != other:
                slope = mp.diff(lambda s, k=k: self.trace(s).values[k], x)
                total = plus(total, [_scaled(self.factor(x, number), 1 / abs(slope))])
        return total

    def factor(self, x: Any, number: int) -> Value:
        """What multiplies a delta: the integrand with it counted as 1, minus the integrand without it."""
        values = []
        for forced in (number, None):
            self.oracle.forced, self.oracle.deltas, self.oracle.trace = forced, 0, None
            values.append(self.inner(x))
        self.oracle.forced = None
        return plus(values[0], [_scaled(values[1], -1)])


def _touching(trace: Trace) -> list[object]:
    """Sides at the end of an interval, where a surface may follow the end: rounding must not count as a change."""
    tiny = mp.mpf(10) ** -(mp.dps - 8)
    return [
        "touches" if value is not None and abs(value) < tiny else side
        for side, value in zip(trace.sides, trace.values, strict=True)
    ]


def _parabola(x: list[Any], f: list[Any]) -> tuple[Any, Any]:
    """Where the parabola through three points is least, and its value there."""
    left, right = x[1] - x[0], x[2] - x[1]
    below, above = (f[1] - f[0]) / left, (f[2] - f[1]) / right
    curvature = (above - below) / (left + right)
    if not curvature > 0:
        return None, None
    slope = below + curvature * left
    return x[1] - slope / (2 * curvature), f[1] - slope * slope / (4 * curvature)


def _narrow(x: list[Any], f: list[Any], point: Any, height: Any) -> None:
    """Put a point into a bracket of three, the lowest in the middle."""
    at = 0 if point < x[1] else 2
    if height <= f[1]:
        x[2 - at], f[2 - at] = x[1], f[1]
        x[1], f[1] = point, height
    else:
        x[at], f[at] = point, height


def _grid(lo: Any, hi: Any, count: int, hints: list[Any]) -> list[Any]:
    """Points from lo to hi, both included where finite, slightly irregular so that no pattern is met exactly."""
    steps = [mp.mpf(i) / count for i in range(count + 1)]
    steps = [s + (mp.mpf("0.13") / count) * s * (1 - s) for s in steps]
    if mp.isfinite(lo) and mp.isfinite(hi):
        points = [lo + (hi - lo) * s for s in steps]
        points[-1] = hi
    elif mp.isfinite(lo):
        points = [lo + s / (1 - s) for s in steps[:-1]]
    elif mp.isfinite(hi):
        points = [hi - (1 - s) / s for s in steps[1:]]
    else:
        points = [(2 * s - 1) / (s * (1 - s)) for s in steps[1:-1]]
    return sorted({*points, *(h for h in hints if lo < h < hi)})


def _inside(a: Any, b: Any) -> Any:
    """A point between a and b, which may be infinite."""
    if mp.isfinite(a) and mp.isfinite(b):
        return a + (b - a) * mp.mpf("0.4871")
    if mp.isfinite(a):
        return a + 1
    return b - 1 if mp.isfinite(b) else mp.mpf(0)


def _pieces(oracle: Oracle, inner: Callable[[Any], Value], ends: list[Any]) -> Value:
    shape = _Look(oracle, inner).value(_inside(ends[0], ends[-1]))
    if isinstance(shape, tuple | list):
        parts = []
        for i in range(len(shape)):
            parts.append(_pieces(oracle, lambda x, i=i: inner(x)[i], ends))  # type: ignore[misc]
        return type(shape)(parts)
    return sum((_piece(oracle, inner, a, b, 0) for a, b in pairwise(ends)), mp.mpf(0))


def _piece(oracle: Oracle, f: Callable[[Any], Any], a: Any, b: Any, splits: int) -> Any:
    # A node that is rounded to an end, where the integrand need not exist, has no weight to speak of.
    # Next to a singular end x has few digits of its distance from there: those of a second try are enough.
    for precision in (mp.dps, 2 * mp.dps):
        with mp.workdps(precision):
            value, error = mp.quad(lambda x: f(x) if a < x < b else mp.mpf(0), [a, b], error=True)
        if error <= mp.mpf(10) ** -(oracle.digits + 5) * max(abs(value), 1):
            return value
    if splits == _MOST_SPLITS:
        raise NotAccurate(f"the integral from {a} to {b} is {value} with an error of {error}")
    middle = _inside(a, b)
    return _piece(oracle, f, a, middle, splits + 1) + _piece(oracle, f, middle, b, splits + 1)


def _scaled(value: Value, factor: Any) -> Value:
    return type(value)(_scaled(v, factor) for v in value) if isinstance(value, tuple | list) else value * factor


def _zero_like(value: Value) -> Value:
    return type(value)(map(_zero_like, value)) if isinstance(value, tuple | list) else mp.mpf(0)


def size(value: Value) -> Any:
    """The largest number in a value, without its sign."""
    return max(map(size, value), default=mp.mpf(0)) if isinstance(value, tuple | list) else abs(value)


def plus(value: Value, others: list[Value]) -> Value:
    """The sum of numbers, or of tuples and arrays component by component."""
    for other in others:
        if isinstance(value, tuple | list):
            other = other if isinstance(other, tuple | list) else (other,) * len(value)
            value = type(value)(plus(v, [o]) for v, o in zip(value, other, strict=True))
        elif isinstance(other, tuple | list):
            value = plus(type(other)((value,) * len(other)), [other])
        else:
            value = value + other
    return value
