"""Values that count only where a root is a number, and between bounds.

Owns `between`, `exists`, `above`, `finite` and `scaled`.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from potto.calculus.algebra.ranges import range_of
from potto.calculus.algebra.rational_form import is_zero
from potto.calculus.differentiation.derivative import zero_like
from potto.core.terms import (
    NAN,
    ONE,
    Branch,
    If,
    Prim,
    Term,
    Tuple,
    branch,
    const,
    if_,
    mul,
    neg,
    postorder,
    sub,
    tuple_,
)
from potto.primitives import PRIMITIVES


def between(at: Term, lo: Term, hi: Term, value: Term) -> Term:
    """`value` where lo < at < hi, minus it where hi < at < lo, 0 elsewhere and where `at` is not a number."""
    if is_zero(sub(hi, lo)):
        return zero_like(value)
    upward = value
    if finite(hi):
        upward = above(sub(hi, at), upward)
    if finite(lo):
        upward = above(sub(at, lo), upward)
    if not (finite(lo) and finite(hi)) or range_of(sub(hi, lo)).lo >= 0:
        return exists(at, upward)
    downward = above(sub(lo, at), above(sub(at, hi), scaled(value, neg(ONE))))
    return exists(at, branch((sub(hi, lo),), False, upward, downward))


def exists(at: Term, value: Term) -> Term:
    """`value` where `at` is a number, else 0: these conditions come first, and of what is inside of others the inner
    ones, as a comparison with nan is nan.
    """
    for node in reversed(postorder(at)):
        for margin in _margins(node):
            if not range_of(margin).positive:
                value = branch((margin,), False, value, zero_like(value))
    return value


def _margins(node: Term) -> Iterator[Term]:
    """What must not be negative for a part of a root's place to be a number."""
    if isinstance(node, Branch) and node.orelse is NAN:
        yield node.surface
    elif isinstance(node, Prim):
        low, high = PRIMITIVES[node.op].within
        if low > -inf:
            yield sub(node.args[-1], const(low))
        if high < inf:
            yield sub(const(high), node.args[-1])


def above(surface: Term, value: Term) -> Term:
    """`value` where the surface is positive, else 0."""
    bounds = range_of(surface)
    if bounds.positive:
        return value
    if bounds.hi <= 0 or is_zero(surface):
        return zero_like(value)
    return branch((surface,), True, value, zero_like(value))


def finite(bound: Term) -> bool:
    """Whether a bound is not known to be infinite."""
    bounds = range_of(bound)
    return not (bounds.lo == bounds.hi and abs(bounds.lo) == float("inf"))


def scaled(value: Term, factor: Term) -> Term:
    """A number or a tuple of numbers times a factor; a side that is 0 stays 0 where the factor is not a number."""
    match value:
        case Tuple(items=items):
            return tuple_(scaled(item, factor) for item in items)
        case Branch():
            return branch(value.coordinates, value.strict, scaled(value.then, factor), scaled(value.orelse, factor))
        case If():
            return if_(value.condition, scaled(value.then, factor), scaled(value.orelse, factor))
        case _:
            return mul(value, factor)
