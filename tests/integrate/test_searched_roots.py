"""Conditions without a closed form in the variable that they cut: no root may be missed, however close to another.

The region below a wave, y < a*sin(w*x + p) + b*x + t in the unit square: between the wave's turning points, which are
known in closed form, it crosses 0 and 1 once at most, so that bisection by mpmath gives its area and how that grows.
"""

from __future__ import annotations

import itertools
import math
import random
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from scipy import special

import potto
from potto.calculus.solving.enclosable import slope_of
from potto.core.terms import add, const, mul, prim, sub, var
from potto.integrate.decomposition.root_isolation import Isolated, isolated, touched
from potto.integrate.events import BUDGET_SPENT, ROOTS_NOT_SEPARATED
from potto.integrate.rules.intervals import enclosure
from potto.kernels.cells import Cell

# a, w, p, b, t
KEPT = [
    (1.0, 100.0, 0.0, 0.3, 0.3),
    (1.0, 300.0, 0.0, 0.3, 0.3),
    (1.0, 700.0, 0.0, 0.3, 0.3),
    (0.4, 2000.0, 0.1, -0.2, 0.6),
    (1.0, 100.0, 0.0, 0.3, -1.0299),  # just above the bottom: tops that barely reach it, two roots close together
    (0.5, 3.0, 0.2, 0.0001, 0.2),
]


@mp.workdps(40)
def below(a: Any, w: Any, p: Any, b: Any, t: Any) -> tuple[Any, Any]:
    """The area of y < a*sin(w*x + p) + b*x + t in the unit square, and its derivative by t."""
    a, w, p, b, t = map(mp.mpf, (a, w, p, b, t))

    def wave(x: Any) -> Any:
        return a * mp.sin(w * x + p) + b * x + t

    def integral(x: Any) -> Any:
        return -a / w * mp.cos(w * x + p) + b * x * x / 2 + t * x

    cuts = [mp.mpf(0), mp.mpf(1)]
    if abs(b) < abs(a * w):
        turn = mp.acos(-b / (a * w))
        for k in range(int(w / (2 * mp.pi)) + 3):
            cuts += [x for x in ((turn + 2 * mp.pi * k - p) / w, (-turn + 2 * mp.pi * k - p) / w) if 0 < x < 1]
    cuts.sort()
    places = list(cuts)
    for low, high in itertools.pairwise(cuts):
        for level in (0, 1):
            if (wave(low) - level) * (wave(high) - level) < 0:
                places.append(mp.findroot(lambda x, level=level: wave(x) - level, (low, high), solver="anderson"))
    places.sort()
    area = rate = mp.mpf(0)
    for low, high in itertools.pairwise(places):
        middle = wave((low + high) / 2)
        if middle >= 1:
            area += high - low
        elif middle > 0:
            area += integral(high) - integral(low)
            rate += high - low
    return area, rate


def random_waves() -> list[tuple[float, ...]]:
    r = random.Random(20)
    return [
        (r.uniform(0.1, 2), 10 ** r.uniform(0, 2.7), r.uniform(-3, 3), r.uniform(-1, 1), r.uniform(-1, 1.5))
        for _ in range(40)
    ]


@pytest.mark.parametrize("order", ["x, y", "y, x"])
@pytest.mark.parametrize("wave", [*KEPT, *random_waves()], ids=str)
def test_every_root_of_a_wave_is_found(wave: tuple[float, ...], order: str) -> None:
    a, w, p, b, t = wave
    text = f"def f(t) integral ([0, 1], [0, 1]) [y < {a!r}*sin({w!r}*x + {p!r}) + {b!r}*x + t] d({order})"
    found = potto.grad(potto.compile(text).f, "t")(t=t)
    area, rate = below(*wave)
    for got, error, exact in ((found.value, found.error, area), (found.tangent, found.tangent_error, rate)):
        assert abs(got - exact) <= error, (got, error, exact)
        assert error <= 1e-8 * (abs(exact) + 1e-3)


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        # a peak 1e-5 wide in the section: (width where exp(-q^2) > h) has closed forms
        ("integral ([0, 1], [0, 1]) [y < exp(-((x - 0.4567)/1e-5)^2) - t] d(y, x)", None),
        ("integral ([0, 1], [0, 1]) [y < 1e-10/(1e-10 + (x - 0.4567)^2) - t] d(y, x)", "lorentz"),
    ],
)
def test_roots_on_a_narrow_peak_are_found(text: str, exact: str | None) -> None:
    t, s = mp.mpf(0.25), mp.mpf(1e-5)
    if exact is None:
        half = mp.sqrt(-mp.log(t))
        area = s * (mp.sqrt(mp.pi) * mp.erf(half) - 2 * half * t)
    else:
        half = mp.sqrt(1 / t - 1)
        area = mp.sqrt(mp.mpf(1e-10)) * (2 * mp.atan(half) - 2 * half * t)
    found = potto.grad(potto.compile(f"def f(t) {text}").f, "t")(t=0.25)
    assert abs(found.value - area) <= found.error
    assert abs(found.tangent + 2 * half * s) <= found.tangent_error + 1e-12 * s
    assert found.error <= 1e-8 * area


