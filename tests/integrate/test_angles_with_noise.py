"""Periodic conditions on infinite ranges: a density leaves only some of the periods.

Answers by mpmath: distribution functions at the ends of the periods, added up over all that matter at 40 digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto
from potto.integrate.decomposition import box_search

Between = Callable[[Any, Any], Any]  # the probability between two places


def normal(m: Any, s: Any) -> Between:
    return lambda a, b: mp.ncdf(b, m, s) - mp.ncdf(a, m, s)


def cosine(w: Any, between: Between, first: int = -4, last: int = 4, least: Any = -mp.inf) -> Any:
    """The probability of cos(a) > w and a > least."""
    total = mp.mpf(0)
    for k in range(first, last + 1):
        low, high = (2 * mp.pi * k + sign * mp.acos(w) for sign in (-1, 1))
        total += between(max(low, least), max(high, least))
    return total


def sine(w: Any, between: Between) -> Any:
    return sum(between(2 * mp.pi * k + mp.asin(w), 2 * mp.pi * k + mp.pi - mp.asin(w)) for k in range(-4, 5))


def tangent(w: Any, between: Between) -> Any:
    return sum(between(mp.pi * k + mp.atan(w), mp.pi * k + mp.pi / 2) for k in range(-8, 9))


M, S = mp.mpf("0.6"), mp.mpf("0.2")
NOISE = normal(mp.mpf(0.6), mp.mpf(0.2))  # the doubles of the programs
CASES: list[tuple[str, float, Callable[[Any], Any]]] = [
    ("integral (a ~ normal(0.6, 0.2)) [cos(a) > w] d(a)", 0.8, lambda w: cosine(w, NOISE)),
    ("integral (a ~ normal(0.6, 0.2)) [cos(a) > w]*[a > 0] d(a)", 0.8, lambda w: cosine(w, NOISE, least=mp.mpf(0))),
    ("integral (a ~ normal(0.6, 0.2)) [a > 0.5]*[w < cos(a)] d(a)", 0.8,
     lambda w: cosine(w, NOISE, least=mp.mpf(0.5))),
    ("integral (a ~ normal(0.6, 0.2)) [cos(a) > w]*[cos(a) < 0.9] d(a)", 0.8,
     lambda w: cosine(w, NOISE) - cosine(mp.mpf(0.9), NOISE)),
    ("integral (a ~ normal(0.6, 0.2)) [sin(a) > w] d(a)", 0.5, lambda w: sine(w, NOISE)),
    ("integral (a ~ normal(0.6, 0.2)) [tan(a) > w] d(a)", 0.5, lambda w: tangent(w, NOISE)),
    ("integral (a ~ normal(w, 0.2)) [cos(a) > 0.8] d(a)", 0.6, lambda w: cosine(mp.mpf(0.8), normal(w, mp.mpf(0.2)))),
    ("integral (a ~ normal(0.6, w)) [cos(a) > 0.8] d(a)", 0.2, lambda w: cosine(mp.mpf(0.8), normal(mp.mpf(0.6), w))),
    ("integral (a ~ normal(300, w)) [cos(a) > 0.8] d(a)", 0.4,
     lambda w: cosine(mp.mpf(0.8), normal(mp.mpf(300), w), 40, 56)),
    ("integral (a ~ normal(0, w)) [cos(a) > 0.8] d(a)", 30.0,
     lambda w: cosine(mp.mpf(0.8), normal(mp.mpf(0), w), -80, 80)),
    ("integral (a ~ exponential(w)) [cos(a) > 0.8] d(a)", 1.2,
     lambda w: cosine(mp.mpf(0.8), lambda a, b: mp.exp(-a*w) - mp.exp(-b*w), 0, 20, mp.mpf(0))),
    ("integral (a ~ laplace(0, w)) [cos(a) > 0.8] d(a)", 1.2,
     lambda w: 2*cosine(mp.mpf(0.8), lambda a, b: (mp.exp(-a/w) - mp.exp(-b/w))/2, 0, 30, mp.mpf(0))),
    ("integral [-inf, inf] exp(-a^2/2)*[cos(a) > w] d(a)", 0.8,
     lambda w: mp.sqrt(2*mp.pi)*cosine(w, normal(mp.mpf(0), mp.mpf(1)))),
    ("integral [0, inf] exp(-a)*[cos(a) > w] d(a)", 0.8,
     lambda w: cosine(w, lambda a, b: mp.exp(-a) - mp.exp(-b), 0, 20, mp.mpf(0))),
    ("integral [0, inf] [sin(a) < w]*exp(-a) d(a)", 0.5,  # all but a geometric series
     lambda w: 1 - (mp.exp(-mp.asin(w)) - mp.exp(mp.asin(w) - mp.pi))/(1 - mp.exp(-2*mp.pi))),
    ("integral [0, inf] [tan(a) < w]*exp(-a) d(a)", 0.5,
     lambda w: 1 - (mp.exp(-mp.atan(w)) - mp.exp(-mp.pi/2))/(1 - mp.exp(-mp.pi))),
    ("integral [0, inf] [cos(a^2) < w]*exp(-a) d(a)", 0.3,  # 70^2/(2 pi) periods matter
     lambda w: sum(mp.exp(-mp.sqrt(2*mp.pi*k + mp.acos(w))) - mp.exp(-mp.sqrt(2*mp.pi*(k + 1) - mp.acos(w)))
                   for k in range(1000))),
    ("lit(w, 0.2)", 0.8, lambda w: cosine(w, NOISE)),
    ("integral (a ~ normal(0.6, 0.2)) above(cos(a), w) d(a)", 0.8, lambda w: cosine(w, NOISE)),
    ("exp(integral (a ~ normal(0.6, 0.2)) (if [cos(a) > w] then 1 else 0) d(a))", 0.8,
     lambda w: mp.exp(cosine(w, NOISE))),
]  # fmt: skip
DEFINITIONS = """
def above(u, w) [u > w]
def lit(w, s) integral (a ~ normal(0.6, s)) [cos(a) > w] d(a)
"""


@pytest.mark.parametrize(("body", "at", "exact"), CASES, ids=[body for body, _, _ in CASES])
def test_the_periods_that_the_density_leaves(body: str, at: float, exact: Callable[[Any], Any]) -> None:
    f = potto.compile(f"{DEFINITIONS}def f(w)\n    {body}\n").f
    plain, dual = f(at), potto.deriv(f)((at, 1.0))
    with mp.workdps(40):
        value, slope = exact(mp.mpf(at)), mp.diff(exact, mp.mpf(at), h=mp.mpf("1e-12"))
    for found, error, truth in (
        (plain.value, plain.error, value), (dual.value, dual.error, value), (dual.tangent, dual.tangent_error, slope),
    ):  # fmt: skip
        assert abs(found - truth) <= error + 1e-14 * (1 + abs(truth)), (found, error, truth)
        assert error <= 1e-8
    assert plain.converged and dual.converged


TWO = [  # the other variable is uniform, or has noise as well
    ("(x ~ uniform(0, 1), a ~ normal(0.6, 0.2)) [cos(a) > w*x] d(x, a)", lambda a, w: min(mp.cos(a)/w, 1), 0),
    ("(a ~ normal(0.6, 0.2), x ~ uniform(0, 1)) [cos(a) > w*x] d(a, x)", lambda a, w: min(mp.cos(a)/w, 1), 0),
    ("(a ~ normal(0.6, 0.2), x ~ normal(0, 1)) [cos(a) > w*x] d(a, x)", lambda a, w: mp.ncdf(mp.cos(a)/w), None),
    ("(x ~ normal(0, 1), a ~ normal(0.6, 0.2)) [cos(a) > w*x] d(x, a)", lambda a, w: mp.ncdf(mp.cos(a)/w), None),
    ("(x ~ exponential(1), a ~ normal(0.6, 0.2)) [cos(a) > w*x] d(x, a)",
     lambda a, w: 1 - mp.exp(-max(mp.cos(a), 0)/w), None),
]  # fmt: skip


@pytest.mark.parametrize(("body", "inner", "clip"), TWO, ids=[body for body, _, _ in TWO])
def test_in_two_variables(body: str, inner: Callable[[Any, Any], Any], clip: Any) -> None:
    f = potto.compile(f"def f(w)\n    integral {body}\n").f

    def exact(w: Any) -> Any:
        kinks = [-mp.pi / 2, mp.pi / 2] + ([-mp.acos(w), mp.acos(w)] if clip == 0 else [])
        ends = sorted([mp.mpf(-3), mp.mpf(4), mp.mpf("0.6"), *kinks])
        return mp.quad(lambda a: max(inner(a, w), 0) * mp.npdf(a, mp.mpf(0.6), mp.mpf(0.2)), ends)

    found = potto.deriv(f)((0.8, 1.0))
    with mp.workdps(25):
        value, slope = exact(mp.mpf(0.8)), mp.diff(exact, mp.mpf(0.8), h=mp.mpf("1e-6"))  # to 1e-12
    assert abs(found.value - value) <= found.error + 1e-14 <= 1e-9
    assert abs(found.tangent - slope) <= found.tangent_error + 1e-11 <= 1e-8 and found.converged


ARM = """
def f(a, b, r)
    integral (x ~ normal(a, 0.1), y ~ normal(b, 0.2))
        [(cos(x) + cos(y) - 1)^2 + (sin(x) + sin(y) - 1)^2 < r^2] d(x, y)
