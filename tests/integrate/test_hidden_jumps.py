"""Jumps inside inner integrals that no trace can force: in recursions, in sums, in bounds. And integrals in integrals
in integrals, which end when their budget does. Closed forms."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any, Literal

import mpmath as mp
import pytest

import potto

PROGRAM = """
def steps(n, x, t) if n > 0 then [x < t*n/20] + steps(n - 1, x, t) else 0
def in_exp(n, t) integral [0, 1] exp(integral [0, 1] steps(n, x, t)*y d(y)) d(x)
def in_sum(n, t) integral [0, 1] exp(integral [0, 1] (sum i in 1..n ([x < t*i/20]))*y d(y)) d(x)
def in_bound(n, t) integral [0, 1] (integral [0, steps(n, x, t)] y d(y)) d(x)
def mean(n, x, t) if n > 0 then integral [0, 1] ([x < t*n/20]*y + mean(n - 1, x, t)*y) d(y) else 0
def recursive(n, t) integral [0, 1] mean(n, x, t) d(x)
def of_recursive(n, t) integral [0, 1] exp(mean(n, x, t)) d(x)
def deep(n, x) if n > 0 then integral [0, 1] exp(-x*y*deep(n - 1, x*y)) d(y) else x
def of_deep(n, t) integral [0, 1] deep(n, x*t) d(x)
def on_bound(t) integral [0, 1] exp(integral [0, 1] steps(3, x + t, 20/3)*y d(y)) d(x)
"""


def by_count(n: int, worth: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """The integral over [0, 1] of something that is worth so much where j of the steps t/20, 2t/20, ... are ahead."""

    def f(t: Any) -> Any:
        cuts = [mp.mpf(0), *(t * i / 20 for i in range(1, n + 1)), mp.mpf(1)]
        return sum((b - a) * worth(n - j) for j, (a, b) in enumerate(itertools.pairwise(cuts)))

    return f


def mean(n: int, ahead: Any) -> Any:
    return sum(mp.mpf(0.5) ** (n - k + 1) for k in range(n - int(ahead) + 1, n + 1))


CASES: list[tuple[str, int, Callable[[Any], Any]]] = [
    ("in_exp", 3, by_count(3, lambda k: mp.exp(mp.mpf(k) / 2))),
    ("in_exp", 8, by_count(8, lambda k: mp.exp(mp.mpf(k) / 2))),
    ("in_sum", 8, by_count(8, lambda k: mp.exp(mp.mpf(k) / 2))),
    ("in_bound", 8, by_count(8, lambda k: mp.mpf(k) ** 2 / 2)),
    ("recursive", 4, by_count(4, lambda k: mean(4, k))),
    ("of_recursive", 4, by_count(4, lambda k: mp.exp(mean(4, k)))),
]


@pytest.mark.parametrize(("name", "n", "exact"), CASES, ids=[f"{name} {n}" for name, n, _ in CASES])
def test_derivatives_count_jumps_that_cannot_be_forced(name: str, n: int, exact: Callable[[Any], Any]) -> None:
    found = potto.grad(getattr(potto.compile(PROGRAM), name), "t")(n=n, t=0.7)
    assert found.converged
    for got, error, true in (
        (found.value, found.error, exact(mp.mpf(0.7))),
        (found.tangent, found.tangent_error, mp.diff(exact, 0.7)),
    ):
        assert abs(got - true) <= error <= 1e-10


def test_where_such_a_jump_lies_on_a_bound_the_derivative_is_not_vouched_for() -> None:
    found = potto.grad(potto.compile(PROGRAM).on_bound, "t")(t=0.0)
    assert not found.converged and math.isinf(found.tangent_error)


def test_integrals_in_integrals_end_when_their_budget_does() -> None:
    with potto.settings(max_evals=200_000):
        found = potto.compile(PROGRAM).of_deep(n=12, t=0.7)
    assert not found.converged
    assert any("budget" in reason for reason in found.reasons)
    assert found.evals < 4_000_000
    assert math.isnan(found.value) or found.error > 0


@pytest.mark.parametrize("method", ["mc", "qmc"])
@pytest.mark.parametrize(("name", "n", "exact"), CASES, ids=[f"{name} {n}" for name, n, _ in CASES])
def test_sampling_finds_their_jumps_beside_them(
    name: str, n: int, exact: Callable[[Any], Any], method: Literal["mc", "qmc"]
) -> None:
    f = potto.grad(getattr(potto.compile(PROGRAM), name), "t")
    for seed in range(3):
        with potto.settings(method=method, samples=2_000, seed=seed):
            found = f(n=n, t=0.7)
        assert abs(found.value - exact(mp.mpf(0.7))) <= found.error
        assert abs(found.tangent - mp.diff(exact, 0.7)) <= found.tangent_error <= 1e-10


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_sampling_finds_curves_that_cannot_be_forced(method: Literal["mc", "qmc"]) -> None:
    """A point is weighed by how many of the parabolas x + y^2 = t k/4, k = 1..4, it is below of."""
    program = """
def below(n, x, y, t) if n > 0 then [x + y*y < t*n/4] + below(n - 1, x, y, t) else 0
def f(t) integral ([0, 1], [0, 1]) (integral [0, below(4, x, y, t)] 2*z*x d(z)) d(x, y)
"""

    def exact(t: Any) -> Any:
        # the square of the count is a sum of 2 j - 1, and j curves are ahead below that of t (5 - j)/4
        def part(j: int) -> Any:
            s = t * (5 - j) / 4
            return (2 * j - 1) * mp.quad(lambda y: min(s - y * y, 1) ** 2 / 2, [0, mp.sqrt(max(s - 1, 0)), mp.sqrt(s)])

        return sum(part(j) for j in range(1, 5))

    f = potto.grad(potto.compile(program).f, "t")
    for seed in range(3):
        with potto.settings(method=method, samples=4_000, seed=seed):
            found = f(t=0.7)
        assert abs(found.value - exact(mp.mpf(0.7))) <= found.error < 0.1
        assert abs(found.tangent - mp.diff(exact, 0.7)) <= found.tangent_error < 0.1


def test_surfaces_along_axes_that_take_too_much_are_not_looked_at_beside_the_parameters() -> None:
    """Each look is an integral of its own, and there is a budget for one: the ends of segments come on top of it."""
    waves = "[max(x*y, z) < t*sin(3*x) or cos(9*x) + cos(9*y) + cos(9*z) > t]/(1 + 50*(x - y)^2)"
    f = potto.compile(f"def f(t) integral ([0, 2], [0, x], [0, y]) {waves} d(x, y, z)").f
    with potto.settings(max_evals=20_000):
        answer = potto.deriv(f)((0.4, 1.0))
    assert not answer.converged and answer.tangent_error == math.inf
    assert answer.evals < 800_000  # 2,000,000 with what is beside