def test_an_enclosure_holds_what_its_term_takes() -> None:
    x, y = var("x"), var("y")
    terms = [
        prim("sin", mul(const(7.0), x)), prim("cos", prim("exp", x)), prim("tan", x), prim("pow", x, const(3.0)),
        prim("pow", x, const(-2.0)), prim("div", y, x), prim("mul", x, x, y), prim("hypot", x, y),
        prim("atan2", y, x), prim("abs", x), prim("max", x, y), prim("cosh", x), prim("erfc", x),
        prim("sqrt", prim("add", x, const(4.0))), prim("clamp", x, const(-0.3), const(0.4)),
    ]  # fmt: skip
    r = np.random.default_rng(3)
    low = r.uniform(-3, 3, (2, 400))
    high = low + 10 ** r.uniform(-6, 0.5, (2, 400))
    found = enclosure(tuple(terms), {"x": (low[0], high[0]), "y": (low[1], high[1])})
    at = low + (high - low) * r.uniform(0, 1, (60, 2, 400))
    px, py = at[:, 0], at[:, 1]
    with np.errstate(all="ignore"):
        values = [np.sin(7 * px), np.cos(np.exp(px)), np.tan(px), px**3, px**-2.0, py / px, px * px * py,
                  np.hypot(px, py), np.arctan2(py, px), np.abs(px), np.maximum(px, py), np.cosh(px), special.erfc(px),
                  np.sqrt(px + 4), np.clip(px, -0.3, 0.4)]  # fmt: skip
    for term, (lo, hi), value in zip(terms, found, values, strict=True):
        known = ~np.isnan(value)
        assert np.all((value >= lo) | ~known) and np.all((value <= hi) | ~known), term


def test_a_search_counts_for_the_budget_and_says_what_it_has_not_seen() -> None:
    """Some 300 roots take more cells than 10 evaluations stand for (64 each), and fewer than 1,000 do."""
    wave = potto.compile("def f(t) integral [0, 1] x*[cos(500*x) + cos(707*x) < t + x] d(x)").f
    with potto.settings(max_evals=10):
        found = wave(0.2)
    assert {BUDGET_SPENT.message, ROOTS_NOT_SEPARATED.message} <= set(found.reasons)
    assert not found.converged and math.isinf(found.error)
    with potto.settings(max_evals=1000):
        assert wave(0.2).converged


def test_roots_between_infinite_bounds_where_terms_of_the_surface_have_no_sum() -> None:
    """a^3 - a at infinity is not a number; the cubic a^3 - a = c has its three roots all the same."""
    a = var("a")
    surface = sub(prim("pow", a, const(3.0)), add(var("a"), var("c")))
    slope = slope_of(surface, "a")
    assert slope is not None
    c = np.array([0.225, -0.225, 0.405])
    found = isolated(surface, slope, "a", {"c": Cell(c)}, np.full(3, -np.inf), np.full(3, np.inf))
    assert found.complete
    for i, at in enumerate(c):
        roots = sorted(x.real for x in np.roots([1.0, 0.0, -1.0, -at]) if abs(x.imag) < 1e-12)
        cells = sorted(zip(found.a[found.owner == i], found.b[found.owner == i], strict=True))
        assert len(cells) == len(roots)
        assert all(a <= root <= b for (a, b), root in zip(cells, roots, strict=True))


