"""Expectations over whole numbers: sums with the masses of mpmath's functions; derivatives by every parameter."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from mpmath import mp

import potto


def poisson(k: int, r: mp.mpf) -> mp.mpf:
    return mp.exp(-r) * r**k / mp.factorial(k)


def binomial(k: int, n: int, p: mp.mpf) -> mp.mpf:
    return mp.binomial(n, k) * p**k * (1 - p) ** (n - k)


def close(found: potto.Estimate, wanted: mp.mpf) -> None:
    off = abs(mp.mpf(float(found)) - wanted)
    assert off <= found.error + 1e-13 * max(1, abs(wanted)), (found, wanted)
    assert off <= 1e-9 * max(1, abs(wanted)), (found, wanted)


PROGRAM = potto.compile("""
def square(r) integral (k ~ poisson(r)) k^2 d(k)
def d_square(r) snd(deriv(square)((r, 1)))
def few(n, p) integral (k ~ binomial(n, p)) [k < 3] d(k)
def d_few(n, p) snd(deriv(few)((n, 0), (p, 1)))
def shots(r, t) integral (k ~ poisson(r), x ~ normal(k, 0.5)) [x < t] d(k, x)
def d_shots(r, t) snd(deriv(shots)((r, 1), (t, 0)))
def t_shots(r, t) snd(deriv(shots)((r, 0), (t, 1)))
def coin(p, t) integral (x ~ exponential(1), k ~ bernoulli(p)) [x*(k + 1) < t] d(x, k)
def d_coin(p, t) snd(deriv(coin)((p, 0), (t, 1)))
def die(w, t) integral (k ~ categorical(1, w, 3), x ~ uniform(0, 1)) [x*k < t] d(k, x)
def d_die(w, t) snd(deriv(die)((w, 1), (t, 0)))
def some(r) integral (k ~ truncated(poisson(r), 1, inf)) k d(k)
def d_some(r) snd(deriv(some)((r, 1)))
def both(w) integral (x ~ mixture(w, poisson(2), 1, normal(0, 1))) x^2 d(x)
""")


@pytest.mark.parametrize("r", [0.3, 3.0, 400.0])
def test_poisson(r: float) -> None:
    with mp.workdps(40):
        close(PROGRAM.square(r), mp.mpf(r) ** 2 + r)
        close(PROGRAM.d_square(r), 2 * mp.mpf(r) + 1)


@pytest.mark.parametrize(("r", "first"), [(3.0, 60), (3.0, 100), (1e-3, 10)])
def test_a_far_tail_of_poisson(r: float, first: int) -> None:
    """All but nothing of the whole, but all that there is: the sum goes on from where it begins."""
    f = potto.compile(f"def f(r) integral (k ~ truncated(poisson(r), {first}, inf)) k d(k)\n").f
    with mp.workdps(40):
        chances = [poisson(k, mp.mpf(r)) for k in range(first, first + 300)]
        close(f(r), mp.fsum(k * p for k, p in enumerate(chances, first)) / mp.fsum(chances))


GROWING: dict[str, tuple[str, Callable[[Any], Any]]] = {
    "faster than the chances fall at first": ("poisson(t)) exp(3*k)", lambda t: mp.exp(t * mp.expm1(3))),
    "with signs": ("poisson(t)) exp(2*k)*cos(pi*k/2)", lambda t: mp.re(mp.exp(t * (mp.exp(2 + mp.j * mp.pi / 2) - 1)))),
    "nested": ("poisson(t), l ~ poisson(k + 1)) exp(k + l)", lambda t: mp.exp(mp.e - 1 + t * mp.expm1(mp.e))),
    "with an end": (
        "truncated(poisson(t), 0, 70)) exp(4*k)*sqrt(70 - k)",
        lambda t: (
            mp.fsum(poisson(k, t) * mp.exp(4 * k) * mp.sqrt(70 - k) for k in range(71))
            / mp.fsum(poisson(k, t) for k in range(71))
        ),
    ),
    "mixed": (
        "mixture(1, poisson(t), 3, poisson(1))) exp(3*k)",
        lambda t: (mp.exp(t * mp.expm1(3)) + 3 * mp.exp(mp.expm1(3))) / 4,
    ),
}


@pytest.mark.parametrize("name", GROWING)
def test_a_sum_goes_on_as_long_as_its_terms_matter(name: str) -> None:
    program, exact = GROWING[name]
    value, slope = potto.value_and_grad(
        potto.compile(f"def f(t) integral (k ~ {program} d(k{', l' * (name == 'nested')})").f
    )(0.7)
    with mp.workdps(40):
        wanted = exact(mp.mpf(0.7)), mp.diff(exact, mp.mpf(0.7))
    for found, right in zip((value, slope), wanted, strict=True):
        assert abs(found.value - right) <= found.error <= 1e-10 * abs(right)


def test_what_goes_on_within_an_integrand() -> None:
    """Beside conditions in the integrand, which cut where the chances are, and are nothing to the rest."""
    f = potto.compile(
        "def f(t) integral [0, 1] exp(-x)*(integral (k ~ poisson(1)) exp(3*k)*[x < t*k/30] d(k))^2 d(x)"
    ).f
    found, (ends, chances) = f(1.0), ([mp.mpf(min(k, 30)) / 30 for k in range(120)], [])
    with mp.workdps(40):
        chances = [mp.exp(3 * k) * poisson(k, mp.mpf(1)) for k in range(120)]
        parts = [(a, b, mp.fsum(chances[k] for k in range(120) if ends[k] >= b)) for a, b in pairwise(ends)]
        wanted = mp.fsum((mp.exp(-a) - mp.exp(-b)) * whole**2 for a, b, whole in parts)
    assert abs(found.value - wanted) <= found.error <= 1e-12 * wanted


def test_an_expectation_that_is_infinite() -> None:
    found = potto.compile("def f(t) integral (k ~ poisson(t)) exp(k^2/10) d(k)").f(3.0)
    assert not found.converged
    assert found.error == math.inf


def test_binomial() -> None:
    with mp.workdps(40):

        def wanted(p: mp.mpf) -> mp.mpf:
            return mp.fsum(binomial(k, 10, p) for k in range(3))

        close(PROGRAM.few(10.0, 0.3), wanted(mp.mpf(0.3)))
        close(PROGRAM.d_few(10.0, 0.3), mp.diff(wanted, mp.mpf(0.3)))


@pytest.mark.parametrize("method", ["quadrature", "mc", "qmc"])
def test_whole_numbers_and_others(method: str) -> None:
    """A sum around an integral with a jump that moves."""
    with mp.workdps(40):

        def wanted(r: mp.mpf, t: mp.mpf) -> mp.mpf:
            return mp.fsum(poisson(k, r) * mp.ncdf(2 * (t - k)) for k in range(60))

        r, t = mp.mpf(2), mp.mpf("1.75")
        exact = wanted(r, t), mp.diff(wanted, (r, t), (1, 0)), mp.diff(wanted, (r, t), (0, 1))
    with potto.settings(method=method, samples=4_000, seed=2):
        found = PROGRAM.shots(2.0, 1.75), PROGRAM.d_shots(2.0, 1.75), PROGRAM.t_shots(2.0, 1.75)
    for one, value in zip(found, exact, strict=True):
        if method == "quadrature":
            close(one, value)
        else:
            assert abs(float(one) - value) <= 5 * one.error + 1e-9


def test_inside_of_an_integral() -> None:
    with mp.workdps(40):
        p, t = mp.mpf(0.3), mp.mpf(1.3)
        close(PROGRAM.coin(0.3, 1.3), (1 - p) * (1 - mp.exp(-t)) + p * (1 - mp.exp(-t / 2)))
        close(PROGRAM.d_coin(0.3, 1.3), (1 - p) * mp.exp(-t) + p / 2 * mp.exp(-t / 2))


def test_categorical_and_truncated_and_mixed() -> None:
    with mp.workdps(40):
        w, t, r = mp.mpf(2), mp.mpf(0.7), mp.mpf(0.5)

        def die(w: mp.mpf) -> mp.mpf:
            return (1 + w * t + 3 * t / 2) / (4 + w)

        close(PROGRAM.die(2.0, 0.7), die(w))
        close(PROGRAM.d_die(2.0, 0.7), mp.diff(die, w))
        close(PROGRAM.some(0.5), r / -mp.expm1(-r))
        close(PROGRAM.d_some(0.5), mp.diff(lambda r: r / -mp.expm1(-r), r))
        close(PROGRAM.both(2.0), mp.mpf(2 * 6 + 1) / 3)


def test_a_rate_that_varies_inside() -> None:
    """How far the sum goes has to be known outside."""
    with pytest.raises(potto.PottoError, match=r"how far this measure counts .*P0303"):
        potto.compile("def h(t) integral (x ~ uniform(1, 2), k ~ poisson(x)) [x < t] d(x, k)\n").h(1.0)


@pytest.mark.parametrize(("name", "values"), [("few", (2.5, 0.5)), ("square", (-1.0,)), ("coin", (1.5, 1.0))])
def test_what_is_not_valid(name: str, values: tuple[float, ...]) -> None:
    with pytest.raises(potto.PottoError, match=r"trials must be whole|rate must be positive|between 0 and 1"):
        getattr(PROGRAM, name)(*values)


SECOND: dict[str, tuple[str, Callable[[Any], Any]]] = {
    "k > 2": ("integral (k ~ poisson(t)) [k > 2] d(k)", lambda t: 1 - mp.exp(-t) * (1 + t + t * t / 2)),
    "an edge between two": (
        "integral (k ~ poisson(t), l ~ bernoulli(t/2)) [k > l] d(k, l)",
        lambda t: (1 - t / 2) * (1 - mp.exp(-t)) + t / 2 * (1 - mp.exp(-t) * (1 + t)),
    ),
    "a case": (
        "integral (k ~ binomial(3, t/2)) (if [k >= 2] then t*k else t^3) d(k)",
        lambda t: sum(
            mp.binomial(3, k) * (t / 2) ** k * (1 - t / 2) ** (3 - k) * (t * k if k >= 2 else t**3) for k in range(4)
        ),
    ),
    "beside another": (
        "integral (x ~ normal(0, 1), k ~ poisson(t)) [k >= 1 and x < t*k] d(x, k)",
        lambda t: sum(poisson(k, t) * mp.ncdf(t * k) for k in range(1, 60)),
    ),
    "a sum": ("sum i in 0..4, j in 0..4 ([i > j and i + j <= 4]*t^(i + j))", lambda t: t + t**2 + 2 * t**3 + 2 * t**4),
}


@pytest.mark.parametrize("name", SECOND)
def test_a_condition_that_numbers_meet_exactly_has_second_derivatives(name: str) -> None:
    program, exact = SECOND[name]
    f = potto.compile(f"def f(t)\n    {program}").f
    answer = potto.hessian(f)(0.7)
    with mp.workdps(40):
        second = mp.diff(exact, mp.mpf(0.7), 2)
    assert answer.converged
    assert abs(answer.value - second) <= answer.error + 1e-15 * abs(second)
    assert answer.error <= 1e-11
    assert not f.surfaces or name == "beside another"


def test_an_edge_that_has_no_value_for_some_numbers_stays_undefined() -> None:
    assert math.isnan(potto.compile("def f(t)\n    sum k in 0..3 ([sqrt(k - 2) >= 1]*t)").f(1.0).value)
