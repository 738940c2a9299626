"""Symbolic derivatives of smooth terms, against differences of the oracle at high precision."""

from __future__ import annotations

import pytest
from core_terms import HALF, THREE, TWO, area, bracket, c, n, s, t, terms, x, y
from hypothesis import given, settings
from lint import lint
from mpmath import mp

from potto.calculus.differentiation.derivative import NotSmooth, partial
from potto.core.printer import format_term
from potto.core.reference import evaluate
from potto.core.simplify import simplify
from potto.core.terms import (
    INF,
    ONE,
    ZERO,
    Term,
    add,
    app,
    bound_names,
    branch,
    const,
    delta,
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
    sum_,
    tuple_,
    var,
)

POINT = {"x": 0.37, "y": 0.81, "t": 0.62, "s": 1.3, "c": -0.45, "n": 4.0}
BELL = prim("exp", neg(mul(x, x)))


def slope(term: Term, name: str, env: dict[str, float], digits: int) -> mp.mpf:
    """The central difference of order 4 at h: an error of h^4 times a fifth derivative."""
    h = mp.mpf(10) ** (-digits / 4)

    def at(k: int) -> mp.mpf:
        return evaluate(term, {**env, name: mp.mpf(env[name]) + k * h}, digits=digits + digits // 4)

    with mp.workdps(digits + 25):
        return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h)


def bound(term: Term) -> list[str]:
    return [name for node in postorder(term) for name in bound_names(node)]


def check(term: Term, name: str, env: dict[str, float] = POINT, digits: int = 24) -> None:
    """To all the digits that the difference has, but for six that may go into a large fifth derivative."""
    found = partial(term, name)
    assert not lint(found)
    wanted = slope(term, name, env, digits)
    value = evaluate(found, env, digits=digits)
    assert abs(value - wanted) <= mp.mpf(10) ** (6 - digits) * max(1, abs(wanted))


@pytest.mark.parametrize(
    "term",
    [
        mul(x, y, x),
        div(mul(x, y), add(x, t)),
        div(ONE, x),
        pow_(x, THREE),
        pow_(x, const(-1.5)),
        pow_(TWO, x),
        pow_(x, x),
        pow_(x, n),
        prim("atan2", x, y),
        prim("hypot", mul(x, x), y),
        prim("max", x, mul(TWO, x), y),
        prim("min", x, y, t),
        prim("clamp", x, mul(HALF, x), mul(x, x)),
        prim("clamp", x, ZERO, ONE),
        prim("abs", sub(x, y)),
        prim("erf", prim("tanh", x)),
        branch((sub(x, y),), False, prim("sin", x), prim("cos", x)),
        if_(prim("lt", y, ONE), mul(x, x), x),
        prim("floor", mul(const(10.0), x)),
        sum_("i", ONE, n, pow_(x, var("i"))),
        sum_("i", ONE, n, mul(var("i"), t)),
        app(lam(("u", "v"), mul(var("u"), prim("exp", var("v")))), (x, mul(x, y))),
        mul(*(add(x, const(k)) for k in range(40))),
    ],
)
def test_builtins_and_choices(term: Term) -> None:
    check(term, "x")


@pytest.mark.parametrize(
    "term",
    [
        area(mul(prim("exp", mul(t, x)), y), "x"),
        integral(("x",), ((ZERO, t),), prim("sin", mul(t, x))),
        integral(("x",), ((mul(t, t), ONE),), x),
        integral(("x",), ((t, neg(t)),), prim("exp", x)),
        integral(("x",), ((neg(INF), t),), BELL, ((ZERO,),)),
        pytest.param(integral(("x",), ((ZERO, t),), integral(("y",), ((x, t),), mul(t, y))), marks=pytest.mark.slow),
        mul(t, area(bracket(sub(x, HALF)), "x")),
        area(mul(t, bracket(sub(x, HALF))), "x"),
        area(branch((sub(t, HALF),), False, mul(t, t, x), ONE), "x"),
        mul(t, integral(("x",), ((ZERO, ONE),), mul(x, delta((sub(x, HALF),))))),
    ],
)
def test_integrals(term: Term) -> None:
    """Leibniz's rule, also where bounds of inner variables move. The oracle is slow in two dimensions."""
    check(term, "t", digits=12 if len(bound(term)) > 1 else 24)


