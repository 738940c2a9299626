"""Sections that appear, merge, turn and meet at places of the variables further out, in two variables and in three.

Answers by closed forms, or by mpmath over lengths that are closed forms.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto
from potto.integrate.adaptive import short_neighbours

D = mp.sqrt(mp.mpf("0.15") ** 2 + mp.mpf("0.05") ** 2)  # between the centres of two discs


def derivative(text: str, by: str = "t", **at: float) -> Any:
    return potto.grad(potto.compile(text).f, by)(**at)


def holds(answer: Any, value: Any, tangent: Any, within: float) -> None:
    """The errors cover, and are within a part of the value: so many digits there are."""
    assert abs(answer.value - value) <= answer.error + 4e-16 * abs(value)
    assert abs(answer.tangent - tangent) <= answer.tangent_error + 4e-16 * abs(tangent)
    assert answer.error <= within * abs(value)
    assert answer.tangent_error <= within * abs(tangent)


def band(t: Any, a: Any, b: Any) -> Any:
    """The length of y in [a, b] with cos(4 y) < c, integrated over x in [a, b] with c = t - cos(4 x)."""

    def length(c: Any) -> Any:
        if c >= 1:
            return b - a
        if c <= -1:
            return mp.mpf(0)
        w = mp.acos(c)  # cos(u) < c for u in (w, 2 pi - w)
        pieces = ((w + 2 * mp.pi * k, 2 * mp.pi - w + 2 * mp.pi * k) for k in range(-2, 3))
        return sum(max(mp.mpf(0), min(b, hi / 4) - max(a, lo / 4)) for lo, hi in pieces)

    places = {a, b}
    for k in range(-3, 4):
        for at_end in (mp.cos(4 * a), mp.cos(4 * b), mp.mpf(1), mp.mpf(-1)):
            c = t - at_end
            if abs(c) <= 1:
                both = ((sign * mp.acos(c) + 2 * mp.pi * k) / 4 for sign in (1, -1))
                places |= {x for x in both if a < x < b}
    return mp.quad(lambda x: length(t - mp.cos(4 * x)), sorted(places))


@pytest.mark.parametrize("t", [0.7, -0.4, 1.3])
def test_an_energy_band(t: float) -> None:
    """The states below an energy, and their density: cos(4 x) + cos(4 y) < t, searched for as a sum of four."""
    with mp.workdps(20):
        a, b = mp.mpf(-1), mp.mpf("1.5")
        value, tangent = band(mp.mpf(t), a, b), mp.diff(lambda s: band(s, a, b), mp.mpf(t), h=mp.mpf("1e-6"))
    answer = derivative(
        "def f(t) integral ([-1, 1.5], [-1, 1.5]) [cos(2*x)^2 - sin(2*x)^2 + cos(4*y) < t] d(x, y)", t=t
    )
    assert abs(answer.value - value) <= 1e-11
    assert abs(answer.tangent - tangent) <= 1e-7  # of the reference: a difference


@pytest.mark.parametrize(("n", "r"), [(3, 0.8), (3, 1.0), (4, 0.9), (6, 0.7)])
def test_superellipses(n: int, r: float) -> None:
    """|x|^n + |y|^n < r^n, written so that no section has a closed form; the area is a quotient of gammas."""
    p = mp.mpf(1) / n
    area = 4 * mp.gamma(1 + p) ** 2 / mp.gamma(1 + 2 * p)
    text = f"def f(r) integral ([-1.5, 1.5], [-1.5, 1.5]) [abs(x)^{n} + abs(y)^{n} + 0*sin(x*y) < r^{n}] d(x, y)"
    holds(derivative(text, "r", r=r), area * r**2, 2 * area * r, 1e-8)


@pytest.mark.parametrize("t", [0.5, 0.7, 0.9])
def test_the_loop_of_a_folium(t: float) -> None:
    """x^3 + y^3 < 3 t x y in the first quadrant: 3/2 t^2."""
    text = "def f(t) integral ([0, 2], [0, 2]) [x^3 + y^3 - 3*t*x*y < 0] d(x, y)"
    holds(derivative(text, t=t), 1.5 * t**2, 3 * t, 1e-9)


def lens(r1: Any, r2: Any, d: Any) -> Any:
    """The area that two discs share."""
    if d >= r1 + r2:
        return mp.mpf(0)
    if d <= abs(r1 - r2):
        return mp.pi * min(r1, r2) ** 2
    one, two = ((d * d + p * p - q * q) / (2 * d * p) for p, q in ((r1, r2), (r2, r1)))
    root = (r1 + r2 - d) * (d + r1 - r2) * (d - r1 + r2) * (d + r1 + r2)
    return r1**2 * mp.acos(one) + r2**2 * mp.acos(two) - mp.sqrt(root) / 2


@pytest.mark.parametrize("off", [1e-9, 3e-8, 1e-7, 1e-6, 1e-4, 1e-2, -1e-7, -1e-5])
def test_beside_a_place_where_circles_meet_in_a_fold(off: float) -> None:
    """The section of two balls at x: just beside 0.34177793, where the circles meet in the top of one of them. What is
    integrated over z has a kink there that rounding displaces, next to where it is infinitely steep."""
    x = 0.34177792998484813 + off

    def area(t: Any) -> Any:
        r1, r2 = mp.sqrt(t * t - (mp.mpf(x) - mp.mpf(0.4)) ** 2), mp.sqrt(t * t - (mp.mpf(x) - mp.mpf(0.6)) ** 2)
        return mp.pi * (r1**2 + r2**2) - lens(r1, r2, D)

    with mp.workdps(30):
        value, tangent = area(mp.mpf(0.3)), mp.diff(area, mp.mpf(0.3))
    discs = "(x-0.4)^2 + (y-0.4)^2 + (z-0.45)^2 < t*t or (x-0.6)^2 + (y-0.55)^2 + (z-0.5)^2 < t*t"
    for order in ("y, z", "z, y"):
        text = f"def f(x, t) integral ([0, 1], [0, 1]) [{discs}] d({order})"
        answer = derivative(text, x=x, t=0.3)
        assert abs(answer.value - value) <= answer.error + 1e-16  # the two centres are rounded
        assert abs(answer.tangent - tangent) <= answer.tangent_error + 1e-14
        assert answer.tangent_error <= 1e-9


def two_balls(r: Any, d: Any) -> Any:
    return 8 * mp.pi * r**3 / 3 - mp.pi * (2 * r - d) ** 2 * (d**2 + 4 * d * r) / (12 * d)


@pytest.mark.parametrize(("how", "r"), [("union", 0.3), ("intersection", 0.3), ("union", 0.2)])
def test_two_balls(how: str, r: float) -> None:
    d = mp.sqrt(mp.mpf("0.2") ** 2 + mp.mpf("0.15") ** 2 + mp.mpf("0.05") ** 2)

    def volume(r: Any) -> Any:
        both = two_balls(r, d)
        return both if how == "union" else 8 * mp.pi * r**3 / 3 - both

    word = "or" if how == "union" else "and"
    balls = f"(x-0.4)^2 + (y-0.4)^2 + (z-0.45)^2 < t*t {word} (x-0.6)^2 + (y-0.55)^2 + (z-0.5)^2 < t*t"
    answer = derivative(f"def f(t) integral ([0, 1], [0, 1], [0, 1]) [{balls}] d(x, y, z)", t=r)
    with mp.workdps(30):
        holds(answer, volume(mp.mpf(r)), mp.diff(volume, mp.mpf(r)), 1e-8)


def test_a_ball_in_six_dimensions_that_touches_its_box() -> None:
    names = [f"x{i}" for i in range(6)]
    condition = " + ".join(f"{name}^2" for name in names)
    bounds = ", ".join(["[-1, 1]"] * 6)
    answer = potto.compile(f"def f(r) integral ({bounds}) [{condition} < r^2] d({', '.join(names)})").f(1.0)
    exact = mp.pi**3 / 6
    assert abs(answer.value - exact) <= answer.error <= 1e-8


def test_a_torus_is_covered_by_its_errors() -> None:
    text = "def f(r) integral ([-2, 2], [-2, 2], [-1, 1]) [(sqrt(x^2 + y^2) - 1)^2 + z^2 < r^2] d(x, y, z)"
    answer = potto.compile(text).f(0.4)
    assert abs(answer.value - 2 * mp.pi**2 * mp.mpf(0.4) ** 2) <= answer.error <= 1e-8


@pytest.mark.parametrize("t", [0.3, 0.5, 0.8, 1.0, 1.5, 2.0, 5.0])
def test_a_level_area_of_a_quartic(t: float) -> None:
    """In polar coordinates a r^4 + b r^2 = t, a = cos^4 + sin^4 + cos^2 sin^2, b = cos sin: a quadratic in r^2."""

    def shape(u: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        c, s = mp.cos(u), mp.sin(u)
        return c**4 + s**4 + c * c * s * s, c * s

    def root(u: mp.mpf) -> mp.mpf:
        a, b = shape(u)
        return mp.sqrt(b * b + 4 * a * t)

    places = [k * mp.pi / 4 for k in range(9)]
    area = mp.quad(lambda u: (root(u) - shape(u)[1]) / (4 * shape(u)[0]), places)
    slope = mp.quad(lambda u: 1 / (2 * root(u)), places)
    f = potto.compile("def f(t) integral ([-2, 2], [-2, 2]) [x^4 + x*y + y^4 + x^2*y^2 < t] d(x, y)").f
    answer = potto.deriv(f)((t, 1.0))
    assert abs(answer.value - area) <= answer.error <= 1e-9 and answer.converged
    assert abs(answer.tangent - slope) <= answer.tangent_error + 1e-13 and answer.tangent_error <= 1e-9


def test_a_loop_that_is_as_small_as_its_parameter() -> None:
    """Under x^3 + y^3 = t x y, whose points are x = t m/(1 + m^3), y = m x: a loop of area t^2/6, and left of it a
    curve with another slope along -1e-8 < x < 0, where nothing is cut. It counts by 2e-9 of the derivative."""
    t = mp.mpf(10) ** -8
    last = mp.findroot(lambda m: t * m + 1 + m**3, -1 + t / 3)  # where x = -1

    def slope(s: Any) -> Any:
        """dy/dt dx by s, where m = e^s - 1."""
        m = mp.exp(s) - 1
        x = t * m / (1 + m**3)
        return x * m * x / (3 * (m * x) ** 2 - t * x) * t * (1 - 2 * m**3) / (1 + m**3) ** 2 * mp.exp(s)

    exact = mp.quad(slope, [*mp.linspace(mp.log(1 + last), mp.log(mp.mpf(1) / 2), 9), 0]) + t / 3
    answer = derivative("def f(t) integral ([-1, 1], [0, 1]) [x^3 + y^3 <= t*x*y] d(x, y)", t=1e-8)
    assert abs(answer.tangent - exact) <= answer.tangent_error + 4e-16 and answer.tangent_error <= 1e-11


def test_where_sections_end_on_a_range_without_ends() -> None:
    """The loop of x^3 + y^3 < c x y ends at x = 2^(2/3) c/3, under a normal density of y, too: between the nodes of a
    rule its square root was missed by 5e-10. Sections by the roots of the cubic, under the density by erf."""
    c, t = mp.mpf("0.4"), mp.mpf("0.7")
    last = c * mp.cbrt(4) / 3

    def inside(x: Any) -> Any:
        top = mp.sqrt(t * t - x * x)
        half = mp.sqrt(c * x / 3)
        q = x**3 / (2 * half**3) if x else mp.mpf(0)  # at most 1 up to `last`: three roots by Viète's formula, else one
        if q > 1:
            return mp.ncdf(max(-2 * half * mp.cosh(mp.acosh(q) / 3), -top)) - mp.ncdf(-top)
        lowest, middle, highest = sorted(2 * half * mp.cos((mp.acos(-q) - 2 * mp.pi * k) / 3) for k in range(3))
        return mp.ncdf(lowest) - mp.ncdf(-top) + mp.ncdf(min(highest, top)) - mp.ncdf(middle)

    outside = mp.findroot(lambda x: x**3 - (t * t - x * x) ** 1.5 + c * x * mp.sqrt(t * t - x * x), 0.43)
    plain = [0, last / 4, last * 3 / 4], [last, outside]
    exact = sum(mp.quad(inside, part) for part in plain)
    exact += mp.quad(lambda s: inside(last - s * s) * 2 * s, [0, mp.sqrt(last) / 2])
    loop = "y^3 + x^3 < 0.4*y*x and (abs(y) + abs(x) <= 0.4 or hypot(y, x) <= t)"
    answer = potto.compile(f"def f(t) integral [0, 1] (integral (y ~ normal(0, 1)) [{loop}] d(y)) d(x)").f(0.7)
    assert abs(answer.value - exact) <= answer.error + 1e-16 and answer.error <= 1e-11


def test_between_planes_nothing_is_looked_for_beside_short_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two corners of a triangle lie 1e-3 apart: what is further in is a polynomial between its cuts. At t = 0.2 edges
    coincide, so that no rule is taken to be exact."""
    looked = []
    beside = short_neighbours._missed
    monkeypatch.setattr(short_neighbours, "_missed", lambda *given: looked.append(1) or beside(*given))
    edges = "[y < t*x and y > 0.2*x and 1000*(x - 0.5) < 2 - y]"
    for condition, expected in ((edges, False), (edges.replace("t*x", "t*x^3"), True)):
        looked.clear()
        f = potto.compile(f"def f(t) integral ([0, 1], [0, 1]) {condition}*(1 + x*y) d(x, y)").f
        with potto.settings(backend="numpy"):
            potto.grad(f)(np.array([0.7, 0.8, 0.2] * 4))
        assert bool(looked) is expected, condition


