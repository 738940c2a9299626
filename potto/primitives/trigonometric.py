"""Circular functions, their inverses, and the polar pair `hypot` and `atan2`."""

from __future__ import annotations

import math

from potto.core.terms import NAN, ONE, PI, Term, add, branch, const, div, mul, neg, prim, sub
from potto.primitives.bounds import angle, clear, length, rising, tangent, wave, waves
from potto.primitives.registry import Elementwise, Primitive, Quantity, Terms, always, register

HALF_PI = div(PI, const(2.0))
TWO_PI = mul(const(2.0), PI)


def _between(y: Term, lo: Term, hi: Term, solution: Term) -> Terms:
    """The solution where y is a value that the function takes, else nan."""
    return (branch((sub(y, lo),), False, branch((sub(hi, y),), False, solution, NAN), NAN),)


def _asin_slope(ops: Elementwise, x: Quantity) -> Quantity:
    return 1 / ops.of("sqrt")((1 - x) * (1 + x))


def _atan_remainder(ops: Elementwise, m: Quantity, d: Quantity) -> Quantity:
    """By the second derivative -2z/(1 + z^2)^2, bounded on the disc by its distance from i and -i."""
    return d * d * (abs(m) + d) / clear(ops, ops.of("hypot")(m, 1.0), d) ** 4


def _half_circle(x: Term) -> Term:
    # Not 1 - x^2, which has lost half of its digits near x = 1.
    return prim("sqrt", mul(sub(ONE, x), add(ONE, x)))


def _over_length(a: Term, x: Term, y: Term) -> Term:
    return div(a, prim("hypot", x, y))


def _angle_partials(y: Term, x: Term) -> Terms:
    # (x/h)/h with h = hypot(x, y): x^2 + y^2 overflows or vanishes first.
    length = prim("hypot", x, y)
    return _over_length(div(x, length), x, y), neg(_over_length(div(y, length), x, y))


sin = register(
    Primitive(
        "sin",
        arity=1,
        numpy="sin",
        mpmath="sin",
        scalar="math.sin",
        topic="Angles",
        image=(-1.0, 1.0),
        parity=-1,
        interval=wave(0.0),
        remainder=waves("sin", "cos"),
        doc="The sine of an angle in radians.",
        partials=lambda x: (prim("cos", x),),
        domain=((-1e3, 1e3),),
        inverse=lambda y: (prim("asin", y),),
        period=lambda y: (TWO_PI, (sub(PI, prim("asin", y)),)),
        example="sin(pi/6)",
    )
)

cos = register(
    Primitive(
        "cos",
        arity=1,
        numpy="cos",
        mpmath="cos",
        formula=lambda x: prim("sin", add(x, HALF_PI)),
        scalar="math.cos",
        topic="Angles",
        image=(-1.0, 1.0),
        parity=1,
        values=((0.0, 1.0),),
        interval=wave(math.pi / 2),
        remainder=waves("cos", "sin"),
        doc="The cosine of an angle in radians.",
        partials=lambda x: (neg(prim("sin", x)),),
        domain=((-1e3, 1e3),),
        inverse=lambda y: (prim("acos", y),),
        period=lambda y: (TWO_PI, (neg(prim("acos", y)),)),
        example="cos(pi/3)",
    )
)

tan = register(
    Primitive(
        "tan",
        arity=1,
        numpy="tan",
        mpmath="tan",
        formula=lambda x: div(prim("sin", x), prim("cos", x)),
        scalar="math.tan",
        topic="Angles",
        broken=True,
        roots=(0.0,),
        parity=-1,
        interval=tangent,
        doc="The tangent of an angle in radians.",
        partials=lambda x: (div(ONE, mul(prim("cos", x), prim("cos", x))),),
        domain=((-1.57, 1.57),),
        edges=lambda x: (prim("cos", x),),
        inverse=lambda y: (prim("atan", y),),
        period=lambda y: (PI, ()),
        example="tan(pi/4)",
    )
)

asin = register(
    Primitive(
        "asin",
        arity=1,
        numpy="arcsin",
        mpmath="asin",
        scalar="math.asin",
        topic="Angles",
        within=(-1.0, 1.0),
        roots=(0.0,),
        parity=-1,
        remainder=rising("asin", _asin_slope),
        doc="The angle between -pi/2 and pi/2 with a given sine.",
        partials=lambda x: (div(ONE, _half_circle(x)),),
        domain=((-1.0, 1.0),),
        edges=lambda x: (sub(ONE, x), add(ONE, x)),
        steep=always,
        inverse=lambda y: _between(y, neg(HALF_PI), HALF_PI, prim("sin", y)),
        increasing=1,
        example="asin(0.5)",
    )
)

acos = register(
    Primitive(
        "acos",
        arity=1,
        numpy="arccos",
        mpmath="acos",
        formula=lambda x: sub(HALF_PI, prim("asin", x)),
        scalar="math.acos",
        topic="Angles",
        image=(0.0, math.inf),
        within=(-1.0, 1.0),
        roots=(1.0,),
        remainder=rising("asin", _asin_slope),
        doc="The angle between 0 and pi with a given cosine.",
        partials=lambda x: (neg(div(ONE, _half_circle(x))),),
        domain=((-1.0, 1.0),),
        edges=lambda x: (sub(ONE, x), add(ONE, x)),
        steep=always,
        inverse=lambda y: _between(y, const(0.0), PI, prim("cos", y)),
        increasing=-1,
        example="acos(0.5)",
    )
)

atan = register(
    Primitive(
        "atan",
        arity=1,
        numpy="arctan",
        mpmath="atan",
        scalar="math.atan",
        topic="Angles",
        centered=True,
        roots=(0.0,),
        parity=-1,
        remainder=_atan_remainder,
        doc="The angle between -pi/2 and pi/2 with a given tangent.",
        partials=lambda x: (div(ONE, add(ONE, mul(x, x))),),
        domain=((-1e6, 1e6),),
        inverse=lambda y: _between(y, neg(HALF_PI), HALF_PI, prim("tan", y)),
        increasing=1,
        example="4*atan(1)",
    )
)

atan2 = register(
    Primitive(
        "atan2",
        arity=2,
        numpy="arctan2",
        mpmath="atan2",
        lacks=frozenset({"discs"}),
        scalar="math.atan2",
        topic="Angles",
        broken=True,
        interval=angle,
        doc="The angle of the point (x, y), between -pi and pi. Its arguments are y, then x.",
        partials=_angle_partials,
        domain=((-1e3, 1e3), (-1e3, 1e3)),
        # the cut along the negative x-axis; its jump is `calculus.branch_cuts`; and the origin, where y is 0 throughout
        kinks=lambda y, x: (y, add(mul(x, x), mul(y, y))),
        example="atan2(1, -1)",
    )
)

hypot = register(
    Primitive(
        "hypot",
        arity=2,
        numpy="hypot",
        mpmath="hypot",
        formula=lambda x, y: prim("sqrt", add(mul(x, x), mul(y, y))),
        scalar="math.hypot",
        topic="Angles",
        image=(0.0, math.inf),
        roots=(0.0,),
        interval=length,
        doc="The length of (x, y), that is sqrt(x^2 + y^2), without overflow.",
        partials=lambda x, y: (_over_length(x, x, y), _over_length(y, x, y)),
        steep=always,
        domain=((-1e150, 1e150), (-1e150, 1e150)),
        kinks=lambda x, y: (x, y),  # a cone: it has a kink in x where y is 0, and nearly one where y is small
        example="hypot(3, 4)",
    )
)
