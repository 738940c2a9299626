"""Normal numbers of which only a combination matters: one variable for two, and the same answer."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import mpmath as mp
import pytest

import potto

T = 0.3
Number = Callable[[Any], Any]


def holds(text: str, exact: Number, evals: int, at: float = T) -> None:
    """Value and derivative within their errors, which are below 1e-9: that takes few evaluations."""
    found = potto.grad(potto.compile(f"def f(t) {text}").f, "t")(at)
    with mp.workdps(30):
        value, rate = exact(mp.mpf(at)), mp.diff(exact, mp.mpf(at), h=mp.mpf(10) ** -10)
    assert abs(found.value - value) <= found.error <= 1e-9
    assert abs(found.tangent - rate) <= found.tangent_error <= 1e-9
    assert found.evals <= evals


def within(r: Any, apart: Any, spread: Any) -> Any:
    """How often two points are closer than r: the Rice distribution."""
    low = spread**2
    return mp.quad(lambda d: d / low * mp.exp(-(d**2 + apart**2) / (2 * low)) * mp.besseli(0, d * apart / low), [0, r])


MEASURES = {"a": "normal(0, t)", "b": "normal(0, 0.4)", "c": "normal(1, t)", "d": "normal(0.5, 0.4)"}


@pytest.mark.parametrize("order", ["abcd", "acbd", "dbca"])
@pytest.mark.parametrize("nested", [False, True])
def test_a_distance_between_two_uncertain_points(order: str, nested: bool) -> None:
    """Four variables: samples told it to 5 % in three seconds."""
    body = "[(a - c)^2 + (b - d)^2 < 0.25]"
    if nested:
        for name in reversed(order):
            body = f"(integral ({name} ~ {MEASURES[name].replace('0.4', 't')}) {body} d({name}))"
    else:
        every = ", ".join(f"{name} ~ {MEASURES[name].replace('0.4', 't')}" for name in order)
        body = f"integral ({every}) {body} d({', '.join(order)})"
    holds(body, lambda t: within(mp.mpf("0.5"), mp.sqrt("1.25"), mp.sqrt(2) * t), 20_000)


@pytest.mark.parametrize("order", ["abcd", "dbca"])
def test_second_derivatives_of_a_distance(order: str) -> None:
    """The integrands of derivatives have deltas, and twice as many densities."""
    every = ", ".join(f"{name} ~ {MEASURES[name].replace('0.4', 't')}" for name in order)
    text = f"integral ({every}) [(a - c)^2 + (b - d)^2 < r^2] d({', '.join(order)})"
    found = potto.hessian(potto.compile(f"def f(r, t) {text}").f, ("r", "t"))(0.5, T)

    def exact(r: Any, t: Any) -> Any:
        return within(r, mp.sqrt("1.25"), mp.sqrt(2) * t)

    with mp.workdps(30):
        at = mp.mpf("0.5"), mp.mpf(T)
        cross = mp.diff(exact, at, (1, 1))
        answer = [[mp.diff(exact, at, (2, 0)), cross], [cross, mp.diff(exact, at, (0, 2))]]
    assert found.converged
    assert found.evals <= 100_000
    for row, errors, numbers in zip(found.value, found.error, answer, strict=True):
        for value, error, number in zip(row, errors, numbers, strict=True):
            assert abs(value - number) <= error <= 1e-9


def test_the_density_of_a_distance() -> None:
    """A delta of four variables: 43 million evaluations, and no error was known."""
    every = ", ".join(f"{name} ~ {measure.replace('0.4', 't')}" for name, measure in MEASURES.items())
    text = f"integral ({every}) delta(sqrt((a - c)^2 + (b - d)^2) - 0.5) d(a, b, c, d)"

    def exact(t: Any) -> Any:
        low, apart, r = 2 * t * t, mp.sqrt("1.25"), mp.mpf("0.5")
        return r / low * mp.exp(-(r**2 + apart**2) / (2 * low)) * mp.besseli(0, r * apart / low)

    holds(text, exact, 2_000)


def test_a_sum_of_seven() -> None:
    names = "abcdefg"
    bounds = ", ".join(f"{name} ~ normal(0.5, t)" for name in names)
    text = f"integral ({bounds}) [{' + '.join(names)} < 2*t + 3] d({', '.join(names)})"
    holds(text, lambda t: mp.ncdf((2 * t - mp.mpf(1) / 2) / (t * mp.sqrt(7))), 1_000, 0.8)


@pytest.mark.parametrize(("x", "y"), list(itertools.product([1.0, -2.0, 1e-8], [3.0, -0.5, 1e8])))
def test_weights(x: float, y: float) -> None:
    """E cos(x a + y b), by the normal's transform; also where one of the two hardly counts."""

    def exact(t: Any) -> Any:
        return mp.cos(mp.mpf(x) * t) * mp.exp(-(mp.mpf(x) ** 2 + (mp.mpf(y) * t / mp.mpf(y)) ** 2) / 2)

    inner = f"{x!r}*a + {y!r}*b"
    holds(f"integral (a ~ normal(t, 1), b ~ normal(0, t/{abs(y)!r})) cos({inner}) d(a, b)", exact, 5_000)


