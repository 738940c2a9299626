"""Integrals that are settled beforehand: few nodes, none on surfaces, errors within what is said at any tolerance.

Expected values are closed forms, by 40-digit arithmetic; derivatives are theirs, by differences of 40 digits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import pytest

import potto

PROGRAMS: dict[str, tuple[str, Callable[[Any], Any], int]] = {
    "a line": ("integral [0, 1] [x < t]*exp(3*x) d(x)", lambda t: (mp.exp(3 * t) - 1) / 3, 12),
    "a root": ("integral [0, 1] [x < t]*sqrt(x + 1) d(x)", lambda t: ((1 + t) ** 1.5 - 1) * mp.mpf(2) / 3, 14),
    "a place that curves": ("integral [0, 1] [x > t^2]/(1 + x) d(x)", lambda t: mp.log(2 / (1 + t * t)), 14),
    "a triangle": ("integral ([0, 1], [0, 1]) [x + y < t]*x*y d(x, y)", lambda t: t**4 / 24, 9),
    "a wave": ("integral ([0, 1], [0, 1]) [x + y < t]*cos(x - y) d(x, y)", lambda t: 1 - mp.cos(t), 60),
    "bounds that move": (
        "integral ([0, t], [0, x]) exp(x + y) d(x, y)",
        lambda t: (mp.exp(2 * t) - 1) / 2 - mp.exp(t) + 1,
        60,
    ),
    "two sides": (
        "integral ([0, 1], [0, 1]) (if [x < t] then exp(y) else cos(x)) d(x, y)",
        lambda t: t * (mp.e - 1) + mp.sin(1) - mp.sin(t),
        100,
    ),
    "a corner of a cube": ("integral ([0, 1], [0, 1], [0, 1]) [x + y + z < t] d(x, y, z)", lambda t: t**3 / 6, 8),
    "a corner with weight": (
        "integral ([0, 1], [0, 1], [0, 1]) [x + y + z < t]*exp(x + y + z) d(x, y, z)",
        lambda t: mp.exp(t) * (t * t / 2 - t + 1) - 1,
        500,
    ),
}


@pytest.mark.parametrize("rtol", [1e-6, 1e-10, 1e-12])
@pytest.mark.parametrize("name", PROGRAMS)
def test_value_and_derivative(name: str, rtol: float) -> None:
    text, closed, most = PROGRAMS[name]
    f = potto.deriv(potto.compile(f"def f(t) {text}\n").f)
    for t in (0.11, 0.37, 0.5, 0.83):
        with potto.counting(), potto.settings(rtol=rtol):
            r = f((t, 1.0))
        assert r.converged and r.evals <= most
        assert r.stats["boundary evaluations"] == r.stats["checks at still ends"] == 0
        with mp.workdps(40):
            for got, exact, error in ((r.value, closed(mp.mpf(t)), r.error),
                                      (r.tangent, mp.diff(closed, mp.mpf(t)), r.tangent_error)):  # fmt: skip
                off = float(abs(mp.mpf(got) - exact))
                assert off <= error + 2.0**-52 * abs(exact)
                assert off <= 1e-13 * max(1, abs(exact)) or rtol > 1e-10
                assert error <= rtol * abs(exact)


def test_derivatives_by_several_parameters_have_bounds_of_their_own() -> None:
    m = potto.compile("def f(a, b, t) integral [0, 1] [x < t]*a*sin(b*x) d(x)\n")
    a, b, t = 1.5, 2.0, 0.6
    r = potto.grad(m.f, ["a", "b", "t"])(a, b, t)
    with mp.workdps(40):
        exact = (
            (1 - mp.cos(b * mp.mpf(t))) / b,
            a * (mp.mpf(t) * mp.sin(b * mp.mpf(t)) / b - (1 - mp.cos(b * mp.mpf(t))) / b**2),
            a * mp.sin(b * mp.mpf(t)),
        )
        for got, expected, error in zip(r.tangent, exact, r.tangent_error, strict=True):
            assert abs(mp.mpf(got) - expected) <= error + 1e-16 and error < 1e-10


def test_an_answer_does_not_depend_on_what_was_asked_before() -> None:
    text = "def f(t) integral ([0, 1], [0, 1]) [x + y < t]*exp(x*y) d(x, y)\n"
    first = potto.deriv(potto.compile(text).f)((0.731, 1.0))
    other = potto.deriv(potto.compile(text.replace("def f(t)", "def f(t) # again\n   ")).f)
    for t in (0.72, 0.74, 0.2, 1.4, 0.7311):
        other((t, 1.0))
    again = other((0.731, 1.0))
    assert (again.value, again.error, again.tangent, again.evals) == (
        first.value, first.error, first.tangent, first.evals,
    )  # fmt: skip


@pytest.mark.parametrize("body", ["abs(x - 1/3)*[x < t]", "[x < t]*x^(1/2)", "[x < t]*exp(-(100*x - 30)^2)"])
def test_what_cannot_be_bounded_is_integrated_all_the_same(body: str) -> None:
    """A kink, a branch point at a bound, a peak: nothing is proved of them, and the estimates hold."""
    exact: Callable[[Any], Any] = {
        "abs": lambda t: mp.mpf(1) / 18 + (t - mp.mpf(1) / 3) ** 2 / 2,
        "[x < t]*x": lambda t: mp.mpf(2) / 3 * t ** mp.mpf(1.5),
        "[x < t]*e": lambda t: mp.sqrt(mp.pi) / 200 * (mp.erf(100 * t - 30) + mp.erf(30)),
    }[body.split("(")[0].split("^")[0].removesuffix("xp")]
    r = potto.compile(f"def f(t) integral [0, 1] {body} d(x)\n").f(0.5)
    with mp.workdps(40):
        off = float(abs(mp.mpf(r.value) - exact(mp.mpf(0.5))))
    assert off <= r.error + 1e-16


def test_an_integral_on_a_side_between_others_is_integrated() -> None:
    """Neither where all conditions hold nor where none does is there an integral."""
    m = potto.compile("""
def H(y) integral [0, 1] [z > y] d(z)
def F(y, a) if [y > a] then (if [y > 0.51] then 2 else H(y)) else 0
def f(a, s) integral [0, 1] F(x + s, a + s) d(x)
""")
    got = m.f(0.4937, 0.01)
    assert abs(got.value - (0.0063 * (1 - 0.50685) + 2 * 0.5)) <= 1e-15 + got.error


CORNER = potto.compile("def f(t) integral ([0, 1], [0, 1]) [x + y < t]*x*y d(x, y)").f


@pytest.mark.parametrize("around", [0.5, 1.0, 2.0])
def test_cells_that_change_within_a_region_of_parameters(around: float) -> None:
    """What is known of a region holds on all of it: the corner of a square, cut off, at 81 places one after the other,
    through those where the line comes to a vertex. Bounds cover, but for two roundings of numbers up to 1."""
    for step in range(-40, 41):
        t = around + step / 1000
        s = min(max(2 - t, 0.0), 1.0)
        value = t**4 / 24 if t < 1 else 0.25 - s * s / 2 + s**3 / 3 - s**4 / 24
        rate = t**3 / 6 if t < 1 else s - s * s + s**3 / 6
        found = potto.deriv(CORNER)((t, 1.0))
        assert abs(found.value - value) <= found.error + 3e-16 and found.error <= 1e-12
        if t not in (1.0, 2.0):  # there the line lies on a vertex
            assert abs(found.tangent - rate) <= found.tangent_error + 3e-16 and found.tangent_error <= 1e-12
