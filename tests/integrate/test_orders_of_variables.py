"""Which variable stands where makes no difference to the answer, and little to what it takes."""

from __future__ import annotations

import math

import numpy as np
import pytest

import potto

PI = math.pi
BOX = "([-2, 2], [-2, 2], [-2, 2])"


def balls(axis: str, joint: str) -> potto.Function:
    """The unit ball and one that is moved by t along an axis."""
    moved = " + ".join(f"({v} - t)^2" if v == axis else f"{v}^2" for v in "xyz")
    return potto.compile(f"def f(t) integral {BOX} [x^2 + y^2 + z^2 < 1 {joint} {moved} < 1] d(x, y, z)").f


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::potto.ProgramWarning")
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_balls_that_part_along_any_axis(axis: str) -> None:
    """A lens of height 2 - t, by caps; at t = 0 it has a kink, and one side of it is the answer."""
    f = potto.deriv(balls(axis, "and"))
    for t, value, slope in ((0.0, 4 * PI / 3, PI), (0.5, PI * (4 / 3 - 0.5 + 0.125 / 12), PI * (1 - 0.25 / 4))):
        answer = f((t, 1.0))
        assert abs(answer.value - value) <= answer.error + 1e-15 and answer.error <= 1e-9
        assert abs(abs(answer.tangent) - slope) <= answer.tangent_error + 1e-14 and answer.tangent_error <= 1e-9


def test_orders_cost_about_the_same() -> None:
    """Five times at most: a trial of each of two orders, and the better one once more."""
    body = "[x < t*(1 + 0.3*sin(3*y))]*exp(x*y)"
    evals = []
    for order in ("x, y", "y, x"):
        f = potto.deriv(potto.compile(f"def f(t) integral ([0, 1], [0, 1]) {body} d({order})").f)
        evals.append(f((0.6, 1.0)).evals)
    assert max(evals) <= 5 * min(evals)


