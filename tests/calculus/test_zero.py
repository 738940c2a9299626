"""What is 0 wherever it is defined is found, by its normal form or by digits."""

from __future__ import annotations

import math

import pytest

from potto.calculus.algebra.point_values import not_zero
from potto.calculus.algebra.rational_form import is_zero
from potto.core.terms import (
    ONE,
    PI,
    ZERO,
    Term,
    add,
    app,
    branch,
    const,
    div,
    global_,
    if_,
    mul,
    pow_,
    prim,
    sub,
    var,
)

x, y, t = map(var, "xyt")
TWO = const(2.0)
BUMP = mul(sub(y, const(0.3)), sub(const(0.31), y))  # positive where 0.3 < y < 0.31


@pytest.mark.parametrize(
    "term",
    [
        sub(mul(x, y), mul(y, x)),
        sub(pow_(add(x, y), TWO), add(mul(x, x), mul(TWO, x, y), mul(y, y))),
        sub(mul(sub(x, y), add(x, y)), sub(mul(x, x), mul(y, y))),
        add(pow_(prim("sin", x), TWO), pow_(prim("cos", x), TWO), const(-1.0)),
        sub(prim("tanh", x), div(prim("sinh", x), prim("cosh", x))),
        sub(prim("exp", add(x, y)), mul(prim("exp", x), prim("exp", y))),
        sub(prim("sin", mul(TWO, x)), mul(TWO, prim("sin", x), prim("cos", x))),
        sub(prim("erf", x), sub(ONE, prim("erfc", x))),
        sub(prim("atan", x), prim("asin", div(x, prim("sqrt", add(ONE, mul(x, x)))))),
        sub(prim("max", x, y), div(add(x, y, prim("abs", sub(x, y))), TWO)),
        sub(prim("hypot", x, y), prim("sqrt", add(mul(x, x), mul(y, y)))),
        sub(prim("clamp", x, y, t), prim("min", prim("max", x, y), t)),
        sub(branch((sub(x, t),), False, x, y), branch((sub(t, x),), True, y, x)),
        branch((BUMP,), False, sub(x, x), const(math.nan)),
        sub(app(global_("m", "f"), (add(x, y),)), app(global_("m", "f"), (add(y, x),))),
    ],
)
def test_zero(term: Term) -> None:
    assert is_zero(term)


@pytest.mark.parametrize(
    "term",
    [
        sub(mul(const(1.0000000000000002), x), x),  # one unit in the last place
        mul(const(1e-300), x),
        add(pow_(prim("sin", x), TWO), pow_(prim("cos", x), TWO), const(-1.0000000000000002)),
        sub(prim("atan2", x, t), prim("atan", div(x, t))),  # equal where t > 0 only
        sub(prim("sqrt", mul(x, x)), x),
        sub(app(global_("m", "f"), (x,)), app(global_("m", "f"), (y,))),
        prim("max", ZERO, BUMP),
        branch((BUMP,), False, x, ZERO),
        if_(prim("lt", ZERO, BUMP), x, ZERO),
        sub(prim("floor", add(y, const(0.69))), prim("floor", add(y, const(0.7)))),
        sub(
            add(mul(x, add(x, y)), prim("exp", mul(const(-1e6), pow_(sub(y, const(0.3)), TWO)))),
            add(mul(x, x), mul(x, y)),
        ),
        prim("log", prim("neg", mul(x, x))),  # defined nowhere
        PI,
    ],
)
def test_not_zero(term: Term) -> None:
    assert not is_zero(term)


def test_doubles_tell_nested_roots_apart() -> None:
    def nested(inside: Term) -> Term:
        return prim("sqrt", pow_(inside, const(2 / 3)))

    square = add(mul(x, x), ONE)
    assert not_zero(sub(nested(square), nested(add(square, const(1e-7)))))
    assert not not_zero(sub(nested(square), pow_(square, const(1 / 3))))
