"""The oracle against closed forms: 25 of the 30 digits asked for, unless a test says otherwise."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from core_terms import HALF, TWO, UNIT, area, bracket, c, s, t, x, y
from mpmath import mp

from potto.core.reference import NotAccurate, evaluate
from potto.core.terms import (
    INF,
    ONE,
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


def close(found: object, wanted: object, digits: int = 25) -> None:
    if isinstance(wanted, tuple):
        assert isinstance(found, tuple) and len(found) == len(wanted)
        for part, other in zip(found, wanted, strict=True):
            close(part, other, digits)
    else:
        assert abs(found - wanted) <= mp.mpf(10) ** -digits * max(1, abs(wanted))  # type: ignore[operator]


def dual(value: Term, tangent: Term = ONE) -> Term:
    return tuple_((value, tangent))


f = global_("m", "f")


@pytest.mark.parametrize(
    ("term", "wanted"),
    [
        (area(bracket(sub(t, x)), "x"), lambda t: t),
        (area(mul(x, bracket(sub(mul(const(3.0), x), t))), "x"), lambda t: (1 - t**2 / 9) / 2),
        (integral(("x",), ((ONE, ZERO),), prim("exp", mul(t, x))), lambda t: (1 - mp.exp(t)) / t),
        (integral(("x",), ((ZERO, INF),), prim("exp", neg(mul(t, x)))), lambda t: 1 / t),
        (
            integral(("x",), ((neg(INF), t),), prim("exp", neg(mul(x, x)))),
            lambda t: mp.sqrt(mp.pi) / 2 * (1 + mp.erf(t)),
        ),
        (area(prim("abs", sub(x, t)), "x"), lambda t: t**2 / 2 + (1 - t) ** 2 / 2),
        (area(prim("max", x, sub(ONE, x), t), "x"), lambda t: mp.mpf(3) / 4 + max(t - mp.mpf(1) / 2, 0) ** 2),
        (area(prim("sin", add(mul(const(3.0), bracket(sub(t, x))), x)), "x"), lambda t: three_sines(t)),
        (area(div(ONE, add(ONE, bracket(sub(t, x)))), "x"), lambda t: t / 2 + (1 - t)),
        (integral(("x",), ((t, t),), div(ONE, x)), lambda t: mp.mpf(0)),
        (integral(("x",), ((neg(ONE), ONE),), bracket(sub(mul(t, t), mul(x, x)))), lambda t: 2 * t),
        (
            integral(("x",), ((neg(ONE), ONE),), bracket(sub(mul(const(1e-8), t), mul(x, x)))),
            lambda t: 2 * mp.sqrt(mp.mpf(1e-8) * t),
        ),
    ],
)
@pytest.mark.parametrize("value", [0.37, 0.625])
def test_integrals(term: Term, wanted: Callable[[mp.mpf], mp.mpf], value: float) -> None:
    close(evaluate(term, {"t": value}), wanted(mp.mpf(value)))


def three_sines(t: mp.mpf) -> mp.mpf:
    return (mp.cos(3) - mp.cos(3 + t)) + (mp.cos(t) - mp.cos(1))


def test_a_singular_end() -> None:
    close(evaluate(area(pow_(x, neg(HALF)), "x")), 2)
    close(evaluate(integral(("x",), ((ZERO, t),), div(ONE, prim("sqrt", sub(t, x)))), {"t": 0.3}), 2 * mp.sqrt(0.3))
    close(evaluate(area(mul(prim("log", x), prim("log", x)), "x")), 2)


@pytest.mark.slow
def test_two_dimensions() -> None:
    half_plane = integral(("x", "y"), UNIT * 2, mul(x, y, bracket(add(x, y, c))))
    q = mp.mpf("0.8")
    close(evaluate(half_plane, {"c": -q}, digits=8), mp.mpf(1) / 4 - q**4 / 24, 12)
    triangle = integral(("x", "y"), ((ZERO, ONE), (ZERO, sub(ONE, x))), bracket(sub(sub(ONE, x), y)))
    close(evaluate(triangle, digits=8), mp.mpf(1) / 2, 12)


@pytest.mark.slow
def test_a_disc() -> None:
    """Two roots that are born between the points of a grid, and square roots at both ends."""
    inside = sub(mul(s, s), add(mul(x, x), mul(y, y)))
    disc = integral(("x", "y"), ((neg(ONE), ONE),) * 2, bracket(inside))
    close(evaluate(disc, {"s": 0.7}, digits=10), mp.pi * mp.mpf(0.7) ** 2, 14)


def test_tuples_under_an_integral() -> None:
    term = area(branch((sub(x, t),), False, tuple_((x, ONE)), tuple_((ZERO, TWO))), "x")
    t0 = mp.mpf(0.25)
    close(evaluate(term, {"t": 0.25}), ((1 - t0**2) / 2, 1 + t0))


@pytest.mark.parametrize(
    ("term", "wanted"),
    [
        (
            integral(("x",), ((neg(ONE), TWO),), mul(prim("exp", x), delta((sub(x, HALF),)))),
            lambda: mp.exp(mp.mpf("0.5")),
        ),
        (
            integral(("x",), ((neg(ONE), TWO),), mul(prim("exp", x), delta((sub(mul(x, x), const(0.25)),)))),
            lambda: 2 * mp.cosh(mp.mpf("0.5")),
        ),
        (area(delta((sub(x, TWO),)), "x"), lambda: 0),
        (area(mul(x, delta((mul(const(-4.0), sub(x, HALF)),))), "x"), lambda: mp.mpf(1) / 8),
        (add(ONE, area(add(ONE, delta((sub(x, HALF),))), "x")), lambda: 3),
    ],
)
def test_deltas(term: Term, wanted: Callable[[], mp.mpf]) -> None:
    """f/|u'| at the roots of u."""
    close(evaluate(term), wanted(), 20)