def test_a_turning_point_that_merges_with_another_cut() -> None:
    """Sections in z turn at y = t; in x they end at y = -1/2 for t = -1/2, but for some roundings. A map of the nodes
    around a point so much off loses sqrt(rounding): the tangent was 6e-9 off at just this t, with an error of 1e-11."""
    program = "def f(t) integral [-1, 1] integral [-1, 1] integral [-1, 1] {} d(z) d(y) d(x)"
    both = "(if [(y*exp(-z^2) <= t or z*x <= t) and {}] then 1 else 0)"
    sides = "atan2(x - t, y) <= 1", "not (atan2(x - t, y) <= 1)"
    found = [derivative(program.format(both.format(side)), t=-0.5) for side in sides]
    with mp.workdps(20):
        t, ends = mp.mpf(-0.5), [mp.mpf(0), mp.mpf("0.5"), mp.sqrt(mp.log(2)), mp.mpf(1)]

        def left_out(z: Any, d: int) -> Any:  # of y and x for this z, z > 0, and how that grows with -t
            y, dy = 1 - max(mp.mpf(-1), t * mp.exp(z**2)), mp.exp(z**2) * (z < ends[2])
            x, dx = (mp.mpf(2), 0) if z < ends[1] else (1 - t / z, 1 / z)
            return x * dy + dx * y if d else x * y

        value = 8 - 2 * mp.quad(lambda z: left_out(z, 0), ends)
        tangent = 2 * mp.quad(lambda z: left_out(z, 1), ends)
    assert abs(sum(part.value for part in found) - value) <= sum(part.error for part in found)
    assert abs(sum(part.tangent for part in found) - tangent) <= sum(part.tangent_error for part in found) < 1e-9


