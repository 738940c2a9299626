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