@pytest.mark.slow
@pytest.mark.parametrize("rtol", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
def test_bars_hold_beside_logarithms(rtol: float) -> None:
    """The states below an energy in three dimensions: at both ends of a stretch of x the integral over the others is
    like q^3 log q, whose coefficients change sign where they stop to fall geometrically.

    The value by mpmath, as in the catalogue.
    """
    f = potto.compile(
        "def f(t) integral ([-pi, pi], [-pi, pi], [-pi, pi]) [cos(x) + cos(y) + cos(z) < t] d(x, y, z)").f  # fmt: skip
    with potto.settings(rtol=rtol):
        answer = f(0.5)
    assert abs(answer.value - 159.45534894006439248) <= answer.error + 1e-13
    assert answer.error <= max(rtol, 1e-9) * 160
    assert np.isfinite(answer.error)


TORI = ("(sqrt(x^2 + y^2) - R)^2 + z^2 < r^2", "(x^2 + y^2 + z^2 + R^2 - r^2)^2 < 4*R^2*(x^2 + y^2)")


@pytest.mark.parametrize("surface", TORI, ids=["by roots", "quartic"])
def test_a_torus_is_cut_across_its_axis(surface: str) -> None:
    """Its volume is 2 pi^2 R r^2 (Pappus). Along x it has saddles, at which the area of a section grows like a
    logarithm; along z it has none. With x outermost it takes 600,000 evaluations, and six million with a derivative."""
    f = potto.compile(f"def f(R, r) integral {BOX} [{surface}] d(x, y, z)").f
    R, r = 1.1, 0.35
    value, *slopes = f(R, r), potto.deriv(f)((R, 1.0), (r, 0.0)), potto.deriv(f)((R, 0.0), (r, 1.0))
    assert abs(value.value - 2 * PI**2 * R * r**2) <= value.error <= 1e-9
    for answer, slope in zip(slopes, (2 * PI**2 * r**2, 4 * PI**2 * R * r), strict=True):
        assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-15 <= 1e-8
    assert all(answer.converged and answer.evals <= 250_000 for answer in (value, *slopes))


def test_a_ball_that_a_saddle_cuts_costs_the_same_along_any_axis() -> None:
    """By symmetry half of it is above z = x*y."""
    for order in ("x, y, z", "z, y, x"):
        f = potto.deriv(potto.compile(f"def f(t) integral {BOX} [x^2 + y^2 + z^2 < t]*[z > x*y] d({order})").f)
        answer, half = f((0.8, 1.0)), 2 * PI / 3 * 0.8**1.5
        assert abs(answer.value - half) <= answer.error <= 1e-10
        assert abs(answer.tangent - PI * 0.8**0.5) <= answer.tangent_error <= 1e-10
        assert answer.evals <= 100_000  # with z outermost, 800,000


def test_orders_are_compared_where_a_bound_moves() -> None:
    """Along z roots are searched for, along x and y none are. Below x + y = w <= 1 lies w^2/2 of the unit square."""
    f = potto.deriv(potto.compile("def f(t) integral ([0, 1], [0, 1], [0, t]) [z^5 + z < x + y] d(x, y, z)").f)
    t = 0.5
    answer = f((t, 1.0))
    assert abs(answer.value - (t - (t**11 / 11 + 2 * t**7 / 7 + t**3 / 3) / 2)) <= answer.error <= 1e-12
    assert abs(answer.tangent - (1 - (t**5 + t) ** 2 / 2)) <= answer.tangent_error <= 1e-12


def test_a_torus_is_filled_up_to_a_bound_that_moves() -> None:
    """At height z its section is a ring between R - w and R + w, w^2 = r^2 - z^2: 4 pi R w. Here R = 1, r = 0.3."""
    ring = "(sqrt(x^2 + y^2) - 1)^2 + z^2 < 0.09"
    f = potto.deriv(potto.compile(f"def f(t) integral ([-2, 2], [-2, 2], [-1, t]) [{ring}] d(x, y, z)").f)
    r, t = 0.3, 0.1
    w, answer = math.sqrt(r**2 - t**2), f((t, 1.0))
    filled = 2 * PI * (t * w + r**2 * (math.asin(t / r) + PI / 2))
    assert abs(answer.value - filled) <= answer.error <= 1e-9
    assert abs(answer.tangent - 4 * PI * w) <= answer.tangent_error <= 1e-9


def test_no_order_goes_on_long_before_others_are_tried() -> None:
    """Along x and y the section at z has the area s - s log s, s = t - z, and a long tail besides: with z outermost
    that takes 100,000 evaluations, with x outermost 36. What came to an end is tried first the next time."""
    f = potto.deriv(potto.compile("def f(t) integral ([0, 1], [0, 1], [0, 1]) [x*y + z < t] d(z, x, y)").f)
    for t, most in ((0.8, 10_000), (0.7, 1_000)):
        answer = f((t, 1.0))
        assert abs(answer.value - t**2 * (3 - 2 * math.log(t)) / 4) <= answer.error <= 1e-13
        assert abs(answer.tangent - t * (1 - math.log(t))) <= answer.tangent_error <= 1e-13
        assert answer.evals <= most


def test_a_hyperboloid_is_cut_across_its_axis() -> None:
    """Along another variable its sections have saddles. By hand: circles of radius sqrt(z^2 + t)."""
    f = potto.deriv(potto.compile(
        "def f(t) integral ([-2, 2], [-2, 2], [-1, 1]) [x^2 + y^2 - z^2 < t] d(x, y, z)").f)  # fmt: skip
    answer = f((0.25, 1.0))
    assert abs(answer.value - PI * (2 / 3 + 0.5)) <= answer.error <= 1e-10
    assert abs(answer.tangent - 2 * PI) <= answer.tangent_error <= 1e-10
    assert answer.evals <= 50_000
