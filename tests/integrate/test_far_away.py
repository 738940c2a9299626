"""Scenes far from the origin: what is a difference in the program is solved as one, and never multiplied out.

(x - 1e8)^2 + (y - 1e8)^2 - t^2 as a polynomial has the constant 2e16 - t^2, in which t is lost. Closed forms by mpmath,
for the doubles that the program has.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from polygons import area, in_square

import potto

FAR = (1e3, 1e5, 1e8, -1e8, 1e10)
EPS = 2.0**-52


def covered(answer: Any, value: Any, tangent: Any) -> None:
    with mp.workdps(50):
        assert abs(answer.value - value) <= answer.error + EPS * abs(value)
        assert abs(answer.tangent - tangent) <= answer.tangent_error + EPS * abs(tangent)


@pytest.mark.parametrize("far", FAR)
def test_the_radius_of_a_disc(far: float) -> None:
    box, o = f"[{far - 1!r}, {far + 1!r}]", f"({far!r})"
    f = potto.compile(f"def f(t)\n    integral ({box}, {box}) [(x - {o})^2 + (y - {o})^2 < t^2] d(x, y)").f
    answer = potto.deriv(f)((0.3, 1.0))
    covered(answer, mp.pi * mp.mpf(0.3) ** 2, 2 * mp.pi * mp.mpf(0.3))
    assert answer.error <= 3e-14 * abs(far) and answer.tangent_error <= 1e-13 * abs(far)


@pytest.mark.parametrize("far", FAR)
def test_a_disc_that_moves(far: float) -> None:
    """Weighted by (x - far)^2 it is pi/4 (d^2 + 1/16) for a disc of radius 1/2 at the distance d."""
    box, o = f"[{far - 1!r}, {far + 1!r}]", f"({far!r})"
    f = potto.compile(f"def f(t)\n    integral ({box}, {box}) [(x - t)^2 + (y - {o})^2 < 1/4]*(x - {o})^2 d(x, y)").f
    answer = potto.deriv(f)((far + 0.3, 1.0))
    with mp.workdps(50):
        d = mp.mpf(far + 0.3) - mp.mpf(far)
        covered(answer, mp.pi / 4 * (d**2 + mp.mpf(1) / 16), mp.pi / 2 * d)
    # Next to where the disc begins its sections move fast, and their speeds are rounded, which counts as well.
    assert answer.error <= 1e-14 * abs(far) and answer.tangent_error <= 1.5e-14 * abs(far)


def test_surfaces_that_only_differ_behind_the_last_digit_of_what_they_multiply_out_to() -> None:
    """1e16 - 0.25 and 1e16 - 0.36 are the same double; the two conditions are not the same surface."""
    f = potto.compile("""
def f(t)
    integral [99999999, 100000001] [(x - 1e8)^2 < t^2] + 10*[(x - 1e8)^2 < t^2 + 0.11] d(x)
""").f
    answer = potto.deriv(f)((0.5, 1.0))
    with mp.workdps(50):
        wide = mp.sqrt(mp.mpf(0.25) + mp.mpf(0.11))
        covered(answer, 1 + 20 * wide, 2 + 10 / wide)
    assert answer.error <= 1e-5


@pytest.mark.parametrize("far", [3e7, 1e8])
def test_a_stretch_that_is_written_multiplied_out_has_lost_its_length(far: float) -> None:
    """Nothing can be known of it: the error says so."""
    body = f"x^2 - {2 * far!r}*x + {far * far!r} - t^2 < 0"
    f = potto.compile(f"def f(t)\n    integral [{far - 1!r}, {far + 1!r}] [{body}] d(x)").f
    answer = potto.deriv(f)((0.3, 1.0))
    assert abs(answer.value - 2 * mp.mpf(0.3)) <= answer.error
    assert abs(answer.tangent - 2) <= answer.tangent_error
    assert not answer.converged and "rounding" in answer.reasons[0]


@pytest.mark.parametrize("order", ["x, y", "y, x"])
@pytest.mark.parametrize("first", ["normal(0, 1)", "uniform(0, 1)"])
def test_a_wave_over_infinite_ranges(first: str, order: str) -> None:
    """sin(u) <= s between pi - asin(s) and 2 pi + asin(s), and a period further: so often as u = x + y falls there."""
    other = "normal(0, 1)"
    measures = {"x": first, "y": other}
    drawn = ", ".join(f"{v} ~ {measures[v]}" for v in order.split(", "))
    f = potto.compile(f"def f(s) integral ({drawn}) [sin(x + y) <= s] d({order})").f
    answer = potto.deriv(f)((0.25, 1.0))

    def cdf(u: Any) -> Any:
        if first == other:
            return mp.ncdf(u / mp.sqrt(2))
        return (u * mp.ncdf(u) + mp.npdf(u)) - ((u - 1) * mp.ncdf(u - 1) + mp.npdf(u - 1))

    def share(s: Any) -> Any:
        a = mp.asin(s)
        return mp.fsum(cdf(2 * mp.pi * (k + 1) + a) - cdf(2 * mp.pi * k + mp.pi - a) for k in range(-8, 8))

    covered(answer, share(mp.mpf(0.25)), mp.diff(share, mp.mpf(0.25)))


def test_corners_that_rounding_misplaces_are_in_the_bound() -> None:
    """A triangle of an array, 100,000 from the origin: where its edges meet is found by differences of numbers of 1e10,
    so that the section bends 1e-5 beside its cut. Held to the triangle clipped in fractions."""
    corners = np.array([[0.54672171, 0.86204095], [0.66097723, 0.88411966], [0.66509467, 0.97001584]]) + 1e5
    x, y, h = 1e5 + 42 / 64, 1e5 + 62 / 64, 1 / 64
    module = potto.compile("""
def edge(a: (Real*, Real*), b: (Real*, Real*), x, y) (b.x - a.x)*(y - a.y) - (b.y - a.y)*(x - a.x)
def covered(ts: [n] ((Real, Real), (Real, Real), (Real, Real)), px, py, h) integral ([px, px + h], [py, py + h])
    [edge(ts[0].0, ts[0].1, x, y) >= 0 and edge(ts[0].1, ts[0].2, x, y) >= 0 and edge(ts[0].2, ts[0].0, x, y) >= 0]
    d(x, y)
""")
    triangle = [(Fraction(a), Fraction(b)) for a, b in corners.tolist()]
    exact = area(in_square(triangle, Fraction(x), Fraction(y), Fraction(h)))
    answer = module.covered(corners[None], x, y, h)
    assert abs(Fraction(answer.value) - exact) <= Fraction(answer.error) < Fraction(1, 10**7)


OVERFLOWS = {
    "exp(-x)*exp(x)": None,
    "exp(-x)*(exp(x) + t)": None,
    "exp(-x)*cosh(x/2)": 4 / 3,
    "exp(-x)*(exp(x)/(1 + x^2))": math.pi / 2,
}


@pytest.mark.parametrize("body", OVERFLOWS)
def test_what_overflows_far_out_is_nothing_only_where_its_logarithm_says_so(body: str) -> None:
    found = potto.compile(f"def f(t) integral [0, inf] {body} d(x)").f(1.0)
    wanted = OVERFLOWS[body]
    if wanted is None:
        assert not found.converged
        assert not math.isfinite(found.error)
    else:
        assert found.converged
        assert abs(found.value - wanted) <= found.error + 1e-15