def test_roots_that_were_found_in_an_evaluation_are_not_searched_again() -> None:
    """Unless something of what is asked is another number: of x^3 - x = c those in [-2, 2], then in [0, 2]."""
    x = var("x")
    surface = sub(prim("pow", x, const(3.0)), add(x, var("c")))
    slope = slope_of(surface, "x")
    assert slope is not None
    known, looked = Isolated(), []

    def roots(c: float, low: float) -> int:
        looked.clear()
        within = lambda cells: not looked.append(cells)  # noqa: E731
        bounds = np.array([low]), np.array([2.0])
        return int(isolated(surface, slope, "x", {"c": Cell(c)}, *bounds, within=within, known=known).owner.size)

    assert roots(0.225, -2.0) == 3 and looked
    assert roots(0.225, -2.0) == 3 and not looked
    assert roots(0.225, 0.0) == 1 and looked
    assert roots(0.5, -2.0) == 1 and looked
    assert roots(0.225, 0.0) == 1 and not looked


def test_a_search_that_the_budget_has_ended_is_not_taken_for_one_that_was_made() -> None:
    x, known = var("x"), Isolated()
    surface, slope = sub(prim("sin", x), var("c")), prim("cos", x)
    for ended in (True, False):
        found = isolated(surface, slope, "x", {"c": Cell(0.5)}, np.array([0.0]), np.array([100.0]),
                         within=lambda cells, ended=ended: not ended, known=known)  # fmt: skip
        assert found.complete != ended


@pytest.mark.parametrize(
    "integrand, at",
    [("[tan(x) < t]/(1 + x^2)", 0.5), ("[sin(x) < t]/(1 + x^2)", 0.5), ("[cos(x^2) < t]/(1 + x)^2", 0.3)],
)
def test_roots_without_end_leave_nothing_to_vouch_for(integrand: str, at: float) -> None:
    """They can't all be cut at: what the pieces add up to is told with no digit, and why."""
    found = potto.deriv(potto.compile(f"def f(t) integral [0, inf] {integrand} d(x)").f)((at, 1.0))
    assert not found.converged and found.error == found.tangent_error == math.inf
    assert any("too many roots" in reason for reason in found.reasons)


# Surfaces that are 0 to rounding over a stretch: what they may do there is part of the error. Values by antisymmetry.


@pytest.mark.parametrize(
    ("program", "value", "slope"),
    [
        # x - sin(x) has a triple root at 0: within 1e-8 of it nothing is known. int_0^2 (x + t), t = 1/2
        ("integral [-2, 2] [x > sin(x)]*(x + t) d(x)", 3.0, 2.0),
        # it touches 0 there, and is nowhere below
        ("integral [-2, 2] [exp(x) - 1 - x < 0]*(x + t) d(x)", 0.0, 0.0),
        ("integral [-2, 2] [exp(x) - 1 - x >= 0]*(x + t) d(x)", 2.0, 4.0),
    ],
)
def test_where_rounding_hides_a_root(program: str, value: float, slope: float) -> None:
    answer = potto.deriv(potto.compile(f"def f(t) {program}").f)((0.5, 1.0))
    assert abs(answer.value - value) <= answer.error < 1e-6
    assert abs(answer.tangent - slope) <= answer.tangent_error < 1e-6


def test_a_kink_where_rounding_hides_it_is_none() -> None:
    answer = potto.compile("def f(t) integral [0, 2] max(sin(x), x)*t d(x)").f(0.5)
    assert answer.converged and abs(answer.value - 1.0) <= answer.error < 1e-12


def test_powers_of_negative_numbers_have_no_roots() -> None:
    """Kinks of the clamp would be at powers of -0.4, which are none: int_0^1 3^cos(y) d(y) by mpmath."""
    answer = potto.compile("def f(t) integral [0, 1] clamp((2 + t)^cos(y), -0.4, 9) d(y)").f(1.0)
    exact = mp.quad(lambda y: 3 ** mp.cos(y), [0, 1])
    assert answer.converged and abs(answer.value - exact) <= answer.error
    assert answer.evals < 200


