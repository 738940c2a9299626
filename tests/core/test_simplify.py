"""Simplification keeps values, and finds what is equal."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from core_terms import THREE, TWO, UNIT, area, bracket, c, n, s, t, terms, x, y
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from lint import lint
from mpmath import mp

from potto.core.normal_form import as_term, normal_form
from potto.core.printer import format_term
from potto.core.reference import evaluate
from potto.core.simplify import normalized_surface, simplify
from potto.core.terms import (
    ONE,
    PI,
    ZERO,
    Branch,
    Term,
    add,
    app,
    branch,
    const,
    div,
    global_,
    if_,
    integral,
    lam,
    mul,
    neg,
    postorder,
    pow_,
    prim,
    proj,
    sub,
    substitute,
    sum_,
    tuple_,
    var,
)

POINTS = [{"x": 0.3, "y": -1.2, "t": 0.7}, {"x": -0.45, "y": 0.8, "t": 2.1}, {"x": 1.7, "y": 0.4, "t": -0.6}]


def text(term: Term) -> str:
    return format_term(simplify(term))


@pytest.mark.parametrize(
    ("term", "short"),
    [
        (sub(x, x), "0"),
        (add(mul(TWO, sub(x, t)), mul(const(-2.0), x), mul(TWO, t)), "0"),
        (add(x, mul(TWO, y), x), "2*x + 2*y"),
        (add(mul(x, y), neg(mul(y, x))), "0"),
        (add(x, neg(sub(x, ONE))), "1"),
        (sub(x, add(y, t)), "x - (y + t)"),
        (add(div(x, THREE), div(x, THREE), div(x, THREE)), "x"),
        (add(const(0.1), x, const(0.2)), "0.1 + x + 0.2"),  # 0.1 + 0.2 is not a double
        (add(const(0.1), const(1.0)), "0.1 + 1"),
        (add(const(0.1), neg(ONE), x, const(-0.1), ONE), "x"),
        (add(const(0.5), x, const(0.25)), "0.75 + x"),
        (div(mul(THREE, neg(t)), prim("neg", mul(THREE, x))), "t/x"),
        (mul(ZERO, prim("log", x)), "0"),
        (div(mul(x, t), x), "t"),
        (mul(div(x, y), y), "x"),
        (mul(x, x, x), "x^3"),
        (div(pow_(x, THREE), x), "x^2"),
        (div(x, pow_(x, THREE)), "1/x^2"),
        (div(div(x, t), t), "x/t^2"),
        (mul(prim("sqrt", x), prim("sqrt", x)), "x"),
        (pow_(mul(TWO, x), TWO), "4*x^2"),
        (mul(x, prim("sqrt", x)), "x*sqrt(x)"),
        (mul(THREE, div(x, const(6.0))), "0.5*x"),
        (mul(neg(x), neg(y)), "x*y"),
        (mul(PI, PI, x), "pi^2*x"),
        (neg(neg(x)), "x"),
        (pow_(x, ZERO), "1"),
        (prim("exp", ZERO), "1"),
        (prim("exp", prim("log", x)), "x"),
        (prim("cos", neg(x)), "cos(x)"),
        (prim("sin", neg(x)), "-sin(x)"),
        (prim("sqrt", const(16.0)), "4"),
        (prim("sqrt", TWO), "sqrt(2)"),
        (prim("max", const(2.0), const(5.0)), "5"),
        (prim("clamp", const(5.0), ZERO, ONE), "1"),
        (proj(branch((x,), False, tuple_((x, y)), tuple_((y, t))), 1), "if [x >= 0] then y else t"),
        (
            proj(integral(("x",), UNIT, branch((x,), False, tuple_((x, t)), tuple_((t, t)))), 1),
            "integral [0, 1] t d(x)",
        ),
        (area(ZERO, "x"), "0"),
        (integral(("x",), ((t, t),), x), "0"),
        (sum_("i", ONE, n, sub(var("i"), var("i"))), "0"),
        (if_(prim("lt", ONE, TWO), x, y), "x"),
        (if_(prim("not", prim("lt", x, y)), x, t), "if x < y then t else x"),
        (if_(prim("and", prim("lt", ONE, TWO), prim("lt", x, y)), x, t), "if x < y then x else t"),
        (branch((ONE,), False, x, y), "x"),
        (branch((sub(x, t),), False, y, y), "y"),
    ],
)
def test_shorter(term: Term, short: str) -> None:
    assert text(term) == short


def test_one_surface_is_decided_once() -> None:
    outer, inner = sub(x, t), sub(mul(TWO, t), mul(TWO, x))
    nested = branch((outer,), False, add(ONE, branch((inner,), True, x, y)), branch((outer,), False, x, t))
    assert text(nested) == "if [t <= x] then y + 1 else t"


def test_sides_that_differ_on_the_surface_stay() -> None:
    nested = branch((x,), False, branch((x,), True, ONE, TWO), THREE)  # 2 where x = 0
    assert simplify(nested) is nested
    assert simplify(branch((x,), True, branch((x,), False, ONE, TWO), THREE)) is branch((x,), True, ONE, THREE)
    flipped = branch((x,), False, branch((neg(x),), False, ONE, TWO), THREE)  # 1 where x = 0
    assert simplify(flipped) is flipped


def test_a_surface_under_its_own_binder_is_another_one() -> None:
    inner = integral(("x",), UNIT, bracket(sub(x, t)))
    assert simplify(branch((sub(x, t),), False, inner, ONE)).then is inner  # type: ignore[union-attr]


@settings(deadline=None, max_examples=200)
@given(term=terms())
def test_values_are_kept(term: Term) -> None:
    """At 30 digits. Cancellation may define a term in more places, never in fewer."""
    short = simplify(term)
    assert not lint(short)
    for point in POINTS:
        before, after = evaluate(term, point), evaluate(short, point)
        if mp.isfinite(before) and abs(before) < 1e30 and not near_a_surface(term, point):
            assert abs(before - after) <= mp.mpf("1e-12") * max(1, abs(before), size(term, point))


def size(term: Term, point: dict[str, float]) -> mp.mpf:
    """The greatest number met on the way: doubles in coefficients are rounded relative to it."""
    return max(abs(v) for node in postorder(term) if mp.isfinite(v := evaluate(node, point)))


def near_a_surface(term: Term, point: dict[str, float]) -> bool:
    """Where a branch decides by the sign of what is zero but for rounding, either answer is right."""
    sides = [evaluate(node.surface, point) for node in postorder(term) if isinstance(node, Branch)]
    return any(mp.isnan(side) or abs(side) < 1e-12 for side in sides)


@settings(deadline=None, max_examples=200)
@given(term=terms())
def test_simplifying_twice_changes_nothing_more(term: Term) -> None:
    once = simplify(term)
    assert len(postorder(simplify(once))) <= len(postorder(once))


# Surfaces


@pytest.mark.parametrize("scale", [2.0, 3.0, 0.1, 1e160, 1e-160, 7.0])
def test_scaled_and_flipped_surfaces_are_one(scale: float) -> None:
    one, side = normalized_surface(sub(t, x))
    for same in (
        mul(const(scale), sub(t, x)),
        sub(mul(const(scale), t), mul(const(scale), x)),
        div(sub(t, x), const(scale)),
    ):
        assert normalized_surface(same) == (one, side)
    for flipped in (sub(x, t), mul(const(scale), sub(x, t)), add(neg(t), x)):
        assert normalized_surface(flipped) == (one, -side)


def test_surfaces_that_need_rewriting() -> None:
    disc = sub(pow_(s, TWO), add(mul(x, x), pow_(y, TWO)))
    assert normalized_surface(disc)[0] is normalized_surface(sub(add(mul(y, y), mul(x, x)), mul(s, s)))[0]
    assert normalized_surface(prim("sin", sub(x, t)))[0] is normalized_surface(prim("sin", sub(t, x)))[0]
    assert normalized_surface(mul(sub(x, y), add(x, y)))[0] is normalized_surface(sub(mul(y, y), mul(x, x)))[0]
    call = app(global_("m", "f"), (sub(x, t),))
    assert normalized_surface(sub(call, ONE))[0] is normalized_surface(sub(ONE, call))[0]


def test_surfaces_that_differ() -> None:
    surfaces = [
        sub(t, x),
        add(t, x),
        sub(t, mul(TWO, x)),
        sub(t, add(x, const(1e-15))),
        prim("exp", x),
        mul(s, sub(t, x)),
    ]
    assert len({normalized_surface(surface)[0] for surface in surfaces}) == len(surfaces)


@settings(deadline=None, max_examples=200)
@given(term=terms(), scale=st.sampled_from((-2.0, 0.3, 1e100, -1.0)))
def test_a_surface_keeps_its_side(term: Term, scale: float) -> None:
    canonical, side = normalized_surface(term)
    other, other_side = normalized_surface(mul(const(scale), term))
    for point in POINTS:
        value, found = evaluate(term, point), evaluate(canonical, point)
        if mp.isfinite(value) and mp.isfinite(found) and abs(value) > 1e-12 * size(term, point):
            assert mp.sign(value) == side * mp.sign(found)
            assert other is not canonical or side * other_side == math.copysign(1, scale)


@settings(deadline=None, max_examples=200)
@given(term=terms())
def test_normal_forms_are_exact(term: Term) -> None:
    written = as_term(normal_form(term))
    assume(written is not None)
    for point in POINTS:
        before, after = evaluate(term, point), evaluate(written, point)  # type: ignore[arg-type]
        if mp.isfinite(before) and mp.isfinite(after) and abs(before) < 1e30 and not near_a_surface(term, point):
            assert abs(before - after) <= mp.mpf("1e-25") * max(1, size(term, point) ** 2)


def test_normal_form_of_an_affine_term() -> None:
    form = normal_form(sub(div(x, THREE), mul(const(0.1), t)))
    assert form == {((x, 1),): Fraction(1, 3), ((t, 1),): -Fraction(0.1)}


# Size


def test_deep_and_wide_terms() -> None:
    deep: Term = x
    for _ in range(4000):
        deep = prim("sin", add(deep, c))
    assert simplify(deep) is deep
    wide = add(*(mul(const(k), x) for k in range(1, 2001)))
    assert text(wide) == "2001000*x"
    ladder: Term = ZERO
    for k in range(400):
        ladder = branch((sub(x, const(k)),), False, ladder, const(k + 1.0))
    assert not lint(simplify(ladder))
    shared: Term = x
    for _ in range(60):  # 2^60 nodes if sharing were lost
        shared = prim("max", shared, prim("sin", shared))
    assert len(postorder(simplify(shared))) == 121


def test_substitution_then_simplification() -> None:
    """What the integrator does where two surfaces meet."""
    assert simplify(substitute(add(x, y, c), {"y": neg(add(x, c))})) is ZERO
    assert simplify(lam(("x",), sub(x, x))) is lam(("x",), ZERO)
