"""Integrands that fall apart into numbers of different variables, max(a + b, c + d): each number has a density.

No order of the variables hands on one number, so that four of them took samples. The references are integrals over one
variable by mpmath, and closed forms.
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