def test_a_density_by_hand_and_other_factors() -> None:
    """Not a measure's: exp(-(1 - x)^2) has its own mass; what has to do with neither stays a factor."""

    def exact(t: Any) -> Any:
        spread = mp.sqrt(mp.mpf(1) / 2 + t * t)
        return mp.sqrt(mp.pi) * mp.ncdf((t - 1) / spread) * (mp.e - 1)

    text = "integral ([-inf, inf], [0, 1], [-inf, inf]) exp(-(1 - x)^2)*exp(z)*exp(-(y/t)^2/2)/(t*sqrt(2*pi))"
    holds(f"{text}*[x - y < t] d(x, z, y)", exact, 5_000)


@pytest.mark.parametrize(
    ("body", "exact"),
    [
        ("[x < y]*[x + y < t]", lambda t: mp.ncdf(t / mp.sqrt(2)) / 2),  # two combinations
        ("[t*x + y < 1]", lambda t: mp.ncdf(1 / mp.sqrt(1 + t * t))),  # a weight that may be 0
        ("[x - y < t]*x", lambda t: -mp.npdf(t / mp.sqrt(2)) / mp.sqrt(2)),  # and x by itself
    ],
)
def test_what_knows_more_than_one_combination_stays(body: str, exact: Number) -> None:
    holds(f"integral (x ~ normal(0, 1), y ~ normal(0, 1)) {body} d(x, y)", exact, 500_000)


def wait(t: Any, s: Any) -> Any:
    """How often gamma(2, t) is less than s: beta(2, 3) of gamma(5, t) is that."""
    return mp.gammainc(2, 0, t * s, regularized=True)


def greater(t: Any) -> Any:
    places = [0, 0.25, 0.5, 1, 2, 4, 8, 16, 40, 80]
    return mp.quad(lambda s: 1 - wait(t, s) * (mp.ncdf(2 * mp.log(s)) if s else 0), places)


def less(t: Any) -> Any:
    places = [-12, -6, -3, -1, 0, 1, 3, 6, 12]
    return mp.quad(lambda z: wait(t, mp.exp(mp.mpf("0.2") + t * z)) * mp.npdf(z), places)


@pytest.mark.parametrize(
    ("bounds", "body", "exact"),
    [
        ("a ~ beta(2, 3), b ~ gamma(5, t), c ~ lognormal(0, 0.5)", "max(a*b, c)", greater),
        ("c ~ lognormal(0.2, t), a ~ beta(2, 3), b ~ gamma(5, t)", "[a*b < c]", less),
    ],
)
def test_lognormal_numbers_are_integrated_over_their_logarithms(bounds: str, body: str, exact: Number) -> None:
    """Over themselves the first one took 6.7 million evaluations, and its derivative was known to 5e-10."""
    order = ", ".join(row.split()[0] for row in bounds.split("), "))
    holds(f"integral ({bounds}) {body} d({order})", exact, 1_000_000, 1.3)


def test_second_derivatives_by_a_lognormal_number() -> None:
    """P(a < c): the mean of exp(-c), along t."""
    text = "integral (c ~ lognormal(0.2, t), a ~ exponential(1)) [a < c] d(c, a)"
    found = potto.hessian(potto.compile(f"def f(t) {text}").f, "t")(0.7)
    with mp.workdps(25):
        places = [-14, -6, -3, -1, 0, 1, 3, 6, 14]
        exact = mp.diff(
            lambda t: mp.quad(lambda z: -mp.exp(-mp.exp(mp.mpf("0.2") + t * z)) * mp.npdf(z), places), mp.mpf(0.7), 2
        )
    assert abs(found.value - exact) <= found.error <= 1e-10


def test_combinations_are_another_one_in_a_narrow_place() -> None:
    """Where 0.3 < y < 0.31, the exponent is of another combination than the condition: that had been left out.

    With a weight 1 + c in the exponent, the integral over both is that of a Gaussian in closed form.
    """
    text = """
        integral [0, 1] (
            integral (x ~ normal(0, 1), z ~ normal(0, 1))
                [x + z < t]*exp(-(x*(1 + 10000*max(0, (y - 0.3)*(0.31 - y))) + z)^2) d(x, z)
        ) d(y)
    """

    def weighted(c: Any, t: Any) -> Any:
        one, other = 1 + c**2, mp.mpf("1.5") - (2 * c - 1) ** 2 / (4 * (1 + c**2))
        return (1 + mp.erf(mp.sqrt(other) * t)) / (4 * mp.sqrt(one * other))

    def exact(t: Any) -> Any:
        low, high = mp.mpf(0.3), mp.mpf(0.31)
        inside = mp.quad(lambda y: weighted(10000 * (y - low) * (high - y), t), [low, high])
        return inside + (1 - high + low) * weighted(0, t)

    holds(text, exact, 10_000_000, 0.1)
