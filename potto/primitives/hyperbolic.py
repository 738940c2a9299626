"""Hyperbolic functions. Their inverses exist in core terms only, as solutions of conditions."""

from __future__ import annotations

import math

from potto.core.terms import ONE, Term, add, branch, const, div, mul, neg, prim, sub
from potto.primitives.registry import Primitive, Terms, register


def _both_signs(root: Term) -> Terms:
    return root, neg(root)


sinh = register(
    Primitive(
        "sinh",
        arity=1,
        numpy="sinh",
        mpmath="sinh",
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
        doc="The hyperbolic tangent.",
        # Not 1 - tanh^2, which cancels for large x; dividing twice keeps cosh^2 from overflowing.
        partials=lambda x: (div(div(ONE, prim("cosh", x)), prim("cosh", x)),),
        domain=((-300.0, 300.0),),
        inverse=lambda y: (prim("atanh", y),),
        increasing=1,
        example="tanh(1)",
    )
)

asinh = register(
    Primitive(
        "asinh",
        arity=1,
        numpy="arcsinh",
        mpmath="asinh",
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
        surface=False,
        doc="The inverse of cosh that is not negative, of numbers from 1.",
        partials=lambda x: (div(ONE, mul(prim("sqrt", sub(x, ONE)), prim("sqrt", add(x, ONE)))),),
        domain=((1.0, 1e150),),
        edges=lambda x: (sub(x, ONE),),
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
