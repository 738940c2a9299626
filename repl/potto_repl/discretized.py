"""Integrals as sums over a grid of points: what most tools differentiate.

Owns `discretized`. The midpoint rule with the bounds moving as they do; infinite bounds are pulled in first. Its
derivative is right inside and knows nothing of jumps: that is what `:check` shows.
"""

from __future__ import annotations

import math

from potto.core.terms import (
    ONE,
    Const,
    Integral,
    Prim,
    Term,
    add,
    children,
    const,
    div,
    fresh,
    mul,
    postorder,
    rebuild,
    sub,
    substitute,
    sum_,
    var,
)

POINTS = {1: 1000, 2: 100, 3: 20}  # in each variable, by the number of variables


def points_of(dimensions: int) -> int:
    """How many points each variable gets, by the number of variables."""
    return POINTS.get(dimensions, 8)


def dimensions(term: Term) -> int:
    """The most variables of integration that stand inside each other in a term."""
    depth: dict[Term, int] = {}
    for node in postorder(term):
        inner = max((depth[child] for child in children(node)), default=0)
        depth[node] = inner + (len(node.variables) if isinstance(node, Integral) else 0)
    return depth[term]


def discretized(term: Term, points: int) -> Term:
    """The term with each integral as a sum over the midpoints of equal parts."""
    memo: dict[Term, Term] = {}
    for node in postorder(term):
        new = rebuild(node, tuple(memo[child] for child in children(node)))
        memo[node] = _summed(new, points) if isinstance(new, Integral) else new
    return memo[term]


def _summed(node: Integral, points: int) -> Term:
    body = node.body
    for variable, (lo, hi) in reversed(list(zip(node.variables, node.bounds, strict=True))):
        index = fresh(f"{variable}_number", body.free | lo.free | hi.free)
        share = div(add(var(index), const(0.5)), const(float(points)))
        at, width = _placed(lo, hi, share)
        term = mul(substitute(body, {variable: at}), div(width, const(float(points))))
        body = sum_(index, const(0.0), const(float(points - 1)), term)
    return body


def _placed(lo: Term, hi: Term, share: Term) -> tuple[Term, Term]:
    """The point at a share of the way from lo to hi, and how fast it goes."""
    below, above = _infinite(lo), _infinite(hi)
    if below and above:
        u = sub(mul(const(2.0), share), ONE)
        rest = sub(ONE, mul(u, u))
        return div(u, rest), div(mul(const(2.0), add(ONE, mul(u, u))), mul(rest, rest))
    if below or above:
        rest = sub(ONE, share)
        way, speed = div(share, rest), div(ONE, mul(rest, rest))
        return (add(lo, way) if above else sub(hi, div(rest, share))), (speed if above else div(ONE, mul(share, share)))
    width = sub(hi, lo)
    return add(lo, mul(width, share)), width


def _infinite(bound: Term) -> bool:
    if isinstance(bound, Prim) and bound.op == "neg":
        bound = bound.args[0]
    return isinstance(bound, Const) and math.isinf(bound.value)
