"""The error function. Its inverses exist in core terms only: conditions are solved and normals sampled with them."""

from __future__ import annotations

import math

from potto.core.terms import ONE, PI, Term, const, div, mul, neg, prim, sub
from potto.primitives.bounds import rising
from potto.primitives.registry import Elementwise, Primitive, Quantity, register
from potto.primitives.sizes import of_bell

SLOPE = div(const(2.0), prim("sqrt", PI))  # of erf at 0


def _bell(x: Term) -> Term:
    return mul(SLOPE, prim("exp", neg(mul(x, x))))


def _bell_remainder(ops: Elementwise, m: Quantity, d: Quantity) -> Quantity:
    """By the second derivative -4z/sqrt(pi) exp(-z^2): x^2 - y^2 is least on the rim, at m/2 if that is in the disc."""
    near = abs(m)
    least = ops.where(2 * d >= near, 0.5 * near * near - d * d, (near - d) * (near - d))
    return 2 / math.sqrt(math.pi) * d * d * (near + d) * ops.of("exp")(-least)


def _root_slope(ops: Elementwise, y: Quantity) -> Quantity:
    root = ops.of("erfinv")(y)
    return 0.5 * math.sqrt(math.pi) * ops.of("exp")(root * root)


_erfinv_remainder = rising("erfinv", _root_slope)


def _inverse_slope(op: str, y: Term) -> Term:
    root = prim(op, y)
    return div(prim("exp", mul(root, root)), SLOPE)


erf = register(
    Primitive(
        "erf",
        arity=1,
        numpy="special.erf",
        mpmath="erf",
        ulp=3.0,
        scalar="math.erf",
        topic="The error function",
        centered=True,
        image=(-1.0, 1.0),
        roots=(0.0,),
        parity=-1,
        remainder=_bell_remainder,
        exponents=lambda x: (x,),
        doc="The error function, 2/sqrt(pi) times the integral of exp(-t^2) from 0 to x.",
        partials=lambda x: (_bell(x),),
        domain=((-20.0, 20.0),),
        inverse=lambda y: (prim("erfinv", y),),
        increasing=1,
        example="erf(0.5)",
    )
)

erfc = register(
    Primitive(
        "erfc",
        arity=1,
        numpy="special.erfc",
        mpmath="erfc",
        ulp=lambda x: 3 + (x > 0) * x * x,  # the square of its argument is rounded
        formula=lambda x: sub(ONE, prim("erf", x)),
        scalar="math.erfc",
        topic="The error function",
        centered=True,
        image=(0.0, 2.0),
        roots=(),
        values=((0.0, 1.0),),
        remainder=_bell_remainder,
        magnitude=of_bell,
        exponents=lambda x: (x,),
        doc="1 - erf(x), to full precision also for large x.",
        partials=lambda x: (neg(_bell(x)),),
        domain=((-20.0, 20.0),),
        inverse=lambda y: (prim("erfcinv", y),),
        increasing=-1,
        example="erfc(3)",
    )
)

erfinv = register(
    Primitive(
        "erfinv",
        arity=1,
        numpy="special.erfinv",
        mpmath="erfinv",
        ulp=3.0,
        within=(-1.0, 1.0),
        broken=True,
        roots=(0.0,),
        parity=-1,
        remainder=_erfinv_remainder,
        topic="The error function",
        doc="The inverse of erf, of numbers between -1 and 1.",
        partials=lambda y: (_inverse_slope("erfinv", y),),
        domain=((-0.999, 0.999),),
        inverse=lambda x: (prim("erf", x),),
        increasing=1,
        example="erfinv(0.5)",
    )
)

erfcinv = register(
    Primitive(
        "erfcinv",
        arity=1,
        numpy="special.erfcinv",
        mpmath="potto.erfcinv",
        ulp=7.0,
        within=(0.0, 2.0),
        broken=True,
        roots=(1.0,),
        remainder=lambda ops, m, d: _erfinv_remainder(ops, 1 - m, d),
        surface=False,
        doc="The inverse of erfc, of numbers between 0 and 2; good for the tail, where erf is 1.",
        partials=lambda y: (neg(_inverse_slope("erfcinv", y)),),
        domain=((1e-100, 1.999),),
        inverse=lambda x: (prim("erfc", x),),
        increasing=-1,
        example="erfc(0.5)",
    )
)