@pytest.mark.parametrize("seed", range(50))
def test_stretches_that_touch_others_are_known(seed: int) -> None:
    """As by looking at each of the others; on a grid, so that many only meet at their ends."""
    rng = np.random.default_rng(seed)

    def stretches(count: int) -> tuple[Any, Any, Any]:
        start = rng.integers(0, 60, count) / 64
        return rng.integers(0, 4, count), start, start + rng.integers(0, 5, count) / 64

    some, others = stretches(12), stretches(seed)
    one_by_one = [((others[0] == o) & (others[2] >= a) & (others[1] <= b)).any() for o, a, b in zip(*some)]
    assert list(touched(some, others)) == one_by_one


@pytest.mark.parametrize("at", [0.5, 0.25, 0.75, 0.3])
def test_a_pole_where_cells_are_halved_hides_no_root(at: float) -> None:
    """On it no enclosure says anything. On each side of it the condition holds from one root on (mpmath)."""

    def beyond(x: Any) -> Any:
        return mp.mpf(1) / 10 / abs(x - at) + mp.sin(3 * x)

    s = mp.mpf("1.25")
    ends = [mp.findroot(lambda x: beyond(x) - s, e, solver="anderson") for e in ((0, at - 1e-3), (at + 1e-3, 1))]
    rate = sum(1 / abs(mp.diff(beyond, x)) for x in ends)
    f = potto.compile(f"def f(s) integral [0, 1] [0.1/abs(x - {at}) + sin(3*x) > s] d(x)").f
    answer = potto.deriv(f)((1.25, 1.0))
    assert answer.converged
    assert abs(answer.value - (ends[1] - ends[0])) <= answer.error <= 1e-13
    assert abs(answer.tangent + rate) <= answer.tangent_error + 1e-15 <= 1e-13  # the rate is of some roundings


CUBIC, MONOTONE, GROWING = (
    ("x^3 - x", lambda x, t: x**3 - x - t, ((-2, "-0.5"), ("-0.5", "0.5"), ("0.5", 2))),
    ("x^3 + x", lambda x, t: x**3 + x - t, ((-1, 1),)),
    ("x + exp(4*x)", lambda x, t: x + mp.exp(4 * x) - t, ((-1, 0),)),
)


@pytest.mark.parametrize("surface", (CUBIC, MONOTONE, GROWING), ids=lambda surface: surface[0])
@pytest.mark.parametrize(
    ("integral", "whole", "density"),
    (
        ("integral [-300, 300] BRACKET d(x)", lambda x: x + 300, lambda x: 1),
        ("integral [-1e31, 1e31] BRACKET d(x)", lambda x: x + mp.mpf(1e31), lambda x: 1),
        ("integral [-inf, inf] 1/(1 + x^2)*BRACKET d(x)", lambda x: mp.atan(x) + mp.pi / 2, lambda x: 1 / (1 + x**2)),
        ("integral (x ~ cauchy(0, 2)) BRACKET d(x)", lambda x: mp.atan(x / 2) / mp.pi + mp.mpf(1) / 2,
         lambda x: 2 / (4 + x**2) / mp.pi),
    ),
)  # fmt: skip
def test_roots_on_a_range_that_reaches_where_numbers_end(
    surface: tuple[str, Any, Any], integral: str, whole: Any, density: Any
) -> None:
    """At the far ends the surface is more than numbers can hold, and most of the range is beyond all roots."""
    text, psi, brackets = surface
    t = mp.mpf(0.1)
    f = potto.compile(f"def f(t)\n    {integral.replace('BRACKET', f'[{text} < t]')}").f
    roots = [mp.findroot(lambda x: psi(x, t), tuple(map(mp.mpf, pair)), solver="anderson") for pair in brackets]
    value = sum((-1) ** k * whole(root) for k, root in enumerate(roots))
    slope = sum(density(root) / abs(mp.diff(lambda x: psi(x, t), root)) for root in roots)
    answer = potto.deriv(f)((0.1, 1.0))
    assert answer.converged
    assert abs(answer.value - value) <= answer.error + 1e-15 * value
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-15 * slope
    assert answer.error <= 1e-11 * value and answer.tangent_error <= 1e-11 * slope
