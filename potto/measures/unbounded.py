"""Measures on the whole line, by location and scale: normal, logistic, cauchy, laplace."""

from __future__ import annotations

from potto.core.terms import HALF, INF, ONE, PI, TWO, ZERO, Term, add, branch, const, div, mul, neg, prim, sub
from potto.measures.registry import Condition, Measure, Terms, register

ROOT_TWO = prim("sqrt", TWO)


def scale_conditions(m: Term, s: Term) -> tuple[Condition, ...]:
    return ((prim("lt", ZERO, s), "the scale must be positive"),)


def spread(m: Term, s: Term, distances: tuple[float, ...]) -> Terms:
    """m, and points on either side of it at distances that count in s; ascending."""
    left = tuple(sub(m, mul(const(d), s)) for d in reversed(distances))
    return (*left, m, *(add(m, mul(const(d), s)) for d in distances))


def _line(m: Term, s: Term) -> tuple[Term, Term]:
    return neg(INF), INF


def _standard(x: Term, m: Term, s: Term) -> Term:
    return div(sub(x, m), s)


def _normal_density(x: Term, m: Term, s: Term) -> Term:
    z = _standard(x, m, s)
    return div(prim("exp", neg(div(mul(z, z), TWO))), mul(s, prim("sqrt", mul(TWO, PI))))


normal = register(
    Measure(
        "normal",
        parameters=("m", "s"),
        support=_line,
        density=_normal_density,
        cdf=lambda x, m, s: mul(HALF, prim("erfc", div(div(sub(m, x), s), ROOT_TWO))),
        quantile=lambda u, m, s: sub(m, mul(s, ROOT_TWO, prim("erfcinv", mul(TWO, u)))),
        mean=lambda m, s: m,
        variance=lambda m, s: mul(s, s),
        valid=scale_conditions,
        domain=((-3.0, 3.0), (0.1, 5.0)),
        hints=lambda m, s: spread(m, s, (3.0, 8.0)),
        doc="The normal distribution with mean m and standard deviation s.",
        example="integral (x ~ normal(1, 2)) x^2 d(x)",
    )
)


def _logistic_density(x: Term, m: Term, s: Term) -> Term:
    half = prim("sech", div(_standard(x, m, s), TWO))  # whose derivative is a number also far away
    return div(mul(half, half), mul(const(4.0), s))


logistic = register(
    Measure(
        "logistic",
        parameters=("m", "s"),
        support=_line,
        density=_logistic_density,
        cdf=lambda x, m, s: div(ONE, add(ONE, prim("exp", div(sub(m, x), s)))),
        quantile=lambda u, m, s: add(m, mul(s, sub(prim("log", u), prim("log1p", neg(u))))),
        mean=lambda m, s: m,
        variance=lambda m, s: div(mul(s, s, PI, PI), const(3.0)),
        valid=scale_conditions,
        domain=((-3.0, 3.0), (0.1, 5.0)),
        hints=lambda m, s: spread(m, s, (4.0, 14.0, 40.0)),
        doc="The logistic distribution with mean m and scale s, whose cdf is the sigmoid of (x - m)/s.",
        example="integral (x ~ logistic(0, 1)) x^2 d(x)",
    )
)


def _cauchy_density(x: Term, m: Term, s: Term) -> Term:
    z = _standard(x, m, s)
    return div(ONE, mul(PI, s, add(ONE, mul(z, z))))


cauchy = register(
    Measure(
        "cauchy",
        parameters=("m", "s"),
        support=_line,
        density=_cauchy_density,
        cdf=lambda x, m, s: div(prim("atan2", ONE, div(sub(m, x), s)), PI),
        quantile=lambda u, m, s: add(m, mul(s, prim("tan", mul(PI, sub(u, HALF))))),
        mean=None,
        variance=None,
        valid=scale_conditions,
        domain=((-3.0, 3.0), (0.1, 5.0)),
        hints=lambda m, s: spread(m, s, (1.0, 10.0)),
        doc="The Cauchy distribution around m with half width s. Its mean does not exist.",
        example="integral (x ~ cauchy(0, 1)) [x < 1] d(x)",
    )
)


def _laplace_cdf(x: Term, m: Term, s: Term) -> Term:
    above = sub(ONE, mul(HALF, prim("exp", neg(_standard(x, m, s)))))
    return branch((sub(x, m),), False, above, mul(HALF, prim("exp", _standard(x, m, s))))


def _laplace_quantile(u: Term, m: Term, s: Term) -> Term:
    above = sub(m, mul(s, prim("log", mul(TWO, sub(ONE, u)))))
    return branch((sub(u, HALF),), False, above, add(m, mul(s, prim("log", mul(TWO, u)))))


laplace = register(
    Measure(
        "laplace",
        parameters=("m", "s"),
        support=_line,
        density=lambda x, m, s: div(prim("exp", neg(prim("abs", _standard(x, m, s)))), mul(TWO, s)),
        cdf=_laplace_cdf,
        quantile=_laplace_quantile,
        mean=lambda m, s: m,
        variance=lambda m, s: mul(TWO, s, s),
        valid=scale_conditions,
        domain=((-3.0, 3.0), (0.1, 5.0)),
        hints=lambda m, s: spread(m, s, (3.0, 12.0, 40.0)),
        doc="The Laplace distribution around m, which falls off exponentially on either side at the scale s.",
        example="integral (x ~ laplace(0, 1)) abs(x) d(x)",
    )
)