"""


def reach(a: Any, b: Any, r: Any) -> Any:
    """The probability that an arm of two links, whose angles are normal, comes within r of (1, 1): that of the second
    angle, for each first one. What it has in other turns than the nearest is below 1e-41."""
    second = normal(b, mp.mpf(0.2))

    def sight(x: Any) -> tuple[Any, Any]:
        """Of the second angles that do: the cosine of how far they are from their middle at most, and their middle."""
        left = 1 - mp.cos(x), 1 - mp.sin(x)
        far = mp.hypot(*left)
        return (1 + far**2 - r**2) / (2 * far), mp.atan2(left[1], left[0])

    def inner(x: Any) -> Any:
        cosine, middle = sight(x)
        off = mp.acos(min(cosine, 1))
        return mp.npdf(x, a, mp.mpf(0.1)) * second(middle - off, middle + off)

    start, end = (mp.findroot(lambda x: sight(x)[0] - 1, near) for near in (-0.3, 0.3))
    return mp.quad(inner, [start, -0.1, 0, 0.1, 0.2, end])


def test_an_arm_with_noise_in_both_joints() -> None:
    """Both ranges are infinite, and the condition is periodic in both."""
    f, at = potto.compile(ARM).f, (0.1, 1.5, 0.3)
    found = potto.grad(f, ["a", "b", "r"])(*at)
    with mp.workdps(25):
        exact = tuple(map(mp.mpf, at))
        value = reach(*exact)
        slopes = [mp.diff(reach, exact, n, h=mp.mpf("1e-6")) for n in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]  # to 1e-12
    assert abs(found.value - value) <= found.error + 1e-15 <= 1e-10
    for slope, error, truth in zip(found.tangent, found.tangent_error, slopes, strict=True):
        assert abs(slope - truth) <= error + 1e-11 <= 1e-8
    assert found.converged and found.evals < 100_000


def test_bars_hold_where_the_ends_of_sections_are_not_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A piece all of whose nodes lie beyond the end of a section does not see it, but its neighbour does."""
    monkeypatch.setattr(box_search, "BOXES", 1)
    monkeypatch.setattr(box_search, "BOXES_EACH", 1)
    f = potto.compile(ARM).f
    with mp.workdps(20):
        exact = reach(mp.mpf(0.1), mp.mpf(1.5), mp.mpf(0.3))
    for rtol in (1e-4, 1e-6, 1e-8):
        with potto.settings(rtol=rtol):
            found = f(0.1, 1.5, 0.3)
        assert abs(found.value - exact) <= found.error < 1e-3
        assert found.converged == (found.error <= rtol * found.value)


