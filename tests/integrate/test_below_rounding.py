"""What doubles cannot tell apart: surfaces closer together than their rounding, and answers that are all rounding.

The error covers what lies between. An answer without digits is not called accurate, unless it is 0 to one rounding of
what the domain could hold; that goes for any scale.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import mpmath as mp
import numpy as np
import pytest

import potto


@pytest.mark.parametrize("width", [1e-12, 1e-15, 1e-16, 1e-18, 1e-25])
@pytest.mark.parametrize("body", ["[x < t + {w}]*[x > t]*exp(x)", "([x < t + {w}] - [x < t])*exp(x)"])
def test_the_strip_between_two_surfaces(body: str, width: float) -> None:
    f = potto.compile(f"def f(t)\n    integral [0, 1] {body.format(w=repr(width))} d(x)").f
    answer = potto.deriv(f)((0.3, 1.0))
    with mp.workdps(50):
        exact = mp.exp(mp.mpf(0.3) + mp.mpf(width)) - mp.exp(mp.mpf(0.3))
        assert abs(answer.value - exact) <= answer.error <= 1e-16
        assert abs(answer.tangent - exact) <= answer.tangent_error <= 1e-15
    assert not answer.converged and answer.reasons


@pytest.mark.parametrize("width", [1e-15, 1e-18])
def test_the_strip_between_two_lines(width: float) -> None:
    strip = f"[x + y < t + {width!r}] - [x + y < t]"
    f = potto.compile(f"def f(t)\n    integral ([0, 1], [0, 1]) ({strip})*exp(x) d(x, y)").f
    answer = f(0.3)
    with mp.workdps(50):
        exact = mp.quad(lambda x: mp.exp(x) * mp.mpf(width), [0, 0.3])
        assert abs(answer.value - exact) <= answer.error <= 1e-16
    assert not answer.converged


@pytest.mark.parametrize("many", [1, 3, 40, 300])
@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_a_slope_that_rounding_makes_0(many: int, backend: Literal["numpy", "native"]) -> None:
    """1 + 2^-53 - 1 is 0 in doubles: the root of 2^-53 x - 2^-54 is at 1/2, and nowhere to rounding."""
    f = potto.compile("def f(a, b, c, p)\n    integral [-1, 1] [(a + b - c)*x + (p - 1/2) > 0] d(x)").f
    here = np.arange(many) == many // 2
    with potto.settings(backend=backend):
        answer = f(1.0, np.where(here, 2.0**-53, 0.25), 1.0, np.where(here, 0.5 - 2.0**-54, 0.6))
    truth = np.where(here, 0.5, 1.4)
    assert (np.abs(answer.value - truth) <= answer.error).all()
    assert (answer.error[~here] <= 1e-13).all()


# Integrands of which rounding leaves nothing, and their integrals over [0, 1] and under an exponential density.
NOTHING_LEFT: dict[str, Callable[[mp.mpf], mp.mpf]] = {
    "(1 - cos(1e-8*x*t))*1e16": lambda x: (1 - mp.cos(mp.mpf(1e-8) * x)) * mp.mpf(1e16),
    "(x*t + 1e16) - 1e16": lambda x: x,
    "sqrt(x^2*t + 1e16) - 1e8": lambda x: mp.sqrt(x**2 + mp.mpf(1e16)) - 1e8,
    "((x*t + 1e12)^2 - 1e24 - 2e12*x*t)*cos(30*x)": lambda x: (
        ((x + mp.mpf(1e12)) ** 2 - mp.mpf(1e24) - 2 * mp.mpf(1e12) * x) * mp.cos(30 * x)
    ),
    "(exp(1e-17*x*t) - 1)*1e17": lambda x: mp.expm1(mp.mpf(1e-17) * x) * mp.mpf(1e17),
}


@pytest.mark.parametrize("body", NOTHING_LEFT)
@pytest.mark.parametrize("over", ["x in [0, 1]", "x ~ exponential(1)", "x in [0, 1], y in [0, 2]"])
def test_an_integrand_that_is_all_rounding(body: str, over: str) -> None:
    ranges = {"x in [0, 1]": "[0, 1]", "x ~ exponential(1)": "(x ~ exponential(1))"}.get(over, "([0, 1], [0, 2])")
    many = over.endswith("[0, 2]")
    inside, names = (f"({body})*(1 + y)", "x, y") if many else (body, "x")
    answer = potto.compile(f"def f(t) integral {ranges} {inside} d({names})").f(1.0)
    with mp.workdps(60):
        if "~" in over:
            exact = mp.quad(lambda x: NOTHING_LEFT[body](x) * mp.exp(-x), [*range(41), mp.inf])
        else:
            exact = mp.quad(NOTHING_LEFT[body], mp.linspace(0, 1, 11)) * (4 if many else 1)
        assert abs(answer.value - exact) <= answer.error < math.inf
    assert not answer.converged and answer.reasons


@pytest.mark.parametrize("body", ["sin(x)^2 + cos(x)^2 - t", "exp(x)*exp(-x) - t"])
@pytest.mark.parametrize("over", ["[0, 1]", "(x ~ normal(0, 1))"])
def test_an_identity_leaves_its_rounding(body: str, over: str) -> None:
    """The value is 0 and the slope -1, with all digits that there are: 20 units of what is subtracted."""
    answer = potto.grad(potto.compile(f"def f(t) integral {over} {body} d(x)").f)(1.0)
    assert abs(answer.value) <= answer.error <= 20 * 2.0**-52
    assert abs(answer.tangent + 1) <= answer.tangent_error <= 1e-11


@pytest.mark.parametrize("backend", ["numpy", "native"])
@pytest.mark.parametrize("over", ["[0, 1]", "([0, 1], [0, 2])"])
@pytest.mark.parametrize("body", NOTHING_LEFT)
def test_many_integrands_that_are_all_rounding(body: str, over: str, backend: Literal["numpy", "native"]) -> None:
    names, area = ("x, y", 2) if "," in over[4:] else ("x", 1)
    f = potto.compile(f"def f(t) integral {over} {body} d({names})").f
    with potto.settings(backend=backend), mp.workdps(60):
        answer = f(np.ones(300))
        exact = float(area * mp.quad(NOTHING_LEFT[body], mp.linspace(0, 1, 11)))
    assert (np.abs(answer.value - exact) <= answer.error).all() and np.isfinite(answer.error).all()


@pytest.mark.parametrize("backend", ["numpy", "native"])
@pytest.mark.parametrize("many", [1, 3, 300])
def test_rounding_within_where_the_ends_have_none(many: int, backend: Literal["numpy", "native"]) -> None:
    """x + 1e7 is exact at 0 and at 1, and so is 1e7 exp(0) - 1e7; between them seven digits are lost."""
    f = potto.compile("def f(t) integral [0, 1] exp(-(x - 1e8*t + 1e8)^2) d(x)").f
    g = potto.compile("def g(t) integral [0, 1] exp(x*t*1e-7)*1e7 - 1e7 d(x)").g
    with mp.workdps(40):
        small = mp.mpf(1e-7)
        exact_f, exact_g = mp.sqrt(mp.pi) / 2 * mp.erf(1), mp.mpf(1e7) * (mp.expm1(small) / small - 1)
        slope_f, slope_g = mp.mpf(1e8) * (1 - mp.exp(-1)), mp.mpf(1e7) * (mp.exp(small) - mp.expm1(small) / small)
    for function, exact, slope in ((f, exact_f, slope_f), (g, exact_g, slope_g)):
        with potto.settings(backend=backend):
            answer = potto.grad(function)(np.ones(many))
        assert (np.abs(answer.value - float(exact)) <= answer.error).all() and answer.error.max() < 1e-6
        assert (np.abs(answer.tangent - float(slope)) <= answer.tangent_error).all()
        assert (answer.tangent_error <= 1e-7 * abs(slope)).all()


def test_a_slope_that_is_0_is_no_doubt() -> None:
    f = potto.compile("def f(a, b) integral [-1, 1] [a*x + b > 0] d(x)").f
    for b, length in ((1e-300, 2.0), (-1e-300, 0.0), (0.25, 2.0)):
        answer = f(0.0, b)
        assert answer.value == length and answer.error <= 2e-15 and answer.converged


def test_a_surface_that_rounding_puts_on_the_bound() -> None:
    """t + 1e-18 is the bound to rounding; what lies between is 1e-18 wide, and 10 high."""
    f = potto.compile("def f(t)\n    integral [0.3, 1] 10*[x < t + 1e-18] d(x)").f
    answer = f(0.3)
    assert abs(answer.value - mp.mpf("1e-17")) <= answer.error <= 1e-15


@pytest.mark.parametrize("scale", [1.0, 1e-30, 1e-200, 1e30])
def test_accurate_is_what_has_digits_at_any_scale(scale: float) -> None:
    """The corner above x + y = 2 - 1e-15, of a few units in the last place in each direction, is 0 in the square."""
    f = potto.compile(f"def f(t)\n    integral ([0, 1], [0, 1]) {scale!r}*[x + y > t] d(x, y)").f
    answer = f(2 - 1e-15)
    exact = (2 - mp.mpf(2 - 1e-15)) ** 2 / 2 * mp.mpf(scale)
    assert abs(answer.value - exact) <= answer.error <= 1e-29 * scale and answer.converged
    odd = potto.compile(f"def f(t)\n    integral [-1, 1] {scale!r}*t*x^3*cos(x) d(x)").f(1.0)
    assert abs(odd.value) <= odd.error and odd.converged  # 0 by cancellation: that is all that can be known of it


def test_a_stretch_whose_side_is_rounding() -> None:
    """Between 0 and 1e-17, ends that move at -1/2 and 2, |x - 1/4| < 1/4 is a matter of rounding, and so is 4 or 0."""
    inside, far = "[abs(x - 1/4) < 1/4 + t/2]", "[x >= 1e-17 + 2*t]*[x < 1e-8 - t]"
    f = potto.compile(f"def f(t)\n    integral [-1, 1] ({far} - 2*{inside})^2 d(x)").f
    found = potto.deriv(f)((0.0, 1.0))
    exact = 4 * (0.5 + 0.5) + (1 - 4) * (-1 - 2)  # 4 inside of the one, 1 where both are
    assert abs(found.tangent - exact) <= found.tangent_error and not found.converged


PIXELS = [  # where its corner is, by how much the line passes that, whether the answer is as good as asked for
    (0.0, 1e-3, True),
    (0.9, 1e-3, True),
    (0.9, 1e-16, True),  # 0, to one rounding of what the pixel could hold
    (0.9, -1e-16, True),
    (0.9, 1e-12, False),  # 4 digits
    (1e4, 1e-11, False),  # the same a little further from the origin is no more 0 than that
]


@pytest.mark.parametrize(("at", "beyond", "converged"), PIXELS)
@pytest.mark.parametrize("scale", [1.0, 1e-30, 1e30])
def test_what_a_line_cuts_off_a_pixel(at: float, beyond: float, converged: bool, scale: float) -> None:
    body = f"integral ([{at!r}, {at + 0.01!r}], [{at!r}, {at + 0.01!r}]) {scale!r}*[x + y < c] d(x, y)"
    level = 2 * at + beyond
    found = potto.compile(f"def f(c)\n    {body}").f(level)
    with mp.workdps(50):
        exact = mp.mpf(scale) * max(mp.mpf(level) - 2 * mp.mpf(at), 0) ** 2 / 2
        assert abs(found.value - exact) <= found.error
    assert found.converged == converged, found.summary()


@pytest.mark.parametrize("scale", [1.0, 1e-30, 1e3])
@pytest.mark.parametrize(("at", "body"), [(0.7, "x*0.3 + y"), (0.3, "x*0.3 + y"), (0.123, "1.1*x + 0.7*y")])
def test_what_a_line_sweeps_over_at_a_corner_that_it_touches(at: float, body: str, scale: float) -> None:
    """It passes the corner by a unit in the last place: what it sweeps over is 0 beside the 0.01 that it could."""
    square = f"[{at!r}, {at + 0.01!r}]"
    f = potto.compile(f"def f(c)\n    integral ({square}, {square}) {scale!r}*[{body} < c] d(x, y)").f
    p, q = (0.3, 1.0) if "0.3" in body else (1.1, 0.7)
    level = p * at + q * at + 1e-16
    found = potto.deriv(f)((level, 1.0))
    with mp.workdps(50):
        length = (mp.mpf(level) - mp.mpf(p) * mp.mpf(at) - mp.mpf(q) * mp.mpf(at)) / mp.mpf(p) / mp.mpf(q)
    # 2^-50: what the rounding of the level itself moves, as for pixels at corners
    assert abs(found.tangent - scale * length) <= found.tangent_error + scale * 2.0**-50
    assert found.converged, found.reasons
    assert not potto.deriv(f)((level + 1e-9, 1.0)).converged  # that is no zero any more, and has few digits


def test_the_rounding_of_a_density_beside_a_turning_place_counts() -> None:
    """lgamma(500) is 2,604, so that the density of beta(200, 300) has 13 digits; at x = 0 it ends like x^199.

    The chance of less than 0.4 by the regularized incomplete beta function at 40 digits.
    """
    f = potto.compile("def f(a, b, t) integral (x ~ beta(a, b)) [x < t] d(x)").f
    with mp.workdps(40):
        exact = mp.betainc(200, 300, 0, mp.mpf(0.4), regularized=True)
    for moving in (["t"], ["a", "t"], ["a", "b", "t"]):
        found = potto.grad(f, wrt=moving)(200.0, 300.0, 0.4)
        assert abs(found.value - exact) <= found.error <= 1e-11


def test_what_vanishes_at_both_ends_has_its_rounding_from_within() -> None:
    """What x (1 - x) sin(1e8 t + x) loses to the rounding of 1e8 t was 1.2e-10 with an error of 3e-16: at both ends it
    is 0, and nothing can be a part of that. Expected values by mpmath in 50 digits."""
    program = "def f(t) integral [0, 1] x*(1 - x)*sin(1e8*t + x)*[x < 2*t] d(x)"
    places = np.linspace(0.5, 0.6, 12)
    found = potto.compile(program).f(places)
    with mp.workdps(50):
        whole = [mp.quad(lambda x, t=t: x * (1 - x) * mp.sin(10**8 * mp.mpf(t) + x), [0, 1]) for t in places]
        off = [abs(mp.mpf(v) - exact) for v, exact in zip(found.value, whole, strict=True)]
    assert all(float(x) <= bar for x, bar in zip(off, found.error, strict=True)), off
    assert max(off) > 1e-11 and found.error.max() < 1e-8


@pytest.mark.parametrize("s", [0.8, 0.6])
def test_at_an_optimum_where_the_integrand_vanishes_on_the_edge(s: float) -> None:
    """Within the ellipse of half axes s and s/sqrt(2) the integral of x^2 + 2 y^2 - s^2 is closed, its derivatives by
    both are 0. What is left of the integrand on the edge is rounding: the error was 0.14."""
    inside = "[(x/a)^2 + (y/b)^2 < 1]"
    f = potto.compile(f"def f(a, b, c) integral ([-1, 1], [-1, 1]) {inside}*(x^2 + 2*y^2 - c) d(x, y)").f
    found = potto.grad(f, ["a", "b"])(s, s / math.sqrt(2), 1 - (1 - s * s))
    assert abs(found.value + math.pi * s**4 / math.sqrt(8)) <= 1e-15 and found.error <= 1e-11
    assert all(abs(t) <= bar <= 1e-14 for t, bar in zip(found.tangent, found.tangent_error, strict=True))
    assert found.converged
