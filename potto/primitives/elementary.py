"""Roots, exponentials and logarithms."""

from __future__ import annotations

import math

from potto.core.terms import ONE, Term, add, branch, const, div, mul, prim
from potto.primitives.registry import Primitive, Terms, register

NAN = const(math.nan)
HALF = const(0.5)


def _square_of_root(y: Term) -> Terms:
    return (branch((y,), False, mul(y, y), NAN),)


sqrt = register(
    Primitive(
        "sqrt",
        arity=1,
        numpy="sqrt",
        mpmath="sqrt",
        doc="The square root, of numbers that are not negative.",
        partials=lambda x: (div(HALF, prim("sqrt", x)),),
        domain=((0.0, 1e12),),
        edges=lambda x: (x,),
        inverse=_square_of_root,
        increasing=1,
        example="sqrt(2)",
    )
)

exp = register(
    Primitive(
        "exp",
        arity=1,
        numpy="exp",
        mpmath="exp",
        doc="The exponential function.",
        partials=lambda x: (prim("exp", x),),
        domain=((-700.0, 700.0),),
        inverse=lambda y: (prim("log", y),),
        increasing=1,
        example="exp(1)",
    )
)

log = register(
    Primitive(
        "log",
        arity=1,
        numpy="log",
        mpmath="log",
        doc="The natural logarithm, of positive numbers.",
        partials=lambda x: (div(ONE, x),),
        domain=((1e-300, 1e300),),
        edges=lambda x: (x,),
        inverse=lambda y: (prim("exp", y),),
        increasing=1,
        example="log(10)",
    )
)

log1p = register(
    Primitive(
        "log1p",
        arity=1,
        numpy="log1p",
        mpmath="log1p",
        doc="log(1 + x), to full precision also for small x.",
        partials=lambda x: (div(ONE, add(ONE, x)),),
        domain=((-0.999, 1e12),),
        edges=lambda x: (add(ONE, x),),
        inverse=lambda y: (prim("expm1", y),),
        increasing=1,
        example="log1p(1e-10)",
    )
)

expm1 = register(
    Primitive(
        "expm1",
        arity=1,
        numpy="expm1",
        mpmath="expm1",
        doc="exp(x) - 1, to full precision also for small x.",
        partials=lambda x: (prim("exp", x),),  # expm1(x) + 1 has no digits left for x far below 0
        domain=((-700.0, 700.0),),
        inverse=lambda y: (prim("log1p", y),),
        increasing=1,
        example="expm1(1e-10)",
    )
)
