"""Measures on whole numbers: bernoulli, binomial, poisson. An expectation is a sum of the terms in their support.

Where there are infinitely many, the sum goes at least as far as where what lies beyond has a chance below 1e-20, and
from there on as long as its terms matter: for a Poisson
variable X with mean r, P(X >= r + t) <= exp(-t^2/(2 (r + t/3))) by Bennett's inequality, which is below exp(-46) for
t = 10 sqrt(r) + 40. From a number a > r on the chances fall
at least as fast as those of mean a do, r^k/k! = (r/a)^k a^k/k!: a truncated tail reaches as far as for a mean of a.
"""

from __future__ import annotations

from potto.core.terms import INF, ONE, ZERO, Term, add, const, mul, neg, prim, sub
from potto.measures.registry import Condition, Measure, register

SPREADS, MORE = const(10.0), const(40.0)


def _chance(p: Term) -> tuple[Condition, ...]:
    message = "the chance must lie between 0 and 1"
    return (prim("le", ZERO, p), message), (prim("le", p, ONE), message)


bernoulli = register(
    Measure(
        "bernoulli",
        parameters=("p",),
        discrete=True,
        support=lambda p: (ZERO, ONE),
        density=lambda k, p: add(mul(k, p), mul(sub(ONE, k), sub(ONE, p))),
        mean=lambda p: p,
        variance=lambda p: mul(p, sub(ONE, p)),
        valid=_chance,
        domain=((0.0, 1.0),),
        doc="1 with the chance p, else 0.",
        example="integral (k ~ bernoulli(0.3)) 2^k d(k)",
    )
)


def _log_factorial(k: Term) -> Term:
    return prim("lgamma", add(k, ONE))


def _binomial_mass(k: Term, n: Term, p: Term) -> Term:
    ways = sub(_log_factorial(n), add(_log_factorial(k), _log_factorial(sub(n, k))))
    return prim("exp", add(ways, mul(k, prim("log", p)), mul(sub(n, k), prim("log1p", neg(p)))))


binomial = register(
    Measure(
        "binomial",
        parameters=("n", "p"),
        discrete=True,
        support=lambda n, p: (ZERO, n),
        density=_binomial_mass,
        mean=lambda n, p: mul(n, p),
        variance=lambda n, p: mul(n, p, sub(ONE, p)),
        valid=lambda n, p: (
            (prim("le", ONE, n), "there must be at least one trial"),
            (prim("eq", n, prim("floor", n)), "the number of trials must be whole"),
            (prim("and", prim("lt", ZERO, p), prim("lt", p, ONE)), "the chance must be more than 0 and less than 1"),
        ),
        domain=((1.0, 30.0), (0.05, 0.95)),
        doc="How many of n trials succeed, each with the chance p.",
        example="integral (k ~ binomial(10, 0.3)) k^2 d(k)",
    )
)


def _poisson_mass(k: Term, r: Term) -> Term:
    return prim("exp", sub(mul(k, prim("log", r)), add(r, _log_factorial(k))))


def _poisson_reach(first: Term, r: Term) -> Term:
    highest = r if first is ZERO else prim("max", first, r)
    return prim("ceil", add(highest, mul(SPREADS, prim("sqrt", highest)), MORE))


poisson = register(
    Measure(
        "poisson",
        parameters=("r",),
        discrete=True,
        support=lambda r: (ZERO, INF),
        reach=_poisson_reach,
        density=_poisson_mass,
        mean=lambda r: r,
        variance=lambda r: r,
        valid=lambda r: (
            (prim("lt", ZERO, r), "the rate must be positive"),
            (prim("lt", r, INF), "the rate must be finite"),
        ),
        domain=((0.1, 50.0),),
        doc="How many events happen in a unit of time, r on average; summed up as far as its terms matter.",
        example="integral (k ~ poisson(3)) k^2 d(k)",
    )
)
