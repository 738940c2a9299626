"""Hyperbolic functions. Their inverses exist in core terms only, as solutions of conditions."""

from __future__ import annotations

import math

from potto.core.terms import HALF, ONE, Term, add, branch, const, div, mul, neg, prim, sub
from potto.primitives.bounds import clear, rising, waves
from potto.primitives.registry import Elementwise, Primitive, Quantity, Terms, always, register
from potto.primitives.sizes import of_even_growth, of_odd_growth


def _asinh_remainder(ops: Elementwise, m: Quantity, d: Quantity) -> Quantity:
    """By the second derivative -z/(1 + z^2)^1.5, bounded on the disc by its distance from i and -i."""
    return 0.5 * d * d * (abs(m) + d) / clear(ops, ops.of("hypot")(m, 1.0), d) ** 3


def _acosh_remainder(ops: Elementwise, m: Quantity, d: Quantity) -> Quantity:
    """By the second derivative -z/(z^2 - 1)^1.5."""
    return 0.5 * d * d * (m + d) / (clear(ops, m - 1, d) * (m + 1 - d)) ** 1.5


def _both_signs(root: Term) -> Terms:
    return root, neg(root)


sinh = register(
    Primitive(
        "sinh",
        arity=1,
        numpy="sinh",
        mpmath="sinh",
        formula=lambda x: mul(HALF, sub(prim("exp", x), prim("exp", neg(x)))),
        ulp=2.0,
        scalar="math.sinh",
        topic="Hyperbolic functions",
        roots=(0.0,),
        parity=-1,
        remainder=waves("sinh", "cosh"),
        magnitude=of_odd_growth,
        exponents=lambda x: (x,),
        doc="The hyperbolic sine.",
        partials=lambda x: (prim("cosh", x),),
        domain=((-700.0, 700.0),),
        inverse=lambda y: (prim("asinh", y),),
        increasing=1,
        example="sinh(1)",
    )
)

cosh = register(
    Primitive(
        "cosh",
        arity=1,
        numpy="cosh",
        mpmath="cosh",
        formula=lambda x: mul(HALF, add(prim("exp", x), prim("exp", neg(x)))),
        ulp=2.0,
        scalar="math.cosh",
        topic="Hyperbolic functions",
        turns=(0.0,),
        image=(1.0, math.inf),
        roots=(),
        parity=1,
        values=((0.0, 1.0),),
        remainder=waves("cosh", "sinh"),
        magnitude=of_even_growth,
        exponents=lambda x: (x,),
        doc="The hyperbolic cosine.",
        partials=lambda x: (prim("sinh", x),),
        domain=((-700.0, 700.0),),
        inverse=lambda y: _both_signs(prim("acosh", y)),
        example="cosh(1)",
    )
)

tanh = register(
    Primitive(
        "tanh",
        arity=1,
        numpy="tanh",
        mpmath="tanh",
        formula=lambda x: div(prim("sinh", x), prim("cosh", x)),
        ulp=2.0,
        scalar="math.tanh",
        topic="Hyperbolic functions",
        centered=True,
        image=(-1.0, 1.0),
        roots=(0.0,),
        parity=-1,
        exponents=lambda x: (x,),
        doc="The hyperbolic tangent.",
        # Not 1 - tanh^2, which cancels for large x, nor 1/cosh^2, whose derivative is inf/inf there.
        partials=lambda x: (mul(prim("sech", x), prim("sech", x)),),
        domain=((-300.0, 300.0),),
        inverse=lambda y: (prim("atanh", y),),
        increasing=1,
        example="tanh(1)",
    )
)

sech = register(
    Primitive(
        "sech",
        arity=1,
        formula=lambda x: div(ONE, prim("cosh", x)),
        exponents=lambda x: (x,),
        doc="The hyperbolic secant, 1/cosh(x).",
        partials=lambda x: (neg(mul(prim("sech", x), prim("tanh", x))),),
        domain=((-700.0, 700.0),),
        mpmath="sech",
        topic="Hyperbolic functions",
        ulp=3.0,
        centered=True,
        turns=(0.0,),
        roots=(),
        parity=1,
        values=((0.0, 1.0),),
        image=(0.0, 1.0),
        inverse=lambda y: _both_signs(prim("acosh", div(ONE, y))),
        example="sech(1)",
    )
)

asinh = register(
    Primitive(
        "asinh",
        arity=1,
        numpy="arcsinh",
        mpmath="asinh",
        formula=lambda x: prim("log", add(x, prim("hypot", ONE, x))),
        ulp=2.0,
        scalar="math.asinh",
        roots=(0.0,),
        parity=-1,
        remainder=_asinh_remainder,
        surface=False,
        doc="The inverse of sinh.",
        partials=lambda x: (div(ONE, prim("hypot", ONE, x)),),
        domain=((-1e150, 1e150),),
        inverse=lambda y: (prim("sinh", y),),
        increasing=1,
        example="sinh(1)",
    )
)

acosh = register(
    Primitive(
        "acosh",
        arity=1,
        numpy="arccosh",
        mpmath="acosh",
        formula=lambda x: prim("log", add(x, mul(prim("sqrt", sub(x, ONE)), prim("sqrt", add(x, ONE))))),
        ulp=2.0,
        scalar="math.acosh",
        image=(0.0, math.inf),
        within=(1.0, math.inf),
        roots=(1.0,),
        remainder=_acosh_remainder,
        surface=False,
        doc="The inverse of cosh that is not negative, of numbers from 1.",
        partials=lambda x: (div(ONE, mul(prim("sqrt", sub(x, ONE)), prim("sqrt", add(x, ONE)))),),
        domain=((1.0, 1e150),),
        edges=lambda x: (sub(x, ONE),),
        steep=always,
        inverse=lambda y: (branch((y,), False, prim("cosh", y), const(math.nan)),),
        increasing=1,
        example="cosh(1)",
    )
)

atanh = register(
    Primitive(
        "atanh",
        arity=1,
        numpy="arctanh",
        mpmath="atanh",
        formula=lambda x: mul(HALF, sub(prim("log1p", x), prim("log1p", neg(x)))),
        ulp=2.0,
        scalar="math.atanh",
        within=(-1.0, 1.0),
        broken=True,
        roots=(0.0,),
        parity=-1,
        remainder=rising("atanh", lambda ops, x: 1 / ((1 - x) * (1 + x))),
        surface=False,
        doc="The inverse of tanh, of numbers between -1 and 1.",
        partials=lambda x: (div(ONE, mul(sub(ONE, x), add(ONE, x))),),
        domain=((-0.999, 0.999),),
        edges=lambda x: (sub(ONE, x), add(ONE, x)),
        inverse=lambda y: (prim("tanh", y),),
        increasing=1,
        example="tanh(1)",
    )
)
