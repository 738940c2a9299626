"""Integrands that fall apart into numbers of different variables, max(a + b, c + d): each number has a density.

No order of the variables hands on one number, so that four of them took samples. Numbers may be made of such numbers,
in trees of sums and extremes. The references are integrals over one variable by mpmath, of distributions in closed
form.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import pytest

import potto

Number = Callable[[Any], Any]
T = 0.3
UNIFORM = "[0, 1], [0, 1], [0, 1], [0, 1]"


def waiting(rate: Any, low: Any, high: Any) -> Number:
    """How often exponential(rate) + uniform(low, high) is less than s."""

    def below(s: Any) -> Any:
        if s <= low:
            return mp.mpf(0)
        top = min(s, high)
        return (top - low - (mp.exp(rate * (top - s)) - mp.exp(rate * (low - s))) / rate) / (high - low)

    return below


def late(mean: Any, spread: Any, rate: Any) -> Number:
    """How often normal(mean, spread) + exponential(rate) is less than s."""

    def below(s: Any) -> Any:
        x, y = (s - mean) / spread, rate * spread
        return mp.ncdf(x) - mp.exp(y * y / 2 - y * x) * mp.ncdf(x - y)

    return below


def greatest(first: Number, second: Number, places: list[Any]) -> Any:
    """The mean of the greater of two numbers, by how often each is less than s."""
    above = mp.quad(lambda s: 1 - first(s) * second(s), [p for p in places if p >= 0])
    return above - mp.quad(lambda s: first(s) * second(s), [p for p in places if p <= 0])


def far_apart(t: Any) -> Any:
    """The integral of the distance of two points over a rectangle of sides t and 1, in polar coordinates."""

    def along(angle: Any) -> Any:
        c, s = mp.cos(angle), mp.sin(angle)
        r = t / c if t * s <= c else 1 / s
        return 4 * (t * r**3 / 3 - (c + t * s) * r**4 / 4 + c * s * r**5 / 5)

    return mp.quad(along, [0, mp.atan(1 / t), mp.pi / 2])


# name, bounds and body, value as a function of t, the most evaluations
CASES: list[tuple[str, str, str, Number, int]] = [
    ("waits", "a ~ exponential(1 + t), b ~ uniform(0, 1 + t), c ~ exponential(1), d ~ uniform(0.5, 1 + t)",
     "max(a + b, c + d)",
     lambda t: greatest(waiting(1 + t, 0, 1 + t), waiting(mp.mpf(1), mp.mpf("0.5"), 1 + t),
                        [-1, 0, mp.mpf("0.5"), 1 + t, 2, 5, 10, 20, 60]), 500_000),
    ("late arrivals", "a ~ normal(t, 1), b ~ exponential(1 + t), c ~ normal(0, t), d ~ exponential(2)",
     "max(a + b, c + d)",
     lambda t: greatest(late(t, 1, 1 + t), late(0, t, mp.mpf(2)), [-12, -4, -2, -1, 0, 1, 2, 4, 8, 16, 40]), 1_000_000),
    ("distance", "[0, t], [0, 1], [0, t], [0, 1]", "sqrt((a - c)^2 + (b - d)^2)", far_apart, 1_500_000),
    ("closeness", UNIFORM, "[(a - c)^2 + (b - d)^2 < t^2]", lambda t: mp.pi*t**2 - 8*t**3/3 + t**4/2, 1_000_000),
    ("product of sums", "a ~ exponential(1), b ~ exponential(1), c ~ exponential(1), d ~ exponential(1)",
     "[(a + b)*(c + d) < t]",
     lambda t: mp.quad(lambda x: x*mp.exp(-x)*(1 - (1 + t/x)*mp.exp(-t/x)), [0, t, 1, 5, 20, 60]), 500_000),
]  # fmt: skip


@pytest.mark.parametrize(("name", "bounds", "body", "exact", "evals"), CASES, ids=[row[0] for row in CASES])
def test_numbers_of_two_variables_each(name: str, bounds: str, body: str, exact: Number, evals: int) -> None:
    """The largest errors that are admitted are a few times what is asked for; samples came to 1e-3."""
    found = potto.grad(potto.compile(f"def f(t) integral ({bounds}) {body} d(a, b, c, d)").f, "t")(T)
    with mp.workdps(25):
        value, rate = exact(mp.mpf(T)), mp.diff(exact, mp.mpf(T), h=mp.mpf(10) ** -8)
    assert abs(found.value - value) <= found.error <= 1e-9
    assert abs(found.tangent - rate) <= found.tangent_error <= 1e-9
    assert found.method == "quadrature" and found.evals <= evals


def test_any_order_of_the_variables() -> None:
    bounds = {"a": "a ~ exponential(2)", "b": "b ~ uniform(0, 1)", "c": "c ~ exponential(t)", "d": "d ~ uniform(0, 2)"}

    def exact(t: Any) -> Any:
        return greatest(waiting(2, 0, 1), waiting(t, 0, 2), [-1, 0, 1, 2, 5, 10, 30, 60])

    with mp.workdps(20):
        value = exact(mp.mpf(1))
    for order in ("a, b, c, d", "c, a, d, b", "d, c, b, a"):
        every = ", ".join(bounds[name] for name in order.split(", "))
        found = potto.compile(f"def f(t) integral ({every}) max(a + b, c + d) d({order})").f(1)
        assert found.converged and abs(found.value - value) <= found.error


def gamma(s: Any) -> Any:
    """How often the sum of two exponential(1) is less than s."""
    return 1 - (1 + s) * mp.exp(-s)


def triangle(s: Any) -> Any:
    """How often the sum of two uniform(0, 1) is less than s."""
    return s * s / 2 if s <= 1 else 1 - (2 - s) ** 2 / 2 if s <= 2 else mp.mpf(1)


def above_each(greatest: Number) -> Number:
    """How often the greatest of two normal(0, 1) and what has another distribution add up to less than t."""
    return lambda t: mp.quad(lambda x: 2 * mp.npdf(x) * mp.ncdf(x) * greatest(t - x), [-12, -6, -3, -1, 0, 1, 3, 6, 12])


def waits_and_a_wait(t: Any) -> Any:
    """How often max(a + b, c + d) + max(e, f) < t of exponential(1) numbers."""
    return mp.quad(lambda s: 2 * gamma(s) * s * mp.exp(-s) * (1 - mp.exp(s - t)) ** 2, [0, t])


def flat_numbers(t: Any) -> Any:
    """The same of uniform(0, 1) numbers, for t from 2 to 3."""

    def density(s: Any) -> Any:
        return 2 * triangle(s) * (s if s <= 1 else 2 - s)

    return mp.quad(density, [0, 1, t - 1]) + mp.quad(lambda s: density(s) * (t - s) ** 2, [t - 1, 2])


def lesser(t: Any) -> Any:
    """The mean of min(a + b, max(c + d, t*e + t*f)) of uniform(0, 1) numbers, for t < 1."""
    return mp.quad(lambda s: (1 - triangle(s)) * (1 - triangle(s) * triangle(s / t)), sorted([0, t, 2 * t, 1, 2]))


UNIT, WAIT, NORMAL = "uniform(0, 1)", "exponential(1)", "normal(0, 1)"
# measure of each, names, body, value as a function of t, error that is admitted, the most evaluations
TREES: list[tuple[str, str, str, Number, float, int]] = [
    (UNIT, "abcdef", "max(t*(a + b), max(t*(c + d), t*(e + f)))", lambda t: mp.mpf("1.35")*t, 1e-11, 50_000),
    (UNIT, "abcdef", "min(a + b, max(c + d, t*e + t*f))", lesser, 1e-11, 100_000),
    (WAIT, "abcdef", "t*max(a + b, max(c + d, e + f))", lambda t: mp.mpf(347)/108*t, 1e-9, 2_000_000),
    (WAIT, "abcdef", "exp(-t*max(a + b, max(c + d, e + f)))",
     lambda t: t*mp.quad(lambda s: mp.exp(-t*s)*gamma(s)**3, [0, 1, 3, 10, 30, 80, 200]), 1e-9, 2_000_000),
    (NORMAL, "abcd", "[max(a, c) + max(b, d) < t]", above_each(lambda s: mp.ncdf(s)**2), 1e-10, 500_000),
    (WAIT, "abcdef", "[max(a + b, c + d) + max(e, f) < 2 + t]", lambda t: waits_and_a_wait(2 + t), 1e-10, 200_000),
    (UNIT, "abcdef", "[max(a + b, c + d) + max(e, f) < 2 + t]", lambda t: flat_numbers(2 + t), 1e-10, 3_000_000),
    (UNIT, "abcdef", "t*max(max(a, b) + c, max(d, e) + f)", lambda t: mp.mpf(869)/630*t, 1e-11, 100_000),
]  # fmt: skip


@pytest.mark.parametrize(
    ("measure", "names", "body", "exact", "off", "evals"), TREES, ids=[f"{row[0]} {row[2]}" for row in TREES]
)
def test_trees(measure: str, names: str, body: str, exact: Number, off: float, evals: int) -> None:
    """Errors that are admitted: what is asked for, with the density's tails where ranges are infinite."""
    bounds = ", ".join(f"{name} ~ {measure}" for name in names)
    found = potto.grad(potto.compile(f"def f(t) integral ({bounds}) {body} d({', '.join(names)})").f, "t")(T)
    with mp.workdps(25):
        value, rate = exact(mp.mpf(T)), mp.diff(exact, mp.mpf(T), h=mp.mpf(10) ** -8)
    assert abs(found.value - value) <= found.error <= off
    assert abs(found.tangent - rate) <= found.tangent_error <= off
    assert found.method == "quadrature" and found.evals <= evals
