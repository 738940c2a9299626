"""Measures whose support has an end: uniform, triangular, exponential, lognormal."""

from __future__ import annotations

from potto.core.terms import INF, ONE, PI, TWO, ZERO, Term, add, branch, const, div, mul, neg, prim, sub
from potto.measures.registry import Condition, Measure, register
from potto.measures.unbounded import normal, scale_conditions, spread


def _between(a: Term, b: Term) -> tuple[Condition, ...]:
    return ((prim("lt", a, b), "the lower end must be less than the upper end"),)


uniform = register(
    Measure(
        "uniform",
        parameters=("a", "b"),
        support=lambda a, b: (a, b),
        density=lambda x, a, b: div(ONE, sub(b, a)),
        cdf=lambda x, a, b: div(sub(x, a), sub(b, a)),
        quantile=lambda u, a, b: add(a, mul(sub(b, a), u)),
        mean=lambda a, b: div(add(a, b), TWO),
        variance=lambda a, b: div(mul(sub(b, a), sub(b, a)), const(12.0)),
        valid=_between,
        domain=((-5.0, 5.0), (-5.0, 5.0)),
        doc="Every point between a and b is equally likely.",
        example="integral (x ~ uniform(0, 2)) x^2 d(x)",
    )
)


def _triangle(x: Term, a: Term, m: Term, b: Term) -> Term:
    falling = div(mul(TWO, sub(b, x)), mul(sub(b, a), sub(b, m)))
    rising = div(mul(TWO, sub(x, a)), mul(sub(b, a), sub(m, a)))
    return branch((sub(x, m),), False, falling, rising)


def _triangle_cdf(x: Term, a: Term, m: Term, b: Term) -> Term:
    above = sub(ONE, div(mul(sub(b, x), sub(b, x)), mul(sub(b, a), sub(b, m))))
    below = div(mul(sub(x, a), sub(x, a)), mul(sub(b, a), sub(m, a)))
    return branch((sub(x, m),), False, above, below)


def _triangle_quantile(u: Term, a: Term, m: Term, b: Term) -> Term:
    above = sub(b, prim("sqrt", mul(sub(ONE, u), sub(b, a), sub(b, m))))
    below = add(a, prim("sqrt", mul(u, sub(b, a), sub(m, a))))
    return branch((sub(mul(u, sub(b, a)), sub(m, a)),), False, above, below)


def _triangle_variance(a: Term, m: Term, b: Term) -> Term:
    # The same as (a^2 + m^2 + b^2 - ab - am - bm)/18, without its cancellation.
    left, right = sub(m, a), sub(b, m)
    return div(add(mul(left, left), mul(left, right), mul(right, right)), const(18.0))


triangular = register(
    Measure(
        "triangular",
        parameters=("a", "m", "b"),
        support=lambda a, m, b: (a, b),
        density=_triangle,
        cdf=_triangle_cdf,
        quantile=_triangle_quantile,
        mean=lambda a, m, b: div(add(a, m, b), const(3.0)),
        variance=_triangle_variance,
        valid=lambda a, m, b: (
            *_between(a, b),
            (prim("and", prim("le", a, m), prim("le", m, b)), "the mode must lie between the two ends"),
        ),
        domain=((-5.0, 5.0), (-5.0, 5.0), (-5.0, 5.0)),
        hints=lambda a, m, b: (m,),
        doc="The density rises linearly from a to its mode m and falls linearly to b.",
        example="integral (x ~ triangular(0, 1, 3)) x d(x)",
    )
)

exponential = register(
    Measure(
        "exponential",
        parameters=("r",),
        support=lambda r: (ZERO, INF),
        density=lambda x, r: mul(r, prim("exp", neg(mul(r, x)))),
        cdf=lambda x, r: neg(prim("expm1", neg(mul(r, x)))),
        quantile=lambda u, r: neg(div(prim("log1p", neg(u)), r)),
        mean=lambda r: div(ONE, r),
        variance=lambda r: div(div(ONE, r), r),
        valid=lambda r: ((prim("lt", ZERO, r), "the rate must be positive"),),
        domain=((0.1, 10.0),),
        hints=lambda r: tuple(div(const(k), r) for k in (3.0, 12.0, 40.0)),
        doc="The waiting time for an event that happens r times in a unit of time, on average.",
        example="integral (x ~ exponential(2)) x d(x)",
    )
)


def _log_density(x: Term, m: Term, s: Term) -> Term:
    z = div(sub(prim("log", x), m), s)
    bell = prim("exp", neg(div(mul(z, z), TWO)))
    return div(bell, mul(x, s, prim("sqrt", mul(TWO, PI))))


def _log_cdf(x: Term, m: Term, s: Term) -> Term:
    assert normal.cdf is not None
    return normal.cdf(prim("log", x), m, s)


def _log_quantile(u: Term, m: Term, s: Term) -> Term:
    assert normal.quantile is not None
    return prim("exp", normal.quantile(u, m, s))


lognormal = register(
    Measure(
        "lognormal",
        parameters=("m", "s"),
        support=lambda m, s: (ZERO, INF),
        density=_log_density,
        cdf=_log_cdf,
        quantile=_log_quantile,
        mean=lambda m, s: prim("exp", add(m, div(mul(s, s), TWO))),
        variance=lambda m, s: mul(prim("expm1", mul(s, s)), prim("exp", add(mul(TWO, m), mul(s, s)))),
        valid=scale_conditions,
        domain=((-2.0, 2.0), (0.1, 1.0)),
        hints=lambda m, s: tuple(prim("exp", p) for p in spread(m, s, (3.0, 8.0))),
        doc="The exponential of a normal variable with mean m and standard deviation s.",
        example="integral (x ~ lognormal(0, 0.5)) x d(x)",
    )
)
