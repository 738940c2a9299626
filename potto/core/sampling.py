"""Values of terms at sample points, to 50 digits, without any library for numbers.

Owns `vanishes`, which tests on points whether a term is 0 everywhere. What has no rule here (integrals, calls, ...)
counts as an unknown with a value of its own, so that a term which vanishes for all its values is found.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from decimal import Context, Decimal, DivisionByZero, InvalidOperation, Overflow, localcontext

from potto.core.terms import Branch, Const, If, Prim, Term, Var, postorder

DIGITS = 50
_POINTS = 5  # where the term is defined
_TRIES = 24
_SMALL = Decimal(10) ** -35  # relative to the largest part: cancellation at 50 digits leaves far less
_PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211706798")
_NAMED = {"pi": _PI}
_LARGE = Decimal(10) ** 6

Number = tuple[Decimal, Decimal]  # a value, and the size of the largest part that went into it


class _Undefined(Exception):
    """Internal: the term has no value at this point."""


def vanishes(term: Term) -> bool:
    """Whether a term is 0 at every sample point at which it has a value; False if it has one at too few."""
    order = postorder(term)
    seen = 0
    with localcontext(Context(prec=DIGITS, traps=[InvalidOperation, DivisionByZero, Overflow])):
        for attempt in range(_TRIES):
            try:
                value, size = _evaluate(order, attempt)
            except (_Undefined, InvalidOperation, DivisionByZero, Overflow):
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
        except (KeyError, _Undefined, InvalidOperation, DivisionByZero, Overflow):
            continue  # perhaps in a branch that is not taken
    result = memo.get(order[-1])
    if not isinstance(result, tuple):
        raise _Undefined
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
        case Prim(op=op, args=args) if op in _TRUTH:
            return _TRUTH[op](*(memo[a] if isinstance(memo[a], bool) else _number(memo[a]) for a in args))
        case Prim(op=op, args=args) if op in _FUNCTIONS:
            return _exact(_FUNCTIONS[op](*(_number(memo[a]) for a in args)))
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


def _exact(value: Decimal) -> Number:
    return value, abs(value)


def _finite(value: Decimal) -> Decimal:
    if not value.is_finite():
        raise _Undefined
    return +value


def _sample(key: bytes, attempt: int) -> Decimal:
    """A number that looks random but is the same each time; near 1, of either sign on half of the attempts."""
    digest = hashlib.blake2b(key + b"%d" % attempt, digest_size=16).digest()
    size = Decimal(int.from_bytes(digest[1:], "big")) / Decimal(1 << 120) + Decimal("0.1")
    return -size if attempt % 2 and digest[0] % 2 else size


# Functions at 50 digits


def _series(first: Decimal, ratio: Callable[[int], Decimal]) -> Decimal:
    """first * (1 + r(1) + r(1) r(2) + ...), until the terms no longer count."""
    total, term, k = first, first, 0
    while abs(term) > abs(total) * Decimal(10) ** -(DIGITS + 5) and k < 10_000:
        k += 1
        term *= ratio(k)
        total += term
    return total


def _sin(x: Decimal) -> Decimal:
    if abs(x) > _LARGE:
        raise _Undefined
    x -= 2 * _PI * (x / (2 * _PI)).to_integral_value()
    return _series(x, lambda k: -x * x / (2 * k * (2 * k + 1))) if x else x


def _cos(x: Decimal) -> Decimal:
    return _sin(x + _PI / 2)


def _atan(x: Decimal) -> Decimal:
    if abs(x) > 1:
        return (_PI / 2).copy_sign(x) - _atan(1 / x)
    for _ in range(4):
        x = x / (1 + (1 + x * x).sqrt())
    term, total, k = x, x, 1
    while abs(term) > Decimal(10) ** -(DIGITS + 5):
        term *= -x * x
        k += 2
        total += term / k
    return 16 * total


def _asin(x: Decimal) -> Decimal:
    rest = (1 - x * x).sqrt()
    return _atan(x / rest) if rest else (_PI / 2).copy_sign(x)


def _atan2(y: Decimal, x: Decimal) -> Decimal:
    if x > 0:
        return _atan(y / x)
    if x < 0:
        return _atan(y / x) + (_PI if y >= 0 else -_PI)
    return (_PI / 2).copy_sign(y) if y else Decimal(0)


def _exp(x: Decimal) -> Decimal:
    if abs(x) > _LARGE:
        raise _Undefined
    return x.exp()


def _log(x: Decimal) -> Decimal:
    if x <= 0:
        raise _Undefined
    return x.ln()


def _sinh(x: Decimal) -> Decimal:
    return (_exp(x) - _exp(-x)) / 2


def _cosh(x: Decimal) -> Decimal:
    return (_exp(x) + _exp(-x)) / 2


def _erf(x: Decimal) -> Decimal:
    if abs(x) > 5:
        raise _Undefined  # the series below would lose its digits
    with localcontext(Context(prec=DIGITS + 30)):
        series = _series(x, lambda k: -x * x * (2 * k - 1) / (k * (2 * k + 1))) if x else x
        return 2 * series / _PI.sqrt()


def _pow(a: Decimal, b: Decimal) -> Decimal:
    if abs(b) > 1000 or (a <= 0 and b != b.to_integral_value()):
        raise _Undefined
    return a**b if a or b else Decimal(1)


def _clamp(x: Decimal, lo: Decimal, hi: Decimal) -> Decimal:
    return min(max(x, lo), hi)


_FUNCTIONS: dict[str, Callable[..., Decimal]] = {
    "pow": _pow,
    "sqrt": Decimal.sqrt,
    "exp": _exp,
    "log": _log,
    "log1p": lambda x: _log(1 + x),
    "expm1": lambda x: _exp(x) - 1,
    "sin": _sin,
    "cos": _cos,
    "tan": lambda x: _sin(x) / _cos(x),
    "asin": _asin,
    "acos": lambda x: _PI / 2 - _asin(x),
    "atan": _atan,
    "atan2": _atan2,
    "sinh": _sinh,
    "cosh": _cosh,
    "tanh": lambda x: _sinh(x) / _cosh(x),
    "erf": _erf,
    "erfc": lambda x: 1 - _erf(x),
    "abs": abs,
    "min": min,
    "max": max,
    "hypot": lambda x, y: (x * x + y * y).sqrt(),
    "clamp": _clamp,
    "sign": lambda x: Decimal(0) if not x else Decimal(1).copy_sign(x),
    "floor": lambda x: x.to_integral_value("ROUND_FLOOR"),
    "ceil": lambda x: x.to_integral_value("ROUND_CEILING"),
}

_TRUTH: dict[str, Callable[..., bool]] = {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
    "and": lambda *parts: all(parts),
    "or": lambda *parts: any(parts),
    "not": lambda a: not a,
}
