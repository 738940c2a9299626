"""Bessel functions of the first kind and sinc: entire functions that oscillate and die off.

Derivatives are differences of neighbours in order, which keep their digits near 0 and far out alike. On the real line
all of these functions are means of cosines: J_n(x) of cos(n s - x sin s), the spherical j_n(x) of what exp(i x s) is
times a Legendre polynomial. So no derivative is larger than 1 anywhere, |J0''| <= 1/2 and |sinc''| <= 1/3 (NIST,
Digital Library of Mathematical Functions, 10.6, 10.9, 10.51 and 10.54).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from potto.core.terms import ONE, TWO, ZERO, Term, add, div, if_, mul, neg, prim, sub
from potto.primitives.bounds import exponential
from potto.primitives.registry import EPS, Elementwise, Ends, Primitive, Quantity, register

TOPIC = "Bessel functions"
MOST = 1e-15  # of the values below on the real line: rounding of what is worked out from them
# In halves of a last place of the largest value nearby, and at 0 of the power of x that it falls with: 16 and 5 are the
# most among 2,000 points up to 1e9 of each of the orders 0 to 4, for `jv` and `spherical_jn`; 4 up to 25 by `j0`, `j1`.
FAR, SPHERICAL, NEAR = 20.0, 6.0, 4.0


def _tangent_bounds(
    op: str, slope: Callable[..., Quantity], bend: float, fall: Callable[[Elementwise, Quantity], Quantity]
) -> Callable[..., Ends]:
    """By the tangent at the middle and a bound of the second derivative; no wider than what holds as far out."""

    def run(ops: Elementwise, *args: Ends) -> Ends:
        orders, (lo, hi) = [order for order, _ in args[:-1]], args[-1]
        middle, reach = 0.5 * (lo + hi), 0.5 * (hi - lo)
        value = ops.of(op)(*orders, middle)
        away = abs(slope(ops, *orders, middle)) * reach + bend * reach * reach + MOST * (1 + abs(middle))
        nearest = ops.where((lo <= 0) & (hi >= 0), 0.0, ops.least(abs(lo), abs(hi)))
        most = ops.least(fall(ops, nearest), 1.0)
        low, high = value - away, value + away
        low, high = ops.where(low == low, low, -1.0), ops.where(high == high, high, 1.0)
        return ops.most(low, -most), ops.least(high, most)

    return run


def _amplitude(x: Quantity) -> Quantity:
    """What |J0| and |J1| are no larger than, to within 1.04."""
    return (2 / math.pi / (abs(x) + 2 / math.pi)) ** 0.5


def _near(x: Quantity) -> Quantity:
    """|x| near 0, and 1 far from it."""
    return abs(x) / (1 + abs(x))


def _entire_remainder(ops: Elementwise, n: Quantity, m: Quantity, d: Quantity) -> Quantity:
    return exponential(ops, d)


def _root_fall(ops: Elementwise, x: Quantity) -> Quantity:
    """sqrt(2/(pi x)) bounds J0, and times 1.04 also J1 (its largest is 0.5819 at 1.84, where the bound is 0.61)."""
    return 1.04 * ops.of("sqrt")(ops.of("div")(2 / math.pi, ops.most(x, 1e-300)))


def _halved_difference(n: Term, x: Term) -> Term:
    return div(sub(prim("besselj", sub(n, ONE), x), prim("besselj", add(n, ONE), x)), TWO)


def _neighbours(n: Term, x: Term) -> Term:
    """The derivative of j_n: (n j_{n-1} - (n + 1) j_{n+1})/(2n + 1); of j_0 it is -j_1."""
    after, odd = add(n, ONE), add(mul(TWO, n), ONE)
    found = div(sub(mul(n, prim("sphericalj", sub(n, ONE), x)), mul(after, prim("sphericalj", after, x))), odd)
    return if_(prim("eq", n, ZERO), neg(prim("sphericalj", ONE, x)), found)


def _slope(ops: Elementwise, n: Quantity, x: Quantity) -> Quantity:
    return 0.5 * (ops.of("besselj")(n - 1, x) - ops.of("besselj")(n + 1, x))


def _spherical_slope(ops: Elementwise, n: Quantity, x: Quantity) -> Quantity:
    f = ops.of("sphericalj")
    found: Quantity = ops.where(n == 0, -f(1.0, x), (n * f(abs(n - 1), x) - (n + 1) * f(n + 1, x)) / (2 * n + 1))
    return found


besselj = register(
    Primitive(
        "besselj",
        arity=2,
        orders=1,
        numpy="special.jv",
        mpmath="besselj",
        ulp=1.0,
        off=lambda n, x: 0.5 * EPS * FAR * _amplitude(x) * _near(x) ** abs(n),
        surface=False,
        doc="The Bessel function of the first kind of a whole order.",
        partials=lambda n, x: (ZERO, _halved_difference(n, x)),
        domain=((0.0, 5.0), (-200.0, 200.0)),
        image=(-1.0, 1.0),
        interval=_tangent_bounds("besselj", _slope, 0.5, lambda ops, x: 1.0),
        remainder=_entire_remainder,
        example="besselj1(1)",
    )
)

sphericalj = register(
    Primitive(
        "sphericalj",
        arity=2,
        orders=1,
        numpy="potto.sphericalj",
        mpmath="potto.sphericalj",
        ulp=1.0,
        off=lambda n, x: 0.5 * EPS * SPHERICAL * _near(4 * x) ** abs(n) * 1.5 / (1.5 + abs(x)),
        surface=False,
        doc="The spherical Bessel function of the first kind of a whole order.",
        partials=lambda n, x: (ZERO, _neighbours(n, x)),
        domain=((0.0, 5.0), (-200.0, 200.0)),
        image=(-1.0, 1.0),
        interval=_tangent_bounds("sphericalj", _spherical_slope, 0.5, lambda ops, x: 1.0),
        remainder=_entire_remainder,
        example="sinc(1)",
    )
)

besselj0 = register(
    Primitive(
        "besselj0",
        arity=1,
        formula=lambda x: prim("besselj", ZERO, x),
        numpy="potto.besselj0",
        ulp=4.0,
        off=lambda x: 0.5 * EPS * NEAR * _amplitude(x / 25),
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


sinc = register(
    Primitive(
        "sinc",
        arity=1,
        formula=lambda x: if_(prim("eq", x, ZERO), ONE, div(prim("sin", x), x)),
        mpmath="sinc",
        ulp=3.0,
        doc="sin(x)/x, and 1 at 0.",
        topic="Angles",
        partials=lambda x: (neg(prim("sphericalj", ONE, x)),),
        domain=((-200.0, 200.0),),
        parity=1,
        values=((0.0, 1.0),),
        image=(-0.2173, 1.0),
        interval=_tangent_bounds(
            "sinc", lambda ops, x: -ops.of("sphericalj")(1.0, x), 1 / 6, lambda ops, x: ops.of("div")(1.0, x)
        ),
        remainder=lambda ops, m, d: exponential(ops, d) / 3,
        example="sinc(1)",
    )
)


besselj1 = register(
    Primitive(
        "besselj1",
        arity=1,
        formula=lambda x: prim("besselj", ONE, x),
        numpy="potto.besselj1",
        ulp=4.0,
        off=lambda x: 0.5 * EPS * NEAR * _amplitude(x / 25) * _near(x),
        doc="The Bessel function of the first kind of order 1.",
        topic=TOPIC,
        partials=lambda x: (div(sub(prim("besselj0", x), prim("besselj", TWO, x)), TWO),),
        domain=((-200.0, 200.0),),
        parity=-1,
        image=(-0.582, 0.582),
        interval=_tangent_bounds("besselj1", lambda ops, x: _slope(ops, 1.0, x), 0.25, _root_fall),
        remainder=lambda ops, m, d: 0.5 * exponential(ops, d),
        example="besselj1(1)",
    )
)