# Functions


def test_calls_and_definitions() -> None:
    definitions = {
        "f": lam(("x", "y"), lam(("c",), add(x, mul(TWO, y), c))),
        "fact": lam(("x",), if_(prim("lt", ZERO, x), mul(x, app(global_("m", "fact"), (sub(x, ONE),))), ONE)),
    }

    def lookup(module: str, name: str) -> Term:
        assert module == "m"
        return definitions[name]

    spread = app(app(f, (tuple_((ONE, TWO)),)), (t,))
    assert evaluate(spread, {"t": 3.0}, lookup) == 8
    assert evaluate(app(app(f, (ONE, TWO)), (t,)), {"t": 3.0}, lookup) == 8
    assert evaluate(app(global_("m", "fact"), (const(20.0),)), {}, lookup) == mp.factorial(20)
    assert evaluate(app(global_("m", "fact"), (const(300.0),)), {}, lookup) > 0
    pair = lam(("x",), proj(var("x"), 1))
    assert evaluate(app(pair, (ONE, TWO))) == 2
    assert evaluate(list_of((ONE, sum_("i", ONE, const(4.0), var("i"))))) == [1, 10]
    assert evaluate(sum_("i", ONE, ZERO, var("i"))) == 0
    assert evaluate(app(var("g"), (ONE,)), {"g": lambda v: v + 1}) == 2


def test_branches_inside_called_functions_are_seen() -> None:
    step = lam(("x",), bracket(sub(x, t)))
    close(evaluate(area(mul(x, app(step, (mul(TWO, x),))), "x"), {"t": 0.5}), (1 - mp.mpf(1) / 16) / 2)


def test_only_the_branch_that_is_taken() -> None:
    guarded = branch((x,), False, prim("sqrt", x), ZERO)
    close(evaluate(integral(("x",), ((neg(ONE), ONE),), guarded)), mp.mpf(2) / 3)
    assert mp.isnan(evaluate(prim("sqrt", neg(ONE))))
    assert evaluate(div(ONE, ZERO)) == mp.inf and mp.isnan(evaluate(div(ZERO, ZERO)))


def test_a_condition_on_an_inner_integral() -> None:
    inner = integral(("y",), ((ZERO, x),), y)  # x^2/2
    close(evaluate(area(bracket(sub(inner, t)), "x"), {"t": 0.18}, digits=15), 1 - mp.sqrt(2 * mp.mpf(0.18)), 12)


# Derivatives


def test_the_derivative_of_a_moving_jump() -> None:
    paper = lam(("t",), area(bracket(sub(t, x), strict=True), "x"))
    for value, slope in ((0.3, 1), (1.5, 0), (-0.5, 0)):
        close(
            evaluate(app(deriv(paper), (dual(const(value), TWO),))),
            (min(max(mp.mpf(value), 0), 1), 2 * mp.mpf(slope)),
            20,
        )


def test_a_plain_number_for_a_dual_stands_still() -> None:
    product = lam(("x", "y"), mul(x, x, y))
    close(evaluate(app(deriv(product), (dual(const(3.0)), TWO))), (mp.mpf(18), mp.mpf(12)))
    close(evaluate(app(deriv(product), (tuple_((dual(const(3.0)), dual(TWO))),))), (mp.mpf(18), mp.mpf(21)))


def test_derivatives_of_functions_of_functions() -> None:
    """The paper's renderer in one dimension: the shader moves too."""
    shader = lam(("x",), lam(("c",), prim("exp", mul(c, x))))
    renderer = lam(("c", "g"), area(mul(app(app(var("g"), (x,)), (c,)), bracket(add(x, c))), "x"))
    found = evaluate(app(deriv(renderer), (dual(neg(const(0.5))), deriv(shader))))
    cc = mp.mpf("-0.5")

    def antiderivative(v: mp.mpf) -> mp.mpf:  # of x exp(c x)
        return mp.exp(cc * v) * (v / cc - 1 / cc**2)

    value = (mp.exp(cc) - mp.exp(-cc * cc)) / cc
    close(found, (value, antiderivative(mp.mpf(1)) - antiderivative(-cc) + mp.exp(-cc * cc)), 20)


def test_second_derivatives() -> None:
    cube = lam(("x",), mul(x, x, x))
    found = evaluate(app(deriv(deriv(cube)), (tuple_((dual(TWO), dual(ONE, ZERO))),)), digits=40)
    close(found, ((mp.mpf(8), mp.mpf(12)), (mp.mpf(12), mp.mpf(12))), 15)


def test_tuples_have_tuples_of_duals() -> None:
    split = lam(("t",), tuple_((t, mul(t, t))))
    close(evaluate(app(deriv(split), (dual(const(3.0)),))), ((mp.mpf(3), mp.mpf(1)), (mp.mpf(9), mp.mpf(6))), 20)


@pytest.mark.slow
def test_what_it_cannot_vouch_for() -> None:
    with pytest.raises(NotAccurate):
        evaluate(area(div(ONE, x), "x"))
    with pytest.raises(ValueError, match="the program is wrong here"):
        from potto.core.terms import hole

        evaluate(hole("unreadable"))