def test_a_tip_beside_a_short_stretch_is_part_of_the_error() -> None:
    """The parabola's tip lies within a circle as wide as t: what is missed beside it is too little to be refined, and
    more than the nodes tell. 2*(6 - 4/3 sqrt(1/2)) - pi t^2, within the error alone."""
    f = potto.compile(
        "def f(t) integral [-1, 1] (integral [-1, 2] (2*[(y - t)^2 >= 0.5*x] - [hypot(x, y) < t]) d(y)) d(x)"
    ).f
    for t in (1e-8, 1e-7, 1e-6):
        answer = f(t)
        assert abs(answer.value - (12 - 8 / 3 * math.sqrt(0.5) - math.pi * t * t)) <= answer.error < 1e-9


def test_a_tail_whose_tangent_alone_is_seen() -> None:
    """At x = t the density's tail beyond y = sin(3 x)/t is 1e-10 and dies out in a hundredth of what follows, its
    tangent by t is a thousand times larger: the derivative was 3.8e-10 off with 6.4e-11. Expected values are integrals
    of erf and of its derivatives by Gauss-Legendre rules of 100 nodes, right to 1e-14."""
    t, nodes = 0.021, np.polynomial.legendre.leggauss(100)

    def over(f: Any, *places: float) -> float:
        parts = [(a + b + (b - a) * nodes[0], b - a) for a, b in pairwise(places)]
        return sum(length / 2 * float(nodes[1] @ f(x / 2)) for x, length in parts)

    def density(z: Any) -> Any:
        return np.exp(-z * z / 2) / math.sqrt(2 * math.pi)

    def beyond(x: float) -> float:  # of cos(x - y) where y > x, by how far x is above t
        return over(lambda z: density(z) * np.cos(x - z / 2), 2 * x, 2, 5, 12)

    def top(x: Any) -> Any:  # how the probability of y < sin(3 x)/t changes with t, and what that counts
        s = np.sin(3 * x) / t
        return (1 + x * x) * density(2 * (s - t)) * 2 * (-s / t - 1)

    def beside(x: Any, sign: int) -> Any:  # the same for y < -r, or y < r, where r^2 = t - x^2
        r = sign * np.sqrt(t - x * x)
        return (1 + x * x) * density(2 * (r - t)) * 2 * (0.5 / r - 1)

    def near(s: Any) -> Any:  # between the corner and the end of the circle at x = side, at the end's root
        x = side - s * s
        return 2 * s * (beside(x, -1) - beside(x, 1))

    side = math.sqrt(t)
    corner = float(mp.findroot(lambda x: (mp.sin(3 * x) / t) ** 2 - t + x * x, t**1.5 / 3))
    under = over(top, -t, -corner) + over(lambda x: beside(x, -1), -corner, corner)
    under += over(top, corner, t / 2, t, 2 * t, 5 * t, 1) + over(near, 0, math.sqrt(side - t), math.sqrt(side - corner))
    under += (1 + t * t) * math.erfc(-math.sqrt(2) * (math.sin(-3 * t) / t - t)) / 2  # by the end at -t
    expected = 2 * (2 * beyond(-2 * t) - beyond(1 - t)) - under
    body = "2*(if [x <= y] then cos(x - y) else 0) - (if [x^2 + y^2 > t and sin(3*x) > t*y] then 1 + x^2 else 0)"
    found = derivative(f"def f(t) integral [-t, 1] (integral (y ~ normal(t, 0.5)) ({body}) d(y)) d(x)", t=t)
    assert abs(found.tangent - expected) <= found.tangent_error <= 2e-10


