"""Terms as text: the parentheses that are needed, and conditions as one would write them."""

from __future__ import annotations

import pytest
from core_terms import HALF, TWO, area, bracket, c, n, t, terms, x, y
from hypothesis import given, settings

from potto.core.numerals import Numbers
from potto.core.printer import format_equation, format_term
from potto.core.terms import (
    INF,
    ONE,
    PI,
    ZERO,
    Term,
    add,
    app,
    branch,
    const,
    delta,
    deriv,
    div,
    global_,
    hole,
    if_,
    integral,
    lam,
    list_of,
    mul,
    neg,
    pow_,
    prim,
    proj,
    sub,
    sum_,
    tuple_,
    var,
)

f = global_("/somewhere/m.po", "f")


@pytest.mark.parametrize(
    ("term", "text"),
    [
        (add(x, y, neg(c)), "x + y - c"),
        (sub(x, add(y, t)), "x - (y + t)"),
        (add(x, const(-2.0)), "x - 2"),
        (sub(x, neg(y)), "x + y"),
        (prim("add", x, prim("mul", const(-3.0), y)), "x - 3*y"),
        (neg(add(x, y)), "-(x + y)"),
        (neg(mul(x, y)), "-x*y"),
        (mul(x, neg(y)), "-x*y"),
        (mul(x, add(y, ONE)), "x*(y + 1)"),
        (mul(x, div(y, t)), "x*(y/t)"),
        (div(mul(x, y), t), "x*y/t"),
        (div(x, mul(y, t)), "x/(y*t)"),
        (div(div(x, y), t), "x/y/t"),
        (pow_(neg(x), TWO), "(-x)^2"),
        (neg(pow_(x, TWO)), "-x^2"),
        (pow_(x, const(-1.0)), "x^(-1)"),
        (pow_(pow_(x, y), t), "(x^y)^t"),
        (pow_(x, pow_(y, t)), "x^y^t"),
        (pow_(add(x, y), HALF), "(x + y)^0.5"),
        (mul(PI, const(1e-07)), "pi*1e-7"),
        (neg(INF), "-inf"),
        (const(0.1), "0.1"),
        (prim("atan2", y, add(x, ONE)), "atan2(y, x + 1)"),
        (tuple_((x, y)), "(x, y)"),
        (list_of((x,)), "[x]"),
        (proj(app(f, (x,)), 1), "f(x).1"),
        (lam(("x", "y"), lam(("c",), add(x, y, c))), "\\(x, y) . \\c . x + y + c"),
        (app(lam(("x",), x), (y,)), "(\\x . x)(y)"),
        (deriv(f), "deriv(f)"),
        (delta((add(x, t),)), "delta(x + t)"),
        (sum_("i", ONE, n, mul(var("i"), x)), "sum i in 1..n (i*x)"),
        (integral(("x", "y"), ((ZERO, ONE), (ZERO, x)), mul(x, y)), "integral ([0, 1], [0, x]) x*y d(x, y)"),
        (mul(t, area(x, "x")), "t*(integral [0, 1] x d(x))"),
        (add(t, area(x, "x")), "t + integral [0, 1] x d(x)"),
        (if_(prim("lt", x, add(y, t)), ONE, x), "if x < y + t then 1 else x"),
        (add(if_(prim("le", x, y), ONE, x), t), "(if x <= y then 1 else x) + t"),
        (
            if_(prim("and", prim("or", prim("eq", x, y), prim("ne", x, t)), prim("not", prim("lt", x, y))), ONE, x),
            "if (x == y or x != t) and not x < y then 1 else x",
        ),
        (hole("unreadable"), "?"),
    ],
)
def test_text(term: Term, text: str) -> None:
    assert format_term(term) == text


TENTH = prim("div", ONE, const(10.0))


