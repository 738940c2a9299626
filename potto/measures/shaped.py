"""Measures whose shape is a parameter: beta, gamma, Student's t. Their cdf is not a formula of builtins."""

from __future__ import annotations

import math

from potto.core.terms import INF, ONE, PI, ZERO, Term, add, const, div, if_, mul, neg, prim, sub
from potto.measures.registry import Condition, Measure, Terms, register
from potto.measures.unbounded import spread

TWO, HALF, NAN = const(2.0), const(0.5), const(math.nan)


def _both_shapes(a: Term, b: Term) -> tuple[Condition, ...]:
    message = "both shapes must be positive"
    return (prim("lt", ZERO, a), message), (prim("lt", ZERO, b), message)


def _beta_density(x: Term, a: Term, b: Term) -> Term:
    # By logarithms: the powers and the factor before them leave the range of doubles long before their product does.
    powers = add(mul(sub(a, ONE), prim("log", x)), mul(sub(b, ONE), prim("log1p", neg(x))))
    factor = sub(prim("lgamma", add(a, b)), add(prim("lgamma", a), prim("lgamma", b)))
    return prim("exp", add(powers, factor))


beta = register(
    Measure(
        "beta",
        parameters=("a", "b"),
        support=lambda a, b: (ZERO, ONE),
        density=_beta_density,
        mean=lambda a, b: div(a, add(a, b)),
        variance=lambda a, b: div(div(mul(div(a, add(a, b)), b), add(a, b)), add(a, b, ONE)),
        valid=_both_shapes,
        domain=((1.5, 6.0), (1.5, 6.0)),
        doc="A share between 0 and 1, with density proportional to x^(a - 1)*(1 - x)^(b - 1).",
        example="integral (x ~ beta(2, 3)) x^2 d(x)",
    )
)


def _gamma_density(x: Term, a: Term, r: Term) -> Term:
    scaled = mul(r, x)
    return mul(r, prim("exp", sub(mul(sub(a, ONE), prim("log", scaled)), add(scaled, prim("lgamma", a)))))


def _gamma_hints(a: Term, r: Term) -> Terms:
    """The mean, and places that many standard deviations away: below it by the factor by which they are above it."""
    root = prim("sqrt", a)
    above = [add(a, mul(const(k), root), const(b)) for k, b in ((3.0, 3.0), (8.0, 12.0), (12.0, 40.0))]
    below = [div(mul(a, a), x) for x in reversed(above)]
    return tuple(div(x, r) for x in (*below, a, *above))


gamma = register(
    Measure(
        "gamma",
        parameters=("a", "r"),
        support=lambda a, r: (ZERO, INF),
        density=_gamma_density,
        mean=lambda a, r: div(a, r),
        variance=lambda a, r: div(div(a, r), r),
        valid=lambda a, r: (
            (prim("lt", ZERO, a), "the shape must be positive"),
            (prim("lt", ZERO, r), "the rate must be positive"),
        ),
        domain=((1.5, 20.0), (0.1, 10.0)),
        hints=_gamma_hints,
        doc="The gamma distribution with shape a and rate r: the time that a events take, r in a unit of time.",
        example="integral (x ~ gamma(3, 2)) x^2 d(x)",
    )
)


def _student_density(x: Term, n: Term, m: Term, s: Term) -> Term:
    z, half = div(sub(x, m), s), mul(HALF, add(n, ONE))
    factor = prim("exp", sub(prim("lgamma", half), prim("lgamma", mul(HALF, n))))
    shape = prim("exp", neg(mul(half, prim("log1p", div(mul(z, z), n)))))
    return div(mul(factor, shape), mul(s, prim("sqrt", mul(n, PI))))


student_t = register(
    Measure(
        "student_t",
        parameters=("n", "m", "s"),
        support=lambda n, m, s: (neg(INF), INF),
        density=_student_density,
        mean=lambda n, m, s: if_(prim("lt", ONE, n), m, NAN),
        variance=lambda n, m, s: if_(prim("lt", TWO, n), mul(s, s, div(n, sub(n, TWO))), NAN),
        valid=lambda n, m, s: (
            (prim("lt", ZERO, n), "the degrees of freedom must be positive"),
            (prim("lt", ZERO, s), "the scale must be positive"),
        ),
        domain=((5.0, 30.0), (-3.0, 3.0), (0.1, 5.0)),
        hints=lambda n, m, s: spread(m, s, (3.0, 10.0)),
        doc="Student's t distribution with n degrees of freedom around m at the scale s.",
        example="integral (x ~ student_t(5, 0, 1)) [x < 1] d(x)",
    )
)
