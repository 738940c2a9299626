"""What the printer writes, Potto reads as the same value."""

from __future__ import annotations

import pytest
from core_terms import area, bracket, c, n, t, terms, x, y
from hypothesis import given, settings
from mpmath import mp

from potto.core.printer import format_term
from potto.core.reference import evaluate
from potto.core.terms import ONE, Term, add, branch, const, if_, mul, neg, prim, sub, sum_, var
from potto.elaborate import elaborate_expression
from potto.query import Database
from potto.syntax import parse_expression

POINTS = [{"x": 0.3, "y": -1.2, "t": 0.7, "c": -0.4, "n": 3.0}, {"x": -0.45, "y": 0.8, "t": 2.1, "c": 0.2, "n": 5.0}]


def read(text: str) -> Term:
    parsed = parse_expression(text)
    assert parsed.expr is not None and not parsed.diagnostics, text
    return elaborate_expression(Database(), "<text>", parsed.expr, ("x", "y", "t", "c", "n")).term


def check(term: Term) -> None:
    again = read(format_term(term))
    for point in POINTS:
        before, after = evaluate(term, point), evaluate(again, point)
        if mp.isfinite(before):
            assert abs(before - after) <= mp.mpf("1e-20") * max(1, abs(before))


read("1")  # the first reading raises Python's recursion limit, which hypothesis wants to stand still


@settings(deadline=None, max_examples=150)
@given(term=terms())
def test_random_terms(term: Term) -> None:
    check(term)


@pytest.mark.parametrize(
    "term",
    [
        area(mul(x, bracket(sub(t, x), True)), "x"),
        mul(n, add(ONE, area(x, "x"))),
        add(area(x, "x"), area(mul(y, y), "y")),
        sum_("i", ONE, n, mul(var("i"), x)),
        mul(t, sum_("i", ONE, n, var("i"))),
        branch((add(x, y, c), sub(x, y)), False, x, y),
        branch((x,), False, branch((y,), False, ONE, bracket(t)), const(0.0)),
        branch((x,), True, const(0.0), bracket(sub(t, x))),
        if_(prim("and", prim("lt", x, y), prim("not", prim("le", y, t))), x, neg(y)),
        if_(prim("or", prim("eq", x, y), prim("ne", x, t)), x, neg(y)),
        add(if_(prim("lt", x, y), ONE, t), mul(x, if_(prim("lt", y, x), ONE, t))),
        prim("pow", neg(x), const(2.0)),
        neg(prim("pow", x, const(2.0))),
        prim("pow", const(2.0), neg(x)),
        prim("div", x, prim("div", y, t)),
        mul(const(1e-200), const(3e200), x),
    ],
)
def test_terms(term: Term) -> None:
    check(term)
