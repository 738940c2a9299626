"""Integrals that diverge give inf, -inf or nan and say so; those that merely look like it give their value."""

from __future__ import annotations

import math

import pytest

import potto

INF, NAN = math.inf, math.nan
DIVERGENT = [
    ("integral [0, 1] t/x d(x)", 1.0, INF),
    ("integral [0, 1] -t/x d(x)", 1.0, -INF),
    ("integral [1, 0] t/x d(x)", 1.0, -INF),
    ("integral [0, 1] t/x^2 d(x)", 1.0, INF),
    ("integral [0, 1] x^(-t) d(x)", 1.0001, INF),
    ("integral [0, 1] [x < t]/x^1.5 d(x)", 0.5, INF),
    ("integral [0, 1] [x > t]/(x - t) d(x)", 0.5, INF),
    ("integral [0, 1] 1/abs(x - t) d(x)", 0.3, INF),
    ("integral [0, 1] 1/(x - t) d(x)", 0.3, NAN),
    ("integral [0, 2] tan(t*x) d(x)", 1.0, NAN),
    ("integral [0, inf] t d(x)", 1.0, INF),
    ("integral [1, inf] t/x d(x)", 1.0, INF),
    ("integral [0, inf] exp(t*x) d(x)", 1.0, INF),
    ("integral [0, inf] sin(t*x) d(x)", 1.0, NAN),
    ("integral [-inf, inf] t*x d(x)", 1.0, NAN),
    ("integral [-inf, inf] t d(x)", 1.0, INF),
    ("integral ([0, 1], [0, 1]) t/(x*y) d(x, y)", 1.0, INF),
]


@pytest.mark.parametrize(("text", "t", "answer"), DIVERGENT, ids=[row[0] for row in DIVERGENT])
def test_a_divergent_integral_is_no_number(text: str, t: float, answer: float) -> None:
    f = potto.compile(f"def f(t) {text}").f
    found = f(t=t)
    assert not found.converged and found.reasons
    assert math.isinf(found.error)
    assert found.value == answer or (math.isnan(answer) and math.isnan(found.value))
    rate = potto.grad(f, "t")(t=t)
    assert not rate.converged
    assert not math.isfinite(rate.tangent) or math.isinf(rate.tangent_error) or rate.tangent_error > abs(rate.tangent)


def test_what_cannot_be_told_from_a_divergent_integral_is_no_number_either() -> None:
    found = potto.compile("def f(t) integral [0, 1] x^(-t) d(x)").f(t=0.9999)  # 10,000
    assert math.isnan(found.value) and math.isinf(found.error) and not found.converged


@pytest.mark.parametrize(
    ("text", "t", "exact"),
    [
        ("integral [0, 1] x^(-t) d(x)", 0.95, 20.0),
        ("integral [0, 1] x^(-t) d(x)", 0.5, 2.0),
        ("integral [0, 1] log(t*x) d(x)", 1.0, -1.0),
        ("integral [0, 1] [x > t]/sqrt(x - t) d(x)", 0.5, math.sqrt(2)),
        ("integral [1, inf] t/x^1.5 d(x)", 1.0, 2.0),
        ("integral [-1, 1] x/(abs(x)^1.5 + t) d(x)", 1e-12, 0.0),
    ],
)
def test_singular_integrals_that_converge_are_numbers(text: str, t: float, exact: float) -> None:
    found = potto.compile(f"def f(t) {text}").f(t=t)
    assert abs(found.value - exact) <= found.error <= 1e-6


LENGTHS = [1e6, 1e8, 1e10, 1e12, 1e14, 1e15, 1e16, 1e17, 1e100]


@pytest.mark.parametrize("length", LENGTHS)
def test_what_is_narrow_beside_its_range_is_integrated(length: float) -> None:
    found = potto.compile("def f(L) integral [-L, L] 1/(1 + x^2) d(x)").f(length)
    assert found.converged
    assert abs(found.value - 2 * math.atan(length)) <= found.error <= 1e-10 * math.pi  # what is asked for by default


@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("integral [-L, L] exp(-(x - 5)^2) d(x)", math.sqrt(math.pi)),
        ("integral [0, L] exp(-x) d(x)", 1.0),
        ("integral [-L, L] 1/cosh(x) d(x)", math.pi),
        ("integral [-L, L] [x < 0.3]*exp(-x^2) d(x)", math.sqrt(math.pi) * (1 + math.erf(0.3)) / 2),
        ("integral [-L, L] [x < 3]*exp(-abs(x)) d(x)", 2 - math.exp(-3)),
        ("integral ([-L, L], [-L, L]) exp(-x^2 - y^2) d(x, y)", math.pi),
        ("integral [-L, L] (sum k in 1..2 (1/(1 + (k*x)^2)^2)) d(x)", 3 * math.pi / 4),
    ],
)
def test_densities_over_long_ranges(text: str, exact: float, length: float) -> None:
    """From 1e16 on some were 0, or without one side, with no error."""
    found = potto.compile(f"def f(L) {text}").f(length)
    assert found.converged
    assert abs(found.value - exact) <= found.error <= 1e-10 * exact


@pytest.mark.parametrize("k", [1e29, 1e30, 1e60, 1e200])
def test_what_is_narrower_than_panels_can_be_is_found_or_in_the_error(k: float) -> None:
    """Its integral over each variable is sqrt(pi/k), which had been 0 with no error. Cut where its exponent turns, it
    is found as long as 1e-20 is told from 0."""
    program = potto.compile("""
def line(k) integral [-1, 1] exp(-k*x^2) d(x)
def square(k) integral ([-1, 1], [-1, 1]) exp(-k*(x^2 + y^2)) d(x, y)
""")
    for found, exact in ((program.line(k), math.sqrt(math.pi / k)), (program.square(k), math.pi / k)):
        assert found.converged == (k < 1e60) and abs(found.value - exact) <= found.error


@pytest.mark.parametrize("width", [1e-30, 1e-100])
def test_growth_that_stops_beside_an_end_is_not_infinite(width: float) -> None:
    found = potto.compile("def f(w) integral [0, 1] 1/(w + x) d(x)").f(width)
    assert not found.converged
    assert abs(found.value - math.log1p(1 / width)) <= found.error
