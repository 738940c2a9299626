"""The tree walk of the oracle: environments, calls, choices and what they decided.

Owns `evaluate`. While an integrand is evaluated, every choice (a branch, a condition, the side of a kink, the sign
under a delta) is noted in a trace; `integrals` cuts where the trace changes.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Any

from mpmath import mp
from msgspec import Struct

from potto.core.reference import differences, integrals
from potto.core.reference.functions import function
from potto.core.reference.integrals import Environment, Trace, Value
from potto.core.terms import (
    App,
    Array,
    Branch,
    Const,
    Data,
    Delta,
    Deriv,
    Fold,
    Global,
    Hole,
    If,
    Index,
    Integral,
    Lam,
    Length,
    ListOf,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    var,
)
from potto.primitives import PRIMITIVES

Lookup = Callable[[str, str], Term]

GUARD = 15  # digits beyond those asked for
_NAMED = {"pi": lambda: +mp.pi, "inf": lambda: mp.inf}
_DEEP = 60_000
_SETTLED = 8  # terms in a row after whose like an endless sum ends


def evaluate(
    term: Term,
    env: Mapping[str, Any] | None = None,
    lookup: Lookup | None = None,
    digits: int = 30,
    data: Mapping[tuple[str, str], Any] | None = None,
) -> Value:
    """The value of a term, to about `digits` digits: an mpmath number, a tuple, a list or a function.

    `env` gives its free variables, `lookup` other definitions by module and name. `data`: what files hold, by path and
    column.
    """
    with mp.workdps(digits + GUARD), _deep_recursion():
        values = {name: as_value(value) for name, value in (env or {}).items()}
        held = {place: as_value(value) for place, value in (data or {}).items()}
        return ReferenceWalk(lookup, digits, held).run(term, values)


@contextlib.contextmanager
def _deep_recursion() -> Iterator[None]:
    """Walking recurses as deep as the term: Python's default limit is for programs that don't."""
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, _DEEP))
    try:
        yield
    finally:
        sys.setrecursionlimit(before)


def as_value(value: Any) -> Value:
    """Host data as values: numbers become mpmath numbers, exactly."""
    if isinstance(value, tuple):
        return tuple(map(as_value, value))
    if isinstance(value, list):
        return list(map(as_value, value))
    return value if callable(value) or isinstance(value, bool) else mp.mpf(value)


class ReferenceWalk:
    """One evaluation: how definitions are found, how exact it is, and the trace that is being written."""

    def __init__(self, lookup: Lookup | None, digits: int, data: Mapping[tuple[str, str], Value]) -> None:
        self.lookup = lookup
        self.data = data
        self.digits = digits
        self.trace: Trace | None = None
        self.deciding = 0
        self.deltas = 0  # deltas met in this evaluation so far
        self.forced: int | None = None  # the delta that counts as 1; others count as 0

    def run(self, term: Term, env: Environment) -> Value:
        """The value of a term: one match over all kinds there are, which is as long as their list."""
        match term:
            case Const(name=str(name)) if name in _NAMED:
                return _NAMED[name]()
            case Const(value=value):
                return mp.mpf(value)
            case Var(name=name):
                return env[name]
            case Prim():
                return self.builtin(term, env)
            case If():
                holds = self.decide(term.condition, env)
                self.note(term, holds, None)
                return self.run(term.then if holds else term.orelse, env)
            case Branch():
                side = self.decide(term.surface, env)
                holds = side > 0 if term.strict else side >= 0
                self.note(term, bool(holds), side)
                return self.run(term.then if holds else term.orelse, env)
            case Tuple(items=items):
                return tuple(self.run(item, env) for item in items)
            case ListOf(items=items):
                return [self.run(item, env) for item in items]
            case Proj():
                return self.run(term.term, env)[term.index]
            case Lam():
                return _Closure(self, term, env)
            case App(function=function, args=args):
                return differences.call(self.run(function, env), tuple(self.run(arg, env) for arg in args))
            case Global(module=module, name=name):
                if self.lookup is None:
                    raise KeyError(f"{module}.{name}: there is no lookup")
                return self.run(self.lookup(module, name), {})
            case Integral():
                return integrals.integrate(self, term, env)
            case Delta():
                return self.delta(term, env)
            case Sum():
                return self.sum(term, env)
            case Fold():
                return self.fold(term, env)
            case Array():
                count = int(self.run(term.size, env))
                return [self.run(term.body, {**env, term.variable: mp.mpf(place)}) for place in range(count)]
            case Index():
                return self.element(self.run(term.array, env), self.decide(term.index, env))
            case Length():
                if term.like is not None and len(self.run(term.like, env)) != len(self.run(term.array, env)):
                    raise ValueError("sizes that do not agree")
                return self.length(self.run(term.array, env), term)
            case Data(path=path, column=column):
                return self.data[path, column]
            case Deriv(function=inner):
                return differences.derivative(self.run(inner, env), self.digits)
            case Hole(reason=reason):
                raise ValueError(f"the program is wrong here: {reason}")

    def decide(self, term: Term, env: Environment) -> Value:
        """What a choice depends on, worked out in full also while a trace is written."""
        self.deciding += 1
        try:
            return self.run(term, env)
        finally:
            self.deciding -= 1

    def note(self, term: Term, side: object, value: Any) -> None:
        if self.trace is not None:
            self.trace.sides.append((term, side))
            self.trace.values.append(value)

    def builtin(self, term: Prim, env: Environment) -> Value:
        kinks = _kinks(term.op, len(term.args))
        run = self.decide if kinks else self.run
        args = [run(arg, env) for arg in term.args]
        result = function(term.op)(*args)
        if self.trace is not None:
            for kink in kinks:
                margin = self.decide(kink, dict(zip(_PLACES, args, strict=False)))
                self.note(term, bool(margin >= 0), margin)
        return result

    def delta(self, term: Delta, env: Environment) -> Value:
        """0, or 1 for the one whose factor is asked for; its sign is noted, so that cuts lie where it counts."""
        side = self.decide(term.coordinates[0], env)
        self.note(term, bool(side >= 0), side)
        self.deltas += 1
        return mp.mpf(1 if self.forced == self.deltas - 1 else 0)

    def sum(self, term: Sum, env: Environment) -> Value:
        lo, hi = int(mp.ceil(self.run(term.lo, env))), int(mp.floor(self.run(term.hi, env)))
        parts = [self.run(term.body, {**env, term.variable: mp.mpf(i)}) for i in range(lo, hi + 1)]
        sizes = [integrals.size(part) for part in parts] if term.endless else [mp.mpf(0)]
        while any(size > mp.eps * max(sizes) for size in sizes[-_SETTLED:]):
            parts.append(self.run(term.body, {**env, term.variable: mp.mpf(lo + len(parts))}))
            sizes.append(integrals.size(parts[-1]))
        return integrals.plus(parts[0], parts[1:]) if parts else mp.mpf(0)

    def fold(self, term: Fold, env: Environment) -> Value:
        lo, hi = int(mp.ceil(self.run(term.lo, env))), int(mp.floor(self.run(term.hi, env)))
        state = self.run(term.start, env)
        for place in range(lo, hi + 1):
            state = self.run(term.body, {**env, term.variable: mp.mpf(place), term.state: state})
        return state

    def length(self, whole: Value, term: Length) -> Value:
        if term.filled:
            self.element(whole, 0)
        if term.rising and not all(a < b for a, b in pairwise(whole)):
            raise ValueError("places that do not rise")
        return mp.mpf(len(whole))

    def element(self, whole: Value, place: Any) -> Value:
        if int(place) != place or not 0 <= place < len(whole):
            raise IndexError(f"the index {place} of an array of {len(whole)}")
        return whole[int(place)]


_PLACES = tuple(f"#{i}" for i in range(1000))


@lru_cache(maxsize=256)
def _kinks(op: str, arity: int) -> tuple[Term, ...]:
    """The kinks of a builtin over places for its arguments."""
    return PRIMITIVES[op].kinks(*map(var, _PLACES[:arity]))


class _Closure(Struct, frozen=True):
    oracle: ReferenceWalk
    term: Lam
    env: Environment

    def __call__(self, *args: Value) -> Value:
        return self.oracle.run(self.term.body, {**self.env, **dict(zip(self.term.params, args, strict=True))})

    @property
    def arity(self) -> int:
        return len(self.term.params)
