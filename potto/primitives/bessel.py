"""Bessel functions of the first kind and sinc: entire functions that oscillate and die off.

All of them are 0F1(a; -x^2/4) times a power of x, and so are all their derivatives, which lose no digits near 0 that
way. On the real line they are means of cosines, so that their derivatives are bounded by means of powers: |J0''| <= 1/2
and |sinc''| <= 1/3 (NIST, Digital Library of Mathematical Functions, 10.9 and 10.54).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from potto.core.terms import ONE, ZERO, Term, add, const, div, if_, mul, neg, prim, sub
from potto.primitives.bounds import exponential
from potto.primitives.registry import Elementwise, Ends, Primitive, register

TOPIC = "Bessel functions"
TWO, FOUR = const(2.0), const(4.0)
MOST = 1e-15  # of the values below on the real line: rounding of what is worked out from them


def _series(a: float, x: Term) -> Term:
    return prim("hyp0f1", const(a), neg(div(mul(x, x), FOUR)))


def _tangent_bounds(
    op: str, slope: Callable[[Elementwise, Any], Any], bend: float, fall: Callable[[Elementwise, Any], Any]
) -> Callable[[Elementwise, Ends], Ends]:
    """By the tangent at the middle and a bound of the second derivative; no wider than what holds as far out."""

    def run(ops: Elementwise, a: Ends) -> Ends:
        lo, hi = a
        middle, reach = 0.5 * (lo + hi), 0.5 * (hi - lo)
        value = ops.of(op)(middle)
        away = abs(slope(ops, middle)) * reach + bend * reach * reach + MOST * (1 + abs(middle))
        nearest = ops.where((lo <= 0) & (hi >= 0), 0.0, ops.least(abs(lo), abs(hi)))
        most = ops.least(fall(ops, nearest), 1.0)
        low, high = value - away, value + away
        low, high = ops.where(low == low, low, -1.0), ops.where(high == high, high, 1.0)
        return ops.most(low, -most), ops.least(high, most)

    return run


def _root_fall(ops: Elementwise, x: Any) -> Any:
    """sqrt(2/(pi x)) bounds J0, and times 1.04 also J1 (its largest is 0.5819 at 1.84, where the bound is 0.61)."""
    return 1.04 * ops.of("sqrt")(ops.of("div")(2 / math.pi, ops.most(x, 1e-300)))


def _spread(ops: Elementwise, a: Any, z: Ends) -> tuple[Any, Any]:
    """0F1(a; z): it rises for z > 0; for z <= 0 and a >= 1/2 it is a mean of cosines, as are its derivatives."""
    f = ops.of("hyp0f1")
    lo, hi = ops.least(z[0], 0.0), ops.least(z[1], 0.0)
    middle, reach = 0.5 * (lo + hi), 0.5 * (hi - lo)
    value = f(a, middle)
    away = abs(f(a + 1, middle)) / a * reach + reach * reach / (2 * a * (a + 1)) + MOST * (1 + abs(middle))
    low, high = value - away, value + away
    low = ops.most(ops.where(low == low, low, -1.0), -1.0)
    high = ops.least(ops.where(high == high, high, 1.0), 1.0)
    above = ops.most(z[0], 0.0), ops.most(z[1], 0.0)
    return ops.where(z[0] > 0, f(a, above[0]), low), ops.where(z[1] > 0, f(a, above[1]), high)


def _hyp_remainder(ops: Elementwise, a: Any, m: Any, d: Any) -> Any:
    """Every derivative is a 0F1 with a larger a, and bounded by 1 where m <= 0."""
    f = ops.of("hyp0f1")
    tail = f(a, d) - 1 - d / a
    return ops.most(f(a, ops.most(m, 0.0)), 1.0) * (tail + MOST * (1 + d))


hyp0f1 = register(
    Primitive(
        "hyp0f1",
        arity=2,
        orders=1,
        numpy="special.hyp0f1",
        mpmath="hyp0f1",
        ulp=8.0,
        off=1e-15,
        surface=False,
        doc="The confluent hypergeometric limit function 0F1(a; z), for a number a from 1/2.",
        partials=lambda a, z: (ZERO, div(prim("hyp0f1", add(a, ONE), z), a)),
        domain=((1.0, 5.0), (-400.0, 4.0)),
        interval=lambda ops, a, z: _spread(ops, a[0], z),
        remainder=_hyp_remainder,
        example="sinc(1)",
    )
)

besselj0 = register(
    Primitive(
        "besselj0",
        arity=1,
        formula=lambda x: _series(1.0, x),
        numpy="potto.besselj0",
        ulp=4.0,
        off=4e-16,
        doc="The Bessel function of the first kind of order 0.",
        topic=TOPIC,
        partials=lambda x: (neg(prim("besselj1", x)),),
        domain=((-200.0, 200.0),),
        parity=1,
        values=((0.0, 1.0),),
        image=(-0.403, 1.0),
        interval=_tangent_bounds("besselj0", lambda ops, x: ops.of("besselj1")(x), 0.25, _root_fall),
        remainder=lambda ops, m, d: 0.5 * exponential(ops, d),
        example="besselj0(1)",
    )
)


def _sinc_slope(ops: Elementwise, x: Any) -> Any:
    return -x / 3 * ops.of("hyp0f1")(2.5, -0.25 * x * x)


sinc = register(
    Primitive(
        "sinc",
        arity=1,
        formula=lambda x: if_(prim("eq", x, ZERO), ONE, div(prim("sin", x), x)),
        mpmath="sinc",
        ulp=3.0,
        doc="sin(x)/x, and 1 at 0.",
        topic="Angles",
        partials=lambda x: (mul(neg(div(x, const(3.0))), _series(2.5, x)),),
        domain=((-200.0, 200.0),),
        parity=1,
        values=((0.0, 1.0),),
        image=(-0.2173, 1.0),
        interval=_tangent_bounds("sinc", _sinc_slope, 1 / 6, lambda ops, x: ops.of("div")(1.0, x)),
        remainder=lambda ops, m, d: exponential(ops, d) / 3,
        example="sinc(1)",
    )
)


def _order_two(x: Term) -> Term:
    return mul(div(mul(x, x), const(8.0)), _series(3.0, x))


def _slope_of_one(ops: Elementwise, x: Any) -> Any:
    return 0.5 * (ops.of("besselj0")(x) - x * x / 8 * ops.of("hyp0f1")(3.0, -0.25 * x * x))


besselj1 = register(
    Primitive(
        "besselj1",
        arity=1,
        formula=lambda x: mul(div(x, TWO), _series(2.0, x)),
        numpy="potto.besselj1",
        ulp=4.0,
        off=4e-16,
        doc="The Bessel function of the first kind of order 1.",
        topic=TOPIC,
        partials=lambda x: (div(sub(prim("besselj0", x), _order_two(x)), TWO),),
        domain=((-200.0, 200.0),),
        parity=-1,
        image=(-0.582, 0.582),
        interval=_tangent_bounds("besselj1", _slope_of_one, 0.25, _root_fall),
        remainder=lambda ops, m, d: 0.5 * exponential(ops, d),
        example="besselj1(1)",
    )
)
