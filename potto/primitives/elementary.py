"""Roots, exponentials and logarithms."""

from __future__ import annotations

import math

from potto.core.terms import HALF, NAN, ONE, Term, add, branch, div, mul, prim, sub
from potto.primitives.bounds import exponential, share, slack
from potto.primitives.registry import Elementwise, Primitive, Quantity, Terms, always, register
from potto.primitives.sizes import of_exponential, of_growth, of_logarithm, of_logarithm_from_one, of_root


def _root_remainder(ops: Elementwise, m: Quantity, d: Quantity) -> Quantity:
    q, root = share(ops, m, d), ops.of("sqrt")
    return root(m) * (1 - 0.5 * q - root(1 - q) + slack(q))


def _exp_remainder(ops: Elementwise, m: Quantity, d: Quantity) -> Quantity:
    return ops.of("exp")(m) * exponential(ops, d)


def _log_remainder(ops: Elementwise, q: Quantity) -> Quantity:
    return -ops.of("log1p")(-q) - q + slack(q)


def _square_of_root(y: Term) -> Terms:
    return (branch((y,), False, mul(y, y), NAN),)


sqrt = register(
    Primitive(
        "sqrt",
        arity=1,
        numpy="sqrt",
        mpmath="sqrt",
        scalar="math.sqrt",
        topic="Roots, exponentials, logarithms, powers",
        image=(0.0, math.inf),
        within=(0.0, math.inf),
        roots=(0.0,),
        remainder=_root_remainder,
        magnitude=of_root,
        doc="The square root, of numbers that are not negative.",
        partials=lambda x: (div(HALF, prim("sqrt", x)),),
        domain=((0.0, 1e12),),
        edges=lambda x: (x,),
        steep=always,
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
        scalar="math.exp",
        topic="Roots, exponentials, logarithms, powers",
        image=(0.0, math.inf),
        roots=(),
        values=((0.0, 1.0),),
        remainder=_exp_remainder,
        magnitude=of_exponential,
        exponents=lambda x: (x,),
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
        scalar="math.log",
        topic="Roots, exponentials, logarithms, powers",
        within=(0.0, math.inf),
        broken=True,
        roots=(1.0,),
        remainder=lambda ops, m, d: _log_remainder(ops, share(ops, m, d)),
        magnitude=of_logarithm,
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
        mpmath="potto.log1p",
        formula=lambda x: prim("log", add(ONE, x)),
        ulp=1.5,
        scalar="math.log1p",
        topic="Roots, exponentials, logarithms, powers",
        within=(-1.0, math.inf),
        broken=True,
        roots=(0.0,),
        remainder=lambda ops, m, d: _log_remainder(ops, share(ops, 1 + m, d)),
        magnitude=of_logarithm_from_one,
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
        formula=lambda x: sub(prim("exp", x), ONE),
        ulp=1.5,
        scalar="math.expm1",
        topic="Roots, exponentials, logarithms, powers",
        image=(-1.0, math.inf),
        roots=(0.0,),
        remainder=_exp_remainder,
        magnitude=of_growth,
        exponents=lambda x: (x,),
        doc="exp(x) - 1, to full precision also for small x.",
        partials=lambda x: (prim("exp", x),),  # expm1(x) + 1 has no digits left for x far below 0
        domain=((-700.0, 700.0),),
        inverse=lambda y: (prim("log1p", y),),
        increasing=1,
        example="expm1(1e-10)",
    )
)
