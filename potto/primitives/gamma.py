"""The gamma function of positive numbers, and its logarithm and the derivatives of that, down to Hurwitz's zeta.

The bounds in the complex plane are those on the real line to the left: |gamma(z)| <= gamma(Re z) by Euler's integral,
and |z + n| >= Re z + n in the series of the derivatives of its logarithm.
"""

from __future__ import annotations

import math

from potto.core.terms import ONE, TWO, ZERO, add, const, mul, neg, prim
from potto.primitives.bounds import clear
from potto.primitives.registry import Elementwise, Ends, Primitive, Quantity, WhereTrue, register
from potto.primitives.sizes import of_gamma

TOPIC = "The gamma function"
POSITIVE = (0.0, math.inf)
LOWEST = 1.4616321449683623  # where gamma is least (NIST, Digital Library of Mathematical Functions, 5.4.19), rounded


def _curvature(ops: Elementwise, x: Quantity) -> Quantity:
    """The second derivative of gamma."""
    slope = ops.of("digamma")(x)
    return ops.of("gamma")(x) * (slope * slope + ops.of("hurwitz")(2.0, x))


def _gamma_remainder(ops: Elementwise, m: Quantity, d: Quantity) -> Quantity:
    """By the second derivative, which is convex."""
    left = clear(ops, m, d)
    return 0.5 * d * d * ops.most(_curvature(ops, left), _curvature(ops, m + d))


gamma = register(
    Primitive(
        "gamma",
        arity=1,
        numpy="special.gamma",
        mpmath="gamma",
        scalar="math.gamma",
        ulp=8.0,
        guarded=True,
        doc="The gamma function of positive numbers: gamma(n + 1) is n!.",
        topic=TOPIC,
        partials=lambda x: (mul(prim("gamma", x), prim("digamma", x)),),
        domain=((1e-300, 170.0),),
        edges=lambda x: (x,),
        broken=True,
        within=POSITIVE,
        image=(0.8856, math.inf),
        turns=(LOWEST,),
        roots=(),
        values=((1.0, 1.0), (2.0, 1.0)),
        remainder=_gamma_remainder,
        magnitude=of_gamma,
        example="gamma(0.5)",
    )
)


def _zeta_remainder(ops: Elementwise, s: Quantity, m: Quantity, d: Quantity) -> Quantity:
    return 0.5 * d * d * s * (s + 1) * ops.of("hurwitz")(s + 2, clear(ops, m, d))


def _zeta_bounds(ops: Elementwise, s: Ends, x: Ends) -> tuple[Quantity, Quantity, WhereTrue]:
    zeta = ops.of("hurwitz")
    return zeta(s[0], ops.most(x[1], 0.0)), zeta(s[0], ops.most(x[0], 0.0)), x[1] < 0


hurwitz = register(
    Primitive(
        "hurwitz",
        arity=2,
        orders=1,
        numpy="special.zeta",
        mpmath="zeta",
        ulp=8.0,
        guarded=True,
        surface=False,
        doc="The sum of (x + n)^(-s) over all n from 0, for a number s above 1 and a positive x.",
        partials=lambda s, x: (ZERO, neg(mul(s, prim("hurwitz", add(s, ONE), x)))),
        domain=((2.0, 6.0), (1e-40, 1e6)),
        edges=lambda s, x: (x,),
        broken=True,
        within=POSITIVE,
        roots=(),
        image=POSITIVE,
        interval=_zeta_bounds,
        remainder=_zeta_remainder,
        example="trigamma(1)",
    )
)


digamma = register(
    Primitive(
        "digamma",
        arity=1,
        numpy="special.psi",
        mpmath="digamma",
        ulp=8.0,
        off=4e-16,
        guarded=True,
        doc="The derivative of lgamma, of positive numbers.",
        topic=TOPIC,
        partials=lambda x: (prim("hurwitz", TWO, x),),
        domain=((1e-100, 1e12),),
        edges=lambda x: (x,),
        broken=True,
        within=POSITIVE,
        increasing=1,
        remainder=lambda ops, m, d: d * d * ops.of("hurwitz")(3.0, clear(ops, m, d)),
        example="digamma(1)",
    )
)


lgamma = register(
    Primitive(
        "lgamma",
        arity=1,
        numpy="special.gammaln",
        mpmath="loggamma",
        scalar="math.lgamma",
        ulp=8.0,
        off=4e-16,  # it is 0 at 1 and at 2
        guarded=True,
        doc="The logarithm of the gamma function, of positive numbers.",
        topic=TOPIC,
        partials=lambda x: (prim("digamma", x),),
        domain=((1e-300, 1e12),),
        edges=lambda x: (x,),
        broken=True,
        within=POSITIVE,
        image=(-0.1215, math.inf),
        turns=(LOWEST,),
        roots=(1.0, 2.0),
        remainder=lambda ops, m, d: 0.5 * d * d * ops.of("hurwitz")(2.0, clear(ops, m, d)),
        example="lgamma(100)",
    )
)


trigamma = register(
    Primitive(
        "trigamma",
        arity=1,
        formula=lambda x: prim("hurwitz", TWO, x),
        ulp=8.0,
        guarded=True,
        doc="The derivative of digamma, of positive numbers.",
        topic=TOPIC,
        partials=lambda x: (mul(neg(TWO), prim("hurwitz", const(3.0), x)),),
        domain=((1e-100, 1e12),),
        edges=lambda x: (x,),
        broken=True,
        within=POSITIVE,
        increasing=-1,
        roots=(),
        image=POSITIVE,
        example="trigamma(1)",
    )
)
