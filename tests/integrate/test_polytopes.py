"""Polynomials over polytopes: between the planes that are known every integral is a polynomial, and rules are exact.

The volumes are those of combinatorics: of the chain polytope of a zigzag (Stanley, Two poset polytopes, 1986), n! of
which is the number of alternating permutations, and of simplices.
"""

from __future__ import annotations

import itertools
import math

import mpmath as mp
import pytest

import potto

NAMES = "abcdef"
# How many permutations of n things alternate.
ALTERNATING = {3: 2, 4: 5, 5: 16, 6: 61}
DIGITS = 1e-12  # what is left is rounding, of sums that cancel a little


def check(text: str, at: float, value: float, rate: float, most: int) -> None:
    found = potto.deriv(potto.compile(text).f)((at, 1.0))
    for got, error, true in ((found.value, found.error, value), (found.tangent, found.tangent_error, rate)):
        assert abs(got - true) <= error + 1e-15 * abs(true) and error <= DIGITS * abs(true), (got, error, true)
    assert found.method == "quadrature" and found.evals <= most


def over(n: int, body: str) -> str:
    return f"def f(t) integral ({', '.join(['[0, 1]'] * n)}) {body} d({', '.join(NAMES[:n])})"


@pytest.mark.parametrize("n", ALTERNATING)
def test_zigzags(n: int) -> None:
    body = "*".join(f"[{a} + {b} < t]" for a, b in itertools.pairwise(NAMES[:n]))
    share = ALTERNATING[n] / math.factorial(n)
    check(over(n, body), 0.9, share * 0.9**n, n * share * 0.9 ** (n - 1), 100_000)


@pytest.mark.parametrize("n", [3, 4, 5])
def test_a_polynomial_over_ordered_variables(n: int) -> None:
    """a*z over a < b < ... < z < t: the integrals of a are b^2/2, c^3/6, ...; so t^(n+2)/(n! (n+2))."""
    inside = " and ".join([*(f"{a} < {b}" for a, b in itertools.pairwise(NAMES[:n])), f"{NAMES[n - 1]} < t"])
    size = math.factorial(n) * (n + 2)
    check(over(n, f"[{inside}]*a*{NAMES[n - 1]}"), 0.8, 0.8 ** (n + 2) / size, (n + 2) * 0.8 ** (n + 1) / size, 100_000)


def test_kinks_in_conditions_are_no_planes() -> None:
    """abs(a) + abs(b) + abs(c) < t: between the surfaces as they are written volumes are not polynomials."""
    text = "def f(t) integral ([-1, 1], [-1, 1], [-1, 1]) [abs(a) + abs(b) + abs(c) < t] d(a, b, c)"
    found = potto.deriv(potto.compile(text).f)((0.8, 1.0))
    assert abs(found.value - 4 / 3 * 0.8**3) <= found.error <= 1e-8
    assert abs(found.tangent - 4 * 0.8**2) <= found.tangent_error <= 1e-8


@pytest.mark.parametrize(("n", "most"), [(2, 100), (3, 500), (4, 300_000)])
@pytest.mark.parametrize("sense", ["<", ">"])
def test_a_greatest_less_a_least_is_compared_as_each_difference_is(n: int, most: int, sense: str) -> None:
    """The chance that n numbers in [0, 1] are all within t of each other is n t^(n-1) - (n-1) t^n."""
    t, names = 0.4, ", ".join(NAMES[:n])
    chance, rate = n * t ** (n - 1) - (n - 1) * t**n, n * (n - 1) * (t ** (n - 2) - t ** (n - 1))
    if sense == ">":
        chance, rate = 1 - chance, -rate
    check(over(n, f"[max({names}) - min({names}) {sense} t]"), t, chance, rate, most)


def test_differences_of_normal_numbers() -> None:
    """The range of three: 3 int phi(x) (Phi(x + t) - Phi(x))^2 dx."""
    f = potto.compile("def f(t) integral (a ~ normal(0, 1), b ~ normal(0, 1), c ~ normal(0, 1)) "
                      "[max(a, b, c) - min(a, b, c) < t] d(a, b, c)").f  # fmt: skip
    found = f(1.0)
    true = 3 * mp.quad(lambda x: mp.npdf(x) * (mp.ncdf(x + 1) - mp.ncdf(x)) ** 2, [-10, -3, 0, 3, 10])
    assert abs(found.value - true) <= found.error <= 1e-11
