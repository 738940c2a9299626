"""Surfaces that run along the variables further in, exactly or up to rounding: what crosses them is integrated.

Turned by a, a rectangle's sides x = 0.5 and y = 0.6 move by -y and x: the derivative of the integral of exp(x*y) over
it, within the unit square, is the integral of x*exp(0.6*x) over [0, 0.5] less that of y*exp(0.5*y) over [0, 0.6].
"""

from __future__ import annotations

import math

import mpmath as mp
import pytest

import potto

TURNED = "[x*cos(a) + y*sin(a) < 0.5]*[y*cos(a) - x*sin(a) < 0.6]"
NEARLY = (0.0, 6e-17, -1.3e-16, 3e-16)  # cos(pi/2) is 6e-17


def first_moment(c: float, b: float) -> mp.mpf:
    """The integral of u*exp(c*u) over [0, b]."""
    return (mp.exp(c * mp.mpf(b)) * (c * mp.mpf(b) - 1) + 1) / mp.mpf(c) ** 2


SLOPE = float(first_moment(0.6, 0.5) - first_moment(0.5, 0.6))


def close(program: str, a: float, slope: float, evals: int) -> None:
    answer = potto.deriv(potto.compile(program).f)((a, 1.0))
    assert abs(answer.tangent - slope) <= answer.tangent_error + 10 * abs(a)  # the second derivative is at most 10
    assert answer.tangent_error <= 1e-11 and answer.converged and answer.evals <= evals


@pytest.mark.parametrize("a", NEARLY)
def test_a_rectangle(a: float) -> None:
    close(f"def f(a) integral ([0, 1], [0, 1]) {TURNED}*exp(x*y) d(x, y)", a, SLOPE, 1_000)


@pytest.mark.parametrize("a", NEARLY)
@pytest.mark.parametrize("order", ["x, y, z", "z, x, y", "x, z, y"])
def test_a_box(a: float, order: str) -> None:
    """A lid that tilts by x takes in the integral of x*exp(x*y) over the rectangle more."""
    lid = float(mp.quad(lambda x: mp.exp(mp.mpf(6) / 10 * x) - 1, [0, 0.5]))  # y from 0 to 0.6
    program = f"def f(a) integral ([0, 1], [0, 1], [0, 1]) {TURNED}*[z < 0.7 + a*x]*exp(x*y) d({order})"
    close(program, a, 0.7 * SLOPE + lid, 20_000)


@pytest.mark.parametrize("a", NEARLY)
def test_no_product(a: float) -> None:
    """1/(1 + how many of two conditions hold): on either side of each edge it depends on the other one."""
    program = f"def f(a) integral ([0, 1], [0, 1]) 1/(1 + {TURNED.replace('*[', ' + [')}) d(x, y)"
    in_both, in_one = 1 / 3 - 1 / 2, 1 / 2 - 1.0
    slope = in_both * (0.5**2 - 0.6**2) / 2 + in_one * ((1 - 0.5**2) - (1 - 0.6**2)) / 2
    close(program, a, slope, 1_000)


@pytest.mark.parametrize("a", [s * 10.0**k for k in (-16.4, -15.5, -14.5, -13.2, -12.0, -9.0, -6.0) for s in (1, -1)])
def test_bars_hold_all_the_way(a: float) -> None:
    """Between what is parallel up to rounding and what is not, the bars may be wide, but they cover."""
    answer = potto.deriv(potto.compile(f"def f(a) integral ([0, 1], [0, 1]) {TURNED}*exp(x*y) d(x, y)").f)((a, 1.0))
    assert abs(answer.tangent - SLOPE) <= answer.tangent_error + 10 * abs(a)


@pytest.mark.parametrize("a", [0.0, 1e-16, -2e-16])
def test_an_octagon_costs_what_a_turned_one_does(a: float) -> None:
    edges = "*".join(f"[x*cos(a + {k}*pi/4) + y*sin(a + {k}*pi/4) < 0.7]" for k in range(8))
    f = potto.deriv(potto.compile(f"def f(a) integral ([-1, 1], [-1, 1]) {edges} d(x, y)").f)
    along, turned = f((a, 1.0)), f((0.3, 1.0))
    assert turned.evals <= 50 and along.evals <= turned.evals + 50  # what is looked at beside four edges
    assert abs(along.value - 8 * 0.49 * math.tan(math.pi / 8)) <= along.error + 1e-15
    assert abs(along.tangent) <= along.tangent_error <= 1e-10 and along.converged