def test_integrals_of_tuples() -> None:
    term = integral(("x",), ((ZERO, mul(t, t)),), tuple_((mul(x, t), ONE)))
    found = partial(term, "t")
    # The parts are t^5/2 and t^2.
    assert abs(evaluate(proj(found, 0), {"t": 0.7}) - mp.mpf("2.5") * mp.mpf(0.7) ** 4) < 1e-25
    assert abs(evaluate(proj(found, 1), {"t": 0.7}) - 2 * mp.mpf(0.7)) < 1e-25


def test_tuples_and_zeros() -> None:
    assert evaluate(partial(tuple_((mul(x, x), y)), "x"), POINT) == (2 * mp.mpf(0.37), 0)
    chosen = branch((y,), False, tuple_((x, y)), tuple_((y, y)))
    assert simplify(partial(proj(chosen, 0), "x")) is branch((y,), False, ONE, ZERO)
    assert partial(proj(chosen, 0), "t") is ZERO
    assert partial(area(y, "x"), "t") is ZERO
    assert partial(global_("m", "f"), "x") is ZERO


def test_what_is_taken_apart_multiplies_nothing_by_zero() -> None:
    """sqrt(y) is nan for negative y: selected away, not multiplied away."""
    found = partial(prim("max", x, prim("sqrt", y)), "y")
    assert format_term(found) == "if [sqrt(y) <= x] then 0 else 0.5/sqrt(y)"
    assert format_term(partial(prim("abs", sub(x, t)), "x")) == "if [t <= x] then 1 else -1"


@pytest.mark.parametrize(
    ("term", "text"),
    [
        (mul(THREE, x, x), "6*x"),
        (div(ONE, x), "-1/x^2"),
        (prim("sqrt", x), "0.5/sqrt(x)"),
        (prim("log", mul(TWO, x)), "1/x"),
        (pow_(x, THREE), "3*x^2"),
        (prim("exp", neg(mul(x, t))), "-exp(-x*t)*t"),
        (div(ONE, add(mul(prim("sqrt", TWO), add(x, y, c)), TWO)), "-sqrt(2)/(sqrt(2)*(x + y + c) + 2)^2"),
    ],
)
def test_derivatives_read_well(term: Term, text: str) -> None:
    assert format_term(simplify(partial(term, "x"))) == text


def test_what_is_not_smooth() -> None:
    for term in (
        area(bracket(sub(t, x)), "x"),
        area(area(bracket(sub(x, t)), "y"), "x"),
        area(delta((sub(x, t),)), "x"),
        app(global_("m", "f"), (t,)),
        lam(("x",), t),
    ):
        with pytest.raises(NotSmooth):
            partial(term, "t")


def test_bound_names_do_not_capture() -> None:
    term = integral(("x",), ((ZERO, x),), mul(x, y))  # the bound is the outer x
    found = partial(term, "x")
    assert abs(evaluate(found, {"x": 0.4, "y": 3.0}) - mp.mpf(0.4) * 3) < 1e-25


@settings(deadline=None, max_examples=40)
@given(term=terms())
def test_random_terms(term: Term) -> None:
    found = partial(term, "x")
    assert not lint(found)
    env = {"x": 0.3171, "y": -1.2113, "t": 0.7331}
    with mp.workdps(60):
        values = [evaluate(term, {**env, "x": mp.mpf(env["x"]) + k * mp.mpf("1e-15")}, digits=40) for k in (-1, 0, 1)]
        if not all(mp.isfinite(v) and abs(v) < 1e6 for v in values):
            return
        wanted = (values[2] - values[0]) / mp.mpf("2e-15")
        kinked = abs(values[2] - 2 * values[1] + values[0]) > 1e-20  # a kink or a pole nearby
    got = evaluate(found, env)
    if not kinked and mp.isfinite(got):
        assert abs(got - wanted) <= mp.mpf("1e-9") * max(1, abs(wanted))  # second order: 1e-30 times a third derivative


def test_deep_terms() -> None:
    deep: Term = x
    for _ in range(3000):
        deep = prim("sin", add(deep, s))
    assert len(postorder(partial(deep, "x"))) < 20_000
    product = mul(*(add(x, const(k)) for k in range(2000)))
    assert len(postorder(partial(product, "x"))) < 50_000
    ladder: Term = x
    for k in range(2000):
        ladder = branch((sub(y, const(k)),), False, ladder, mul(x, const(k)))
    assert len(postorder(partial(ladder, "x"))) < 20_000
    assert partial(proj(ladder, 0), "y") is not None
