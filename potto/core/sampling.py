"""Values of terms at sample points, to 50 digits, without any library for numbers.

Owns `vanishes`, which tests on points whether a term is 0 everywhere. What has no rule here (integrals, calls, ...)
counts as an unknown with a value of its own, so that a term which vanishes for all its values is found.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from decimal import Context, Decimal, DivisionByZero, InvalidOperation, Overflow, localcontext

from potto.core import decimals
from potto.core.decimals import Undefined
from potto.core.terms import Branch, Const, If, Prim, Term, Var, postorder
from potto.primitives.registry import Primitive
from potto.primitives.walking import Domain

_POINTS = 5  # where the term is defined
_TRIES = 24
_SMALL = Decimal(10) ** -35  # relative to the largest part: cancellation at 50 digits leaves far less
_NAMED = {"pi": decimals.PI}

Number = tuple[Decimal, Decimal]  # a value, and the size of the largest part that went into it


class _Digits(Domain[Decimal | bool]):
    """The functions that the entries of builtins name, and what these make of formulas."""

    def constant(self, node: Const) -> Decimal | bool:
        return _finite(Decimal(node.value)) if node.name is None else _NAMED[node.name]

    def rule(self, entry: Primitive) -> Callable[..., Decimal | bool] | None:
        return getattr(decimals, entry.decimal) if entry.decimal else None

    def other(self, node: Term, known: Mapping[Term, Decimal | bool]) -> Decimal | bool:
        if not isinstance(node, If):
            return self.unknown()
        return known[node.then if known[node.condition] is True else node.orelse]

    def unknown(self) -> Decimal | bool:
        raise Undefined


DIGITS = _Digits()


def vanishes(term: Term) -> bool:
    """Whether a term is 0 at every sample point at which it has a value; False if it has one at too few."""
    order = postorder(term)
    seen = 0
    with localcontext(Context(prec=decimals.DIGITS, traps=[InvalidOperation, DivisionByZero, Overflow])):
        for attempt in range(_TRIES):
            try:
                value, size = _evaluate(order, attempt)
            except (Undefined, InvalidOperation, DivisionByZero, Overflow):
                continue
            if abs(value) > _SMALL * max(size, abs(value)):
                return False
            seen += 1
            if seen == _POINTS:
                return True
    return False


def _evaluate(order: list[Term], attempt: int) -> Number:
    memo: dict[Term, Number | bool] = {}
    for node in order:
        try:
            memo[node] = _node(node, memo, attempt)
        except (KeyError, Undefined, InvalidOperation, DivisionByZero, Overflow):
            continue  # perhaps in a branch that is not taken
    result = memo.get(order[-1])
    if not isinstance(result, tuple):
        raise Undefined
    return result


def _node(node: Term, memo: Mapping[Term, Number | bool], attempt: int) -> Number | bool:
    match node:
        case Const(name=str(name)) if name in _NAMED:
            return _exact(_NAMED[name])
        case Const(value=value):
            return _exact(_finite(Decimal(value)))
        case Var(name=name):
            return _exact(_sample(name.encode(), attempt))
        case Branch():
            side = _number(memo[node.surface])
            return memo[node.then if (side > 0 if node.strict else side >= 0) else node.orelse]
        case If():
            return memo[node.then if memo[node.condition] is True else node.orelse]
        case Prim(op="add", args=args):
            parts = [_pair(memo[a]) for a in args]
            return sum((v for v, _ in parts), Decimal(0)), max(s for _, s in parts)
        case Prim(op="mul", args=args):
            return _product([_pair(memo[a]) for a in args])
        case Prim(op="div", args=(a, b)):
            (v, s), w = _pair(memo[a]), _number(memo[b])
            return v / w, s / abs(w)
        case Prim(op="neg", args=(a,)):
            v, s = _pair(memo[a])
            return -v, s
        case Prim(op=op, args=args) if DIGITS.knows(op):
            found = DIGITS.apply(op, [_plain(memo[a]) for a in args])
            return found if isinstance(found, bool) else _exact(found)
        case _:
            return _exact(_sample(node.digest, attempt))


def _product(parts: list[Number]) -> Number:
    value, size = Decimal(1), Decimal(1)
    for v, s in parts:
        value, size = value * v, size * s
    return value, size


def _pair(value: Number | bool) -> Number:
    if isinstance(value, bool):
        raise TypeError("a truth value where a number belongs")
    return value


def _number(value: Number | bool) -> Decimal:
    return _pair(value)[0]


def _plain(value: Number | bool) -> Decimal | bool:
    return value if isinstance(value, bool) else value[0]


def _exact(value: Decimal) -> Number:
    return value, abs(value)


def _finite(value: Decimal) -> Decimal:
    if not value.is_finite():
        raise Undefined
    return +value


def _sample(key: bytes, attempt: int) -> Decimal:
    """A number that looks random but is the same each time; near 1, of either sign on half of the attempts."""
    digest = hashlib.blake2b(key + b"%d" % attempt, digest_size=16).digest()
    size = Decimal(int.from_bytes(digest[1:], "big")) / Decimal(1 << 120) + Decimal("0.1")
    return -size if attempt % 2 and digest[0] % 2 else size