@pytest.mark.parametrize("t", [3e-8, 1e-8, 1e-9, -1e-8])
def test_a_jump_keeps_its_place_beside_a_double_root(t: float) -> None:
    """Where x = 0 a hyperbola touches y = 0. Of that double root it is known only that it is within 4e-8 of 0; the jump
    at x = t, which rounding does not tell from it, is known exactly."""
    region = "[x^2 + y^2 < 0.4] - [x > t or y^2 - x^2 <= 0.4*y]"
    f = potto.deriv(potto.compile(f"def f(t) integral ([-1, 2], [0, 1]) exp(x)*({region}) d(x, y)").f)

    def height(x: mp.mpf) -> mp.mpf:
        return min(mp.mpf(1), mp.mpf("0.2") + mp.sqrt(mp.mpf("0.04") + x**2))

    with mp.workdps(30):
        disc, knee = mp.sqrt(mp.mpf("0.4")), mp.sqrt(mp.mpf("0.6"))
        value = mp.quad(lambda x: mp.exp(x) * mp.sqrt(disc**2 - x**2), [-disc, 0, disc]) - (mp.exp(2) - mp.exp(t))
        value -= mp.quad(lambda x: mp.exp(x) * height(x), [-1, -knee, -knee / 2, 0, t])
        slope = mp.exp(t) * (1 - height(mp.mpf(t)))
    answer = f((t, 1.0))
    assert abs(answer.value - value) <= answer.error <= 1e-11
    assert abs(answer.tangent - slope) <= answer.tangent_error <= 1e-11


@pytest.mark.parametrize("unit", [1.0, 1e-4, 1e-8, 1e-20, 1e8])
@pytest.mark.parametrize(
    ("curve", "lo", "hi", "area"),
    [("x^3 + y^3 - 3*t*x*y < 0", 0, 3.3, 1.5), ("y^2*t < x^3 - x*t^2 and x < 0", -2, 2, mp.beta(0.75, 1.5))],
    ids=["a loop with a double point", "an oval beside a branch"],
)
def test_a_curve_in_any_unit_of_length(curve: str, lo: float, hi: float, area: Any, unit: float) -> None:
    """Areas go as t^2. Of Descartes' leaf it is 3/2, of the oval twice the integral of sqrt(x - x^3) over [0, 1]."""
    side = f"[{lo * unit!r}, {hi * unit!r}]"
    answer = derivative(f"def f(t) integral ({side}, {side}) [{curve}] d(x, y)", t=unit)
    holds(answer, area * unit**2, 2 * area * unit, 1e-10)
    assert answer.converged
