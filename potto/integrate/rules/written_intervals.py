"""Interval arithmetic written down: the operations on bounds that enclose a term, for whoever carries them out.

Owns `WrittenInterval`. The bounds are those of `intervals` but for how they are rounded outwards, which neither
promises to the bit. No question is asked of a number, so that where something overflows bounds come out that are nan,
or infinite: then `intervals` knows what follows from that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial, reduce
from typing import Any, NamedTuple, Protocol

import numpy as np

from potto.core.terms import Branch, Const, If, Prim, Term
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.intervals import ANYTHING, ROUNDING, interval_of
from potto.kernels.native.operations import FUNCTIONS, NotStraight
from potto.primitives import PRIMITIVES, Primitive
from potto.primitives.walking import Domain, Rule

MOST_POWER = 8


class Names(NamedTuple):
    """The bounds of a term. nowhere: a mask that tells where it has no value, whatever they say, if there may be such
    places. wild: whether they may be infinite by what it is made of, and not for want of larger numbers."""

    low: str
    high: str
    nowhere: str | None = None
    wild: bool = False


class Carrier(Protocol):
    """What operations are written into, such as `kernels.native.vectors.Vectors`."""

    def number(self, value: float) -> str: ...
    def apply(self, code: str, *args: str) -> str: ...


class WrittenInterval(Domain[Names]):
    """Intervals whose bounds are names of numbers in a text."""

    def __init__(self, at: Carrier) -> None:
        self.at = at

    def constant(self, node: Const) -> Names:
        return Names(self.number(node.value), self.number(node.value))

    def number(self, value: float) -> str:
        return self.at.number(value)

    def rule(self, entry: Primitive) -> Rule[Names] | None:
        """The rule of the entry, whose arithmetic is written down as it is done."""
        found, ulp, off = interval_of(entry), entry.ulp, entry.off
        if found is None:
            return None
        if callable(ulp) or callable(off):
            raise NotStraight(entry.name)

        def run(*args: Names) -> Names:
            result = found(_Ops(self.at), *((_Number(self.at, a.low), _Number(self.at, a.high)) for a in args))
            nowhere = _mask_name(result[2]) if len(result) == 3 and entry.within != ANYTHING else None
            ends = Names(_name(self.at, result[0]), _name(self.at, result[1]), nowhere)
            low, high, *_ = self.outwards(ends, ROUNDING if ulp == 1 else ROUNDING + EPS * ulp)
            if off:
                low, high = (self.op(code, end, self.number(off)) for code, end in (("sub", low), ("add", high)))
            least, most = entry.image
            return Names(
                low if least == -np.inf else self.op("max", low, self.number(least)),
                high if most == np.inf else self.op("min", high, self.number(most)),
                self.anywhere(*(a.nowhere for a in args), nowhere),
                entry.broken or any(a.wild for a in args),
            )

        return run

    def unknown(self) -> Names:
        raise NotStraight("nothing is known")

    def other(self, node: Term, known: Mapping[Term, Names]) -> Names:
        if not isinstance(node, Branch | If):
            return self.unknown()
        a, b = known[node.then], known[node.orelse]
        both = None if a.nowhere is None or b.nowhere is None else self.op("and", a.nowhere, b.nowhere)
        low, high, wild = self.op("min", a.low, b.low), self.op("max", a.high, b.high), a.wild or b.wild
        if isinstance(node, If):
            return Names(low, high, both, wild)
        zero, surface = self.number(0.0), known[node.surface]
        above, below = self.op("gt", surface.low, zero), self.op("lt", surface.high, zero)
        low, high = (self.op("select", above, x, self.op("select", below, y, z))
                     for x, y, z in ((a.low, b.low, low), (a.high, b.high, high)))  # fmt: skip
        there = [self.op("and", side, own.nowhere) for side, own in ((above, a), (below, b)) if own.nowhere is not None]
        return Names(low, high, self.anywhere(*there, both), wild)

    def anywhere(self, *masks: str | None) -> str | None:
        """Where one of these masks holds, of those that there are."""
        known = list(dict.fromkeys(mask for mask in masks if mask is not None))
        return reduce(lambda a, b: self.op("or", a, b), known) if known else None

    def builtin(self, node: Prim, known: Mapping[Term, Names]) -> Names:
        args = [known[arg] for arg in node.args]
        match node.op:
            case "add":
                found = args[0]
                for last, arg in enumerate(args[1:], 2):
                    found = self.sum(found, arg, ROUNDING if last == len(args) else 0.0)
                return found
            case "neg":
                return Names(self.op("neg", args[0].high), self.op("neg", args[0].low), *self.together(args))
            case "mul":
                powers = [self.power(known[arg], node.args.count(arg)) for arg in dict.fromkeys(node.args)]
                found = powers[0]
                for power in powers[1:]:
                    found = self.product(found, power)
            case "div":
                found = self.product(args[0], self.inverse(args[1]))
            case "pow" if isinstance(node.args[1], Const):
                found = self.constant_power(args[0], node.args[1].value)
            case "abs":
                least = self.op("max", self.op("max", args[0].low, self.op("neg", args[0].high)), self.number(0.0))
                return Names(least, self.size(args[0]), *self.together(args))
            case "min" | "max":
                low, high, *_ = args[0]
                for arg in args[1:]:
                    low, high = self.op(node.op, low, arg.low), self.op(node.op, high, arg.high)
                return Names(low, high, *self.together(args))
            case _:
                return self.apply(node.op, args)
        return self.outwards(found)

    def op(self, code: str, *args: str) -> str:
        return self.at.apply(code, *args)

    def size(self, a: Names) -> str:
        """How large a value may be."""
        return self.op("abs", a.low) if a.low == a.high else self.op("max", self.op("neg", a.low), a.high)

    def outwards(self, a: Names, part: float = ROUNDING) -> Names:
        room = self.number(part)
        low, high = (self.op("mul", room, self.op("abs", end)) for end in a[:2])
        return Names(self.op("sub", a.low, low), self.op("add", a.high, high), a.nowhere, a.wild)

    def together(self, args: Sequence[Names]) -> tuple[str | None, bool]:
        """Where what all these go into has no value, and whether it is wild."""
        return self.anywhere(*(arg.nowhere for arg in args)), any(arg.wild for arg in args)

    def sum(self, a: Names, b: Names, part: float) -> Names:
        """Rounded outwards by this part of it, with room for what is lost of operands that cancel."""
        low, high = self.op("add", a.low, b.low), self.op("add", a.high, b.high)
        own, other = self.number(EPS + part), self.number(EPS)
        size = self.size(Names(low, high))
        slack = self.op("add", self.op("mul", own, size), self.op("mul", other, self.size(b)))
        if a.wild or b.wild:  # one end that is infinite says nothing of the other
            slack = self.op("select", self.op("lt", slack, self.number(np.inf)), slack, self.number(0.0))
        return Names(self.op("sub", low, slack), self.op("add", high, slack), *self.together((a, b)))

    def product(self, a: Names, b: Names) -> Names:
        pairs = [(x, y) for x in dict.fromkeys(a[:2]) for y in dict.fromkeys(b[:2])]
        corners = [self.op("mul", x, y) for x, y in pairs]
        if a.wild or b.wild:  # 0 times infinity is 0: what is infinite is a bound
            zero = self.number(0.0)
            nothing = [self.op("or", self.op("eq", x, zero), self.op("eq", y, zero)) for x, y in pairs]
            corners = [self.op("select", at, zero, x) for at, x in zip(nothing, corners, strict=True)]
        low, high = (reduce(partial(self.op, code), corners) for code in ("min", "max"))
        if a.wild or b.wild:
            unknown = [self.op("nan", end) for end in dict.fromkeys((*a[:2], *b[:2]))]
            low, high = (self.op("select", self.anywhere(*unknown) or "", self.number(np.nan), x) for x in (low, high))
        return Names(low, high, *self.together((a, b)))

    def inverse(self, a: Names) -> Names:
        """Of what has 0 in it, anything; of what is 0 all over, nothing."""
        zero, one, inf = self.number(0.0), self.number(1.0), self.number(np.inf)
        above, below = self.op("gt", a.low, zero), self.op("lt", a.high, zero)
        unknown = self.op("or", self.op("nan", a.low), self.op("nan", a.high))
        fine = self.op("or", self.op("or", above, below), unknown)
        low = self.op("select", fine, self.op("div", one, a.high), self.number(-np.inf))
        high = self.op("select", fine, self.op("div", one, a.low), inf)
        nowhere = self.op("and", self.op("eq", a.low, zero), self.op("eq", a.high, zero))
        return Names(low, high, self.anywhere(a.nowhere, nowhere), True)

    def constant_power(self, a: Names, exponent: float) -> Names:
        if exponent.is_integer() and exponent > 0:
            return self.power(a, int(exponent))
        if exponent.is_integer() and exponent < 0:
            return self.inverse(self.outwards(self.power(a, int(-exponent))))
        if not exponent > 0:
            raise NotStraight("a power")
        zero, wide = self.number(0.0), self.number(exponent)
        low, high = (self.op("pow", self.op("max", end, zero), wide) for end in a[:2])
        return Names(low, high, self.anywhere(a.nowhere, self.op("lt", a.high, zero)), a.wild)

    def power(self, a: Names, n: int) -> Names:
        if n > MOST_POWER:
            raise NotStraight("a high power")
        low, high, nowhere, wild = a
        for _ in range(n - 1):
            low, high = self.op("mul", low, a.low), self.op("mul", high, a.high)
        if n % 2:
            return Names(low, high, nowhere, wild)
        zero = self.number(0.0)
        inside = self.op("and", self.op("le", a.low, zero), self.op("ge", a.high, zero))
        low, high = self.op("select", inside, zero, self.op("min", low, high)), self.op("max", low, high)
        return Names(low, high, nowhere, wild)


# The rules of entries


class _Mask:
    """A mask in a text, for rules that are written for arrays."""

    def __init__(self, at: Carrier, name: str) -> None:
        self.at, self.name = at, name

    def __bool__(self) -> bool:
        raise NotStraight("a rule asks what a number is")

    def __and__(self, other: _Mask | bool) -> _Mask | bool:
        return (self if other else False) if isinstance(other, bool) else self._with("and", other)

    def __or__(self, other: _Mask | bool) -> _Mask | bool:
        return (True if other else self) if isinstance(other, bool) else self._with("or", other)

    __rand__, __ror__ = __and__, __or__

    def __invert__(self) -> _Mask:
        return _Mask(self.at, self.at.apply("not", self.name))

    def _with(self, code: str, other: _Mask) -> _Mask:
        return _Mask(self.at, self.at.apply(code, self.name, other.name))


class _Number:
    """A number in a text, for rules that are written for arrays."""

    def __init__(self, at: Carrier, name: str) -> None:
        self.at, self.name = at, name

    def _op(self, code: str, *args: Operand) -> _Number:
        return _Number(self.at, self.at.apply(code, *(_name(self.at, arg) for arg in args)))

    def _is(self, code: str, other: Operand) -> _Mask:
        return _Mask(self.at, self.at.apply(code, self.name, _name(self.at, other)))

    def __add__(self, other: Operand) -> _Number:
        return self._op("add", self, other)

    def __radd__(self, other: Operand) -> _Number:
        return self._op("add", other, self)

    def __sub__(self, other: Operand) -> _Number:
        return self._op("sub", self, other)

    def __rsub__(self, other: Operand) -> _Number:
        return self._op("sub", other, self)

    def __mul__(self, other: Operand) -> _Number:
        return self._op("mul", self, other)

    def __rmul__(self, other: Operand) -> _Number:
        return self._op("mul", other, self)

    def __truediv__(self, other: Operand) -> _Number:
        return self._op("div", self, other)

    def __rtruediv__(self, other: Operand) -> _Number:
        return self._op("div", other, self)

    def __neg__(self) -> _Number:
        return self._op("neg", self)

    def __abs__(self) -> _Number:
        return self._op("abs", self)

    def __lt__(self, other: Operand) -> _Mask:
        return self._is("lt", other)

    def __le__(self, other: Operand) -> _Mask:
        return self._is("le", other)

    def __gt__(self, other: Operand) -> _Mask:
        return self._is("gt", other)

    def __ge__(self, other: Operand) -> _Mask:
        return self._is("ge", other)

    def __eq__(self, other: Operand) -> _Mask:  # type: ignore[override]
        return self._is("eq", other)

    def __ne__(self, other: Operand) -> _Mask:  # type: ignore[override]
        return self._is("ne", other)

    __hash__ = None  # type: ignore[assignment]

    def __bool__(self) -> bool:
        raise NotStraight("a rule asks what a number is")


Operand = _Number | float


def _name(at: Carrier, x: Operand) -> str:
    return x.name if isinstance(x, _Number) else at.number(float(x))


def _mask_name(x: object) -> str:
    if not isinstance(x, _Mask):
        raise NotStraight("a mask that is known")
    return x.name


class _Ops:
    """`Elementwise` of numbers in a text."""

    def __init__(self, at: Carrier) -> None:
        self.at = at

    def of(self, name: str) -> Callable[..., _Number]:
        """The numeric form of a builtin, where a text has a word for it."""
        entry = PRIMITIVES[name]
        code = FUNCTIONS.get(entry.numpy.replace(".", "_"))
        if code is None or entry.guarded or entry.arity is None:
            raise NotStraight(name)
        return lambda *args: _Number(self.at, self.at.apply(code, *(_name(self.at, arg) for arg in args)))

    def where(self, condition: Any, a: Any, b: Any) -> Any:
        if isinstance(condition, bool):
            return a if condition else b
        if isinstance(a, _Mask | bool) or isinstance(b, _Mask | bool):
            return (condition & a) | (~condition & b)
        return _Number(self.at, self.at.apply("select", condition.name, _name(self.at, a), _name(self.at, b)))

    def least(self, a: Operand, b: Operand) -> _Number:
        return _Number(self.at, self.at.apply("min", _name(self.at, a), _name(self.at, b)))

    def most(self, a: Operand, b: Operand) -> _Number:
        return _Number(self.at, self.at.apply("max", _name(self.at, a), _name(self.at, b)))

    def finite(self, x: _Number) -> _Mask:
        return abs(x) < np.inf