@pytest.mark.parametrize(
    ("term", "fractions", "decimals"),
    [
        (HALF, "1/2", "0.5"),
        (const(-0.5), "-1/2", "-0.5"),
        (const(0.3), "3/10", "0.3"),
        (const(1 / 3), "1/3", "0.3333333333333333"),
        (const(0.30000000000000004), "0.30000000000000004", "0.30000000000000004"),  # rounded: no fraction is this
        (const(1 / 65), "0.015384615384615385", "0.015384615384615385"),  # nobody divides by 65
        (const(1e-300), "1e-300", "1e-300"),
        (INF, "inf", "inf"),
        (TENTH, "1/10", "0.1"),
        (prim("div", const(16.0), const(25.0)), "16/25", "0.64"),
        (prim("div", const(3.0), const(7.0)), "3/7", "3/7"),
        (add(div(pow_(x, HALF), y), pow_(HALF, x)), "x^(1/2)/y + (1/2)^x", "x^0.5/y + 0.5^x"),
        (prim("div", x, HALF), "x/(1/2)", "x/0.5"),
        (prim("mul", x, HALF), "x*(1/2)", "x*0.5"),
        (prim("pow", const(-0.5), TWO), "(-1/2)^2", "(-0.5)^2"),
        (prim("div", x, TENTH), "x/(1/10)", "x/0.1"),
        (bracket(add(x, HALF)), "[x >= -1/2]", "[x >= -0.5]"),
        (bracket(sub(HALF, x)), "[x <= 1/2]", "[x <= 0.5]"),
        (bracket(sub(prim("div", ONE, const(3.0)), x)), "[x <= 1/3]", "[x <= 1/3]"),
        (bracket(sub(x, prim("div", ONE, const(3.0)))), "[x >= 1/3]", "[x >= 1/3]"),
        (bracket(add(x, TENTH)), "[x >= -1/10]", "[x >= -0.1]"),
        (bracket(add(x, neg(y), const(-0.25))), "[y + 1/4 <= x]", "[y + 0.25 <= x]"),
        (sum_("k", ZERO, n, mul(HALF, var("k"))), "sum k in 0..n (1/2*k)", "sum k in 0..n (0.5*k)"),
        (proj(proj(var("w"), 0), 5), "w.0.5", "w.0.5"),  # a place in a tuple
    ],
)
def test_numbers_are_written_as_the_program_has_them(term: Term, fractions: str, decimals: str) -> None:
    assert format_term(term, numbers=Numbers.FRACTIONS) == fractions
    assert format_term(term, numbers=Numbers.DECIMALS) == decimals


def test_equations_end_with_their_number() -> None:
    assert format_equation(sub(x, HALF), numbers=Numbers.FRACTIONS) == "x = 1/2"
    assert format_equation(add(mul(x, y), const(-1 / 3)), numbers=Numbers.FRACTIONS) == "x*y = 1/3"


@pytest.mark.parametrize(
    ("term", "text"),
    [
        (bracket(sub(t, x), strict=True), "[x < t]"),
        (bracket(sub(t, x)), "[x <= t]"),
        (branch((sub(t, x),), True, ZERO, ONE), "[x >= t]"),
        (bracket(sub(ONE, x), strict=True), "[x < 1]"),
        (bracket(sub(x, TWO)), "[x >= 2]"),
        (bracket(add(x, y, c)), "[x + y + c >= 0]"),
        (bracket(sub(t, add(x, y)), strict=True), "[x + y < t]"),
        (branch((add(x, y, c), sub(x, y)), False, ONE, ZERO), "[x + y + c >= 0]"),
        (branch((add(x, y, c), sub(x, y)), False, x, y), "if diffeo(x + y + c, x - y) then x else y"),
        (branch((sub(t, x),), True, x, y), "if [x < t] then x else y"),
        (branch((x,), False, bracket(sub(t, x), True), ZERO), "[0 <= x < t]"),
        (branch((x,), False, ONE, bracket(sub(t, x), True)), "[x >= 0 or x < t]"),
        (branch((x,), False, ZERO, bracket(sub(t, x), True)), "[x < 0 and x < t]"),
        (branch((x,), False, branch((y,), False, ONE, bracket(t)), ZERO), "[x >= 0 and (y >= 0 or t >= 0)]"),
        (mul(x, bracket(x)), "x*[x >= 0]"),
        (pow_(bracket(x), TWO), "[x >= 0]^2"),
    ],
)
def test_conditions(term: Term, text: str) -> None:
    assert format_term(term) == text


@settings(deadline=None, max_examples=100)
@given(term=terms())
def test_parentheses_balance(term: Term) -> None:
    depth = 0
    for character in format_term(term):
        depth += (character in "([") - (character in ")]")
        assert depth >= 0
    assert depth == 0


def test_deep_and_shared_terms() -> None:
    deep: Term = x
    for _ in range(3000):
        deep = prim("sin", deep)
    assert format_term(deep) == "sin(" * 3000 + "x" + ")" * 3000
    shared: Term = x
    for _ in range(60):
        shared = prim("max", shared, prim("sin", shared))
    assert len(format_term(shared)) < 50_000
    assert "..." in format_term(shared)