@pytest.mark.parametrize("turn", [0.0, math.pi / 2, math.pi])
def test_what_crosses_a_face_may_cancel_but_for_its_speed(turn: float) -> None:
    """Of x*y nothing crosses the upright edges of a rectangle, whose ends move in opposite directions as it turns."""
    edges = "[x*cos(t) + y*sin(t) < 1/2]*[-x*cos(t) - y*sin(t) < 1/2]*[y*cos(t) - x*sin(t) < 1/4]"
    program = f"def f(t) integral ([-1, 1], [-1, 1]) {edges}*[x*sin(t) - y*cos(t) < 1/4]*x*y d(x, y)"
    found = potto.deriv(potto.compile(program).f)((turn, 1.0))
    assert abs(found.tangent - math.cos(2 * turn) / 32) <= found.tangent_error + 1e-16 <= 1e-9


@pytest.mark.parametrize("order", ["x, y, z", "y, z, x", "z, x, y"])
@pytest.mark.parametrize(
    ("reach", "slope"), [("[0, 1]", 2.0), ("[-0.2, 1]", 2.0), ("[0, t]", 4 * 0.7), ("[0.1, 1]", 1.8)]
)
def test_a_face_behind_a_kink_in_one_variable_of_three(order: str, reach: str, slope: float) -> None:
    """Where z > 0, y < t: of two units of x, as long as z reaches above 0."""
    bounds = {"x": "[-1, 1]", "y": "[0, 1]", "z": reach}
    ranges = ", ".join(bounds[name] for name in order.split(", "))
    program = f"def f(t) integral ({ranges}) [abs(z)*t >= z*y] d({order})"
    answer = potto.deriv(potto.compile(program).f)((0.7, 1.0))
    assert abs(answer.tangent - slope) <= answer.tangent_error <= 1e-11 and answer.converged


@pytest.mark.parametrize("x", ["x", "x^2", "x^3", "x/t"])
@pytest.mark.parametrize("condition", ["[X*t > X*y] then 0 else 1", "[X*t <= X*y] then 1 else 0"])
def test_a_face_along_an_infinite_range(x: str, condition: str) -> None:
    """Where y > t, whatever x > 0 is. That the surface has x as a factor is seen in its summands; no bound tells it."""
    condition = condition.replace("X", x)
    program = f"def f(t) integral [-1, 1] (integral [0, inf] exp(-x)*(if {condition}) d(x)) d(y)"
    with potto.settings(max_evals=200_000):  # too few to try the other order
        answer = potto.deriv(potto.compile(program).f)((0.5, 1.0))
    assert abs(answer.value - 0.5) <= answer.error <= 1e-10
    assert abs(answer.tangent + 1) <= answer.tangent_error <= 1e-10


@pytest.mark.parametrize("bounds", ["[-inf, inf]", "[-6, 6]"])
@pytest.mark.parametrize("condition", ["[{}]", "[y < 0]*[({}) or y*exp(-x^2) > t]"])
def test_a_surface_that_falls_into_faces_beside_its_kink(bounds: str, condition: str) -> None:
    """|y| t >= y x is x <= t where y > 0 and x >= -t where y < 0, each for all y, on a range that has no ends to tell.
    With y t <= y x that leaves -t <= x <= t for y < 0: sqrt(pi) erf(t) Phi(-2 t)."""
    both = condition.format("abs(y)*t >= y*x and y*t <= y*x")
    text = f"def f(t) integral {bounds} (integral (y ~ normal(t, 0.5)) {both}*exp(-x^2) d(y)) d(x)"
    t, tail = 0.7, math.erfc(0.7 * math.sqrt(2)) / 2
    exact = math.sqrt(math.pi) * math.erf(t) * tail
    slope = 2 * math.exp(-t * t) * tail - math.sqrt(2) * math.erf(t) * math.exp(-2 * t * t)
    answer = potto.deriv(potto.compile(text).f)((t, 1.0))
    assert abs(answer.value - exact) <= answer.error + 1e-16 and answer.error <= 1e-10
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-16 and answer.tangent_error <= 1e-10
