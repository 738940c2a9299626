"""The error function. Its inverses exist in core terms only: conditions are solved and normals sampled with them."""

from __future__ import annotations

from potto.core.terms import PI, Term, const, div, mul, neg, prim
from potto.primitives.registry import Primitive, register

SLOPE = div(const(2.0), prim("sqrt", PI))  # of erf at 0


def _bell(x: Term) -> Term:
    return mul(SLOPE, prim("exp", neg(mul(x, x))))


def _inverse_slope(op: str, y: Term) -> Term:
    root = prim(op, y)
    return div(prim("exp", mul(root, root)), SLOPE)


erf = register(
    Primitive(
        "erf",
        arity=1,
        numpy="special.erf",
        mpmath="erf",
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
        surface=False,
        doc="The inverse of erf, of numbers between -1 and 1.",
        partials=lambda y: (_inverse_slope("erfinv", y),),
        domain=((-0.999, 0.999),),
        inverse=lambda x: (prim("erf", x),),
        increasing=1,
        example="erf(0.5)",
    )
)

erfcinv = register(
    Primitive(
        "erfcinv",
        arity=1,
        numpy="special.erfcinv",
        mpmath="erfcinv",
        surface=False,
        doc="The inverse of erfc, of numbers between 0 and 2; good for the tail, where erf is 1.",
        partials=lambda y: (neg(_inverse_slope("erfcinv", y)),),
        domain=((1e-100, 1.999),),
        inverse=lambda x: (prim("erfc", x),),
        increasing=-1,
        example="erfc(0.5)",
    )
)
