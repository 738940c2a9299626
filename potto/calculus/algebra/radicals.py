"""Quotients and real roots as terms, put so that few digits are lost.

Owns `square_root`, `even_root`, `odd_root`, `quotient` and choices by the sign of a term. What a root is of stays
recognizable: squares are pulled out, and a difference of squares becomes a product.
"""

from __future__ import annotations

import math

from potto.calculus.algebra.ranges import range_of
from potto.core.terms import NAN, ONE, ZERO, Const, Prim, Term, add, branch, const, div, mul, neg, pow_, prim, sub


def guarded(surface: Term, value: Term, strict: bool = False) -> Term:
    """`value` where surface >= 0 (> 0 when strict), else nan."""
    bounds = range_of(surface)
    if bounds.negative or (strict and bounds.hi <= 0):
        return NAN
    if bounds.positive or (not strict and bounds.lo >= 0):
        return value
    return branch((surface,), strict, value, NAN)


def signed(surface: Term, then: Term, orelse: Term) -> Term:
    """`then` where surface >= 0, else `orelse`; decided at once where the form of the surface shows its sign."""
    bounds = range_of(surface)
    if bounds.lo >= 0:
        return then
    return orelse if bounds.negative else branch((surface,), False, then, orelse)


def quotient(top: Term, below: Term) -> Term:
    """top / below with the signs in front."""
    if isinstance(below, Const) and below.value < 0:
        return quotient(minus(top), neg(below))
    if isinstance(below, Prim) and below.op == "neg":
        return quotient(minus(top), below.args[0])
    if isinstance(top, Prim) and top.op == "neg":
        return neg(div(top.args[0], below))
    return div(top, below)


def minus(term: Term) -> Term:
    """-term, with the sign inside a sum."""
    if isinstance(term, Prim) and term.op == "add":
        return add(*(neg(a) for a in term.args))
    if isinstance(term, Prim) and term.op == "div":
        return div(minus(term.args[0]), term.args[1])
    return neg(term)


# Roots


def square_root(value: Term) -> Term:
    """sqrt(value), with squares pulled out and a difference of squares as a product, which cancels less."""
    if isinstance(value, Const):
        return _constant_root(value)
    base = squared(value)
    if base is not None:
        return _size(base)
    if range_of(value).negative:
        return NAN
    if isinstance(value, Prim) and value.op == "div":
        below = squared(value.args[1])
        if below is not None:
            return div(square_root(value.args[0]), _size(below))
    if isinstance(value, Prim) and value.op == "mul":
        bases = [squared(f) if not isinstance(f, Const) else None for f in value.args]
        outside: list[Term] = [_size(b) for b in bases if b is not None]
        inside = [f for f, b in zip(value.args, bases, strict=True) if b is None]
        if outside:
            return mul(*outside, square_root(mul(*inside))) if inside else mul(*outside)
    return prim("sqrt", factored(value))


def _size(term: Term) -> Term:
    """abs(term), unless its form shows its sign."""
    bounds = range_of(term)
    if bounds.lo >= 0:
        return term
    return minus(term) if bounds.hi <= 0 else prim("abs", minus(term) if _is_neg(term) else term)


def _is_neg(term: Term) -> bool:
    return isinstance(term, Prim) and term.op == "neg"


def factored(value: Term) -> Term:
    """a^2 - b^2 as (a - b) (a + b)."""
    if isinstance(value, Prim) and value.op == "add" and len(value.args) == 2:
        first, second = value.args
        for plus, minus in ((first, second), (second, first)):
            a, b = squared(plus), squared(neg(minus))
            if a is not None and b is not None:
                return mul(sub(a, b), add(a, b))
    return value


def squared(value: Term) -> Term | None:
    """b with value = b^2, where that can be read off."""
    if isinstance(value, Prim):
        if value.op == "pow" and isinstance(value.args[1], Const) and value.args[1].value == 2:
            return value.args[0]
        if value.op == "mul" and len(value.args) == 2 and value.args[0] is value.args[1]:
            return value.args[0]
    if isinstance(value, Const) and value.value > 0 and value.name is None:
        root = math.sqrt(value.value)
        if root * root == value.value and root.is_integer():
            return const(root)
    return None


def _constant_root(value: Const) -> Term:
    root = math.sqrt(value.value) if value.value >= 0 else math.nan
    if root.is_integer() or value.value < 0:
        return const(root)
    return prim("sqrt", value)


def even_root(value: Term, n: int) -> Term:
    """The root >= 0 of u^n = value for an even n; nan where value < 0."""
    while n % 2 == 0:
        value, n = square_root(value), n // 2
    return value if n == 1 else pow_(value, div(ONE, const(n)))


def odd_root(value: Term, n: int) -> Term:
    """The real root of u^n = value for an odd n."""
    if n == 1 or value is ZERO:
        return value
    if isinstance(value, Const) and abs(value.value) == 1:
        return value
    if isinstance(value, Prim) and value.op == "neg":
        return neg(odd_root(value.args[0], n))
    exponent = div(ONE, const(n))
    return signed(value, prim("pow", value, exponent), neg(prim("pow", neg(value), exponent)))