@pytest.mark.parametrize(("half_line", "below"), [("[-inf, 0]", True), ("[0, inf]", False)])
def test_waves_over_half_a_plane(half_line: str, below: bool) -> None:
    """A density is told from nothing as far out as numbers go: the turns that it leaves are all that count."""
    f = potto.compile(f"def f(a) integral ([-inf, inf], {half_line}) exp(-x^2 - y^2)*[sin(5*x*y) + x < a] d(x, y)").f

    def half(y: Any) -> Any:
        """Of exp(-y^2), from the bound that is no infinity."""
        return mp.sqrt(mp.pi) / 2 * mp.erf(y)

    def inner(x: Any, a: Any) -> Any:
        """Where the sine is too large it is so from asin(c) to pi - asin(c), and in every turn."""
        c, every = a - x, mp.sqrt(mp.pi) / 2
        if abs(c) >= 1 or not x:
            return mp.exp(-(x**2)) * (every if c > 0 else 0)
        left_out = mp.mpf(0)
        turns = int(2 + 5 * abs(x) * 7 / (2 * mp.pi))  # exp(-7^2) is below 1e-21
        for k in range(-turns, turns + 1):
            ends = sorted((2 * mp.pi * k + u) / (5 * x) for u in (mp.asin(c), mp.pi - mp.asin(c)))
            low, high = (min(y, 0) if below else max(y, 0) for y in ends)
            left_out += half(high) - half(low)
        return mp.exp(-(x**2)) * (every - left_out)

    found = f(0.3)
    with mp.workdps(20):
        a = mp.mpf(0.3)
        exact = mp.quad(lambda x: inner(x, a), [-8, a - 1, -0.4, 0, a, 0.8, a + 1])
    assert abs(found.value - exact) <= found.error + 1e-13 <= 1e-9 and found.converged


def test_arrays_of_means_near_and_far() -> None:
    f = potto.compile("def f(m) integral (a ~ normal(m, 0.2)) [cos(a) > 0.8] d(a)").f
    means = np.array([-2.0, 0.0, 0.6, 3.0, 40.0, -500.0])
    found = f(means)
    for m, value, error in zip(means, found.value, found.error, strict=True):
        turn = round(m / (2 * math.pi))
        with mp.workdps(40):
            exact = cosine(mp.mpf(0.8), normal(mp.mpf(m), mp.mpf(0.2)), turn - 2, turn + 2)
        assert abs(value - exact) <= error + 1e-15 <= 1e-9


def test_what_no_density_cuts_off_stays_unknown() -> None:
    """A Cauchy density falls off so slowly that no place is far enough."""
    found = potto.compile("def f(w) integral (a ~ cauchy(0, 1)) [cos(a) > w] d(a)").f(0.8)
    assert not found.converged and found.error == math.inf and found.reasons
