"""Conditions with brackets inside: controllers, simulations with switches, brackets in brackets.

References are pieces by hand: a state as a function of where it started is affine between breakpoints, which exact
rational arithmetic follows step by step; what comes out is a quadratic in the parameters as long as no piece appears,
so that a central difference of it is its derivative exactly.

Tolerances: 1e-13 of the answer, a few hundred ulp for what a composition of 16 affine maps amplifies, and every
reported error must cover.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from polygons import Polygon, clipped, moment
from polygons import area as size

import potto
from potto.calculus.surfaces.lifted import _Trees
from potto.integrate.plan import make
from potto.runtime.integration import problem

EPS = 2.0**-52
leaf = _Trees.leaf
Map = tuple[Fraction, Fraction]  # gain and shift
Piece = tuple[Fraction, Fraction, Fraction, Fraction]  # from, to, slope, offset
H = Fraction(1, 10**15)


def covered(answer: Any, exact: Fraction | float, tangent: bool = False, rtol: float = 1e-13) -> None:
    value = answer.tangent if tangent else answer.value
    error = answer.tangent_error if tangent else answer.error
    assert answer.converged, answer.reasons
    off = abs(float(Fraction(value) - Fraction(exact)))
    assert off <= rtol * max(1.0, abs(float(exact))), (value, float(exact))
    assert off <= error + 8 * EPS * abs(float(exact)), (value, float(exact), error)


def switched(pieces: list[Piece], at: Fraction, below: Map, above: Map) -> list[Piece]:
    """The pieces of a state after one step: one affine map where it is below a threshold, one above it."""
    found = []
    for lo, hi, slope, offset in pieces:
        root = (at - offset) / slope
        cuts = [lo, *([root] if lo < root < hi else []), hi]
        for a, b in itertools.pairwise(cuts):
            gain, shift = below if slope * (a + b) / 2 + offset < at else above
            found.append((a, b, gain * slope, gain * offset + shift))
    return found


def mean(pieces: list[Piece]) -> Fraction:
    return sum(((b - a) * (slope * (a + b) / 2 + offset) for a, b, slope, offset in pieces), Fraction(0))


def rate(value: Callable[[Fraction], Fraction], at: float) -> Fraction:
    t = Fraction(at)
    return (value(t + H) - value(t - H)) / (2 * H)


MAPS = (1 - Fraction(0.3), Fraction(0.3)), (Fraction(0.8), Fraction(0))  # of the simulation, below and above
SIMULATION = """
def step(s, t) if [s < t] then s + 0.3*(1 - s) else 0.8*s
def sim(n, s, t) if n > 0 then sim(n - 1, step(s, t), t) else s
def f(t) integral [0, 1] sim({n}, x, t) d(x)
"""


def thermostat(n: int, t: Fraction) -> Fraction:
    pieces: list[Piece] = [(Fraction(0), Fraction(1), Fraction(1), Fraction(0))]
    for _ in range(n):
        pieces = switched(pieces, t, *MAPS)
    return mean(pieces)


@pytest.mark.parametrize("n", range(1, 17))
@pytest.mark.parametrize("t", [0.5, 0.437, 0.713])
def test_a_thermostat_of_n_steps(n: int, t: float) -> None:
    f = potto.compile(SIMULATION.format(n=n)).f
    covered(f(t), thermostat(n, Fraction(t)))
    covered(potto.deriv(f)((t, 1.0)), rate(lambda t: thermostat(n, t), t), tangent=True)


def test_sixteen_steps_are_few_cases() -> None:
    f = potto.compile(SIMULATION.format(n=16)).f
    answer = potto.deriv(f)((0.5, 1.0))
    assert answer.evals < 1000 and answer.stats["integrals"] == 1
    again = potto.deriv(f)((0.5, 1.0))
    assert again.stats["kernels compiled"] == 0


@pytest.mark.parametrize("n", [2, 5, 9])
def test_as_an_array_and_as_one_number_each(n: int) -> None:
    """Members that meet other cases go their own ways."""
    f = potto.compile(SIMULATION.format(n=n)).f
    ts = np.linspace(0.0513, 0.9487, 13)  # none of which puts a surface on a bound
    answer = potto.deriv(f)((ts, np.ones(13)))
    for i, t in enumerate(ts):
        exact = float(thermostat(n, Fraction(t)))
        assert abs(answer.value[i] - exact) <= answer.error[i] + 8 * EPS
        slope = float(rate(lambda t: thermostat(n, t), t))
        assert abs(answer.tangent[i] - slope) <= answer.tangent_error[i] + 8 * EPS * abs(slope)


def started(lo: Fraction, hi: Fraction) -> list[Piece]:
    return [(lo, hi, Fraction(1), Fraction(0))]


GAINS = """
def step(s, a, b, t) if [s < t] then s + a*(1 - s) else b*s
def sim(n, s, a, b, t) if n > 0 then sim(n - 1, step(s, a, b, t), a, b, t) else s
def f(a, b, t) integral [0, 1] sim(6, x, a, b, t) d(x)
"""


@pytest.mark.parametrize("by", [0, 1, 2])
def test_gains_are_parameters_too(by: int) -> None:
    def value(a: Fraction, b: Fraction, t: Fraction) -> Fraction:
        pieces = started(Fraction(0), Fraction(1))
        for _ in range(6):
            pieces = switched(pieces, t, (1 - a, a), (b, Fraction(0)))
        return mean(pieces)

    at = [Fraction(x) for x in (0.3, 0.8, 0.5)]
    up, down = ([x + s * H * (i == by) for i, x in enumerate(at)] for s in (1, -1))
    answer = potto.deriv(potto.compile(GAINS).f)(*((float(x), float(i == by)) for i, x in enumerate(at)))
    covered(answer, value(*at))
    covered(answer, (value(*up) - value(*down)) / (2 * H), tangent=True, rtol=1e-12)


HYSTERESIS = {
    "two states": """
def mode(s, m, lo, hi) if [s > hi] then 0 else if [s < lo] then 1 else m
def move(s, m) if [m > 0.5] then s + 0.25*(1 - s) else 0.8*s
def sim(n, s, m, lo, hi)
    if n > 0 then sim(n - 1, move(s, mode(s, m, lo, hi)), mode(s, m, lo, hi), lo, hi) else s
def f(lo, hi) integral [0, 1] sim(6, x, 1, lo, hi) d(x)
""",
    "one tuple": """
def heat(s) (s + 0.25*(1 - s), 1)
def cool(s) (0.8*s, 0)
def step(st, lo, hi)
    s = fst st
    if [snd st > 0.5] then (if [s > hi] then cool(s) else heat(s)) else (if [s < lo] then heat(s) else cool(s))
def sim(n, st, lo, hi) if n > 0 then sim(n - 1, step(st, lo, hi), lo, hi) else fst st
def f(lo, hi) integral [0, 1] sim(6, (x, 1), lo, hi) d(x)
""",
}


def hysteresis(lo: Fraction, hi: Fraction) -> Fraction:
    warm, cold = (Fraction(0.75), Fraction(0.25)), (Fraction(0.8), Fraction(0))
    pieces = [(*piece, True) for piece in started(Fraction(0), Fraction(1))]
    for _ in range(6):
        found = []
        for a, b, slope, offset, on in pieces:
            at = hi if on else lo
            root = (at - offset) / slope
            cuts = [a, *([root] if a < root < b else []), b]
            for c, d in itertools.pairwise(cuts):
                stays = slope * (c + d) / 2 + offset < at
                gain, shift = warm if stays else cold
                found.append((c, d, gain * slope, gain * offset + shift, stays))
        pieces = found
    return mean([piece[:4] for piece in pieces])


@pytest.mark.parametrize("program", HYSTERESIS.values(), ids=HYSTERESIS)
def test_hysteresis(program: str) -> None:
    f = potto.compile(program).f
    lo, hi = Fraction(0.41), Fraction(0.62)
    covered(f(0.41, 0.62), hysteresis(lo, hi))
    by_lo = potto.deriv(f)((0.41, 1.0), (0.62, 0.0))
    by_hi = potto.deriv(f)((0.41, 0.0), (0.62, 1.0))
    covered(by_lo, (hysteresis(lo + H, hi) - hysteresis(lo - H, hi)) / (2 * H), tangent=True)
    covered(by_hi, (hysteresis(lo, hi + H) - hysteresis(lo, hi - H)) / (2 * H), tangent=True)


def test_what_it_costs_on_the_way() -> None:
    before = """
def step(s, t) if [s < t] then s + 0.3*(1 - s) else 0.8*s
def cost(n, s, t) if n > 0 then (s - 0.4)^2 + cost(n - 1, step(s, t), t) else 0
def f(t) integral [0, 1] cost(7, x, t) d(x)
"""

    def value(t: Fraction) -> Fraction:
        pieces, found, goal = started(Fraction(0), Fraction(1)), Fraction(0), Fraction(0.4)
        for _ in range(7):
            for a, b, m, c in pieces:
                found += ((m * b + c - goal) ** 3 - (m * a + c - goal) ** 3) / (3 * m)
            pieces = switched(pieces, t, *MAPS)
        return found

    answer = potto.deriv(potto.compile(before).f)((0.5, 1.0))
    covered(answer, value(Fraction(0.5)))
    covered(answer, rate(value, 0.5), tangent=True, rtol=1e-12)


def test_how_often_it_is_too_cold() -> None:
    before = SIMULATION.split("def f")[0] + "def f(t) integral [0, 1] [sim(8, x, t) < 0.5] d(x)"

    def value(t: Fraction) -> Fraction:
        pieces = started(Fraction(0), Fraction(1))
        for _ in range(8):
            pieces = switched(pieces, t, *MAPS)
        flat = switched(pieces, Fraction(1, 2), (Fraction(0), Fraction(1)), (Fraction(0), Fraction(0)))
        return mean(flat)

    answer = potto.deriv(potto.compile(before).f)((0.52, 1.0))
    covered(answer, value(Fraction(0.52)))
    covered(answer, rate(value, 0.52), tangent=True)


def test_a_normal_start() -> None:
    """Over infinite bounds: the pieces' means from erf and exp."""
    f = potto.compile(SIMULATION.format(n=6).replace("integral [0, 1]", "integral (x ~ normal(0.5, 0.2))")).f

    @mp.workdps(40)
    def value(t: Any) -> Any:
        far = Fraction(1000)
        pieces = started(-far, far)
        for _ in range(6):
            pieces = switched(pieces, Fraction(str(t)), *MAPS)
        found = mp.mpf(0)
        m, s = mp.mpf(0.5), mp.mpf(0.2)
        for a, b, slope, offset in pieces:
            p, q = ((mp.mpf(z.numerator) / z.denominator - m) / s for z in (a, b))
            g, c = (mp.mpf(z.numerator) / z.denominator for z in (slope, offset))
            found += (g * m + c) * (mp.ncdf(q) - mp.ncdf(p)) + g * s * (mp.npdf(p) - mp.npdf(q))
        return found

    answer = potto.deriv(f)((0.5, 1.0))
    h = mp.mpf(10) ** -12
    covered(answer, float(value(mp.mpf("0.5"))), rtol=1e-12)
    with mp.workdps(40):
        slope = (value(mp.mpf("0.5") + h) - value(mp.mpf("0.5") - h)) / (2 * h)
    covered(answer, float(slope), tangent=True, rtol=1e-11)


# In one variable: conditions, bounds, weight 1 or exp(u); references from the sign of the condition on exact pieces

DEEP = [
    ("0.3*[u < s] + 0.5*u < 0.2", lambda u, s: 0.3 * (u < s) + 0.5 * u < 0.2),
    ("0.2 > 0.5*u + 0.3*[s > u]", lambda u, s: 0.3 * (u < s) + 0.5 * u < 0.2),
    ("(if [u < s] then 0.3 + 0.5*u else 0.5*u) < 0.2", lambda u, s: 0.3 * (u < s) + 0.5 * u < 0.2),
    ("not (0.3*[u < s] + 0.5*u >= 0.2)", lambda u, s: 0.3 * (u < s) + 0.5 * u < 0.2),
    ("0.3*[not (u < s)] - u < s/2 and u < 0.7", lambda u, s: 0.3 * (u >= s) - u < s / 2 and u < 0.7),
    ("u + [u < s]*[u > -s] < 0.45", lambda u, s: u + (-s < u < s) < 0.45),
    ("u + 0.4*[-s < u < s] < 0.45", lambda u, s: u + 0.4 * (-s < u < s) < 0.45),
    ("0.3*[0.2*[u < s] + u < 0.35] + 0.5*u < 0.2", lambda u, s: 0.3 * (0.2 * (u < s) + u < 0.35) + 0.5 * u < 0.2),
    (
        "0.3*[0.2*[0.5*[2*u < s] - u < s] + u < 0.3] + 0.5*u < 0.2",
        lambda u, s: 0.3 * (0.2 * (0.5 * (2 * u < s) - u < s) + u < 0.3) + 0.5 * u < 0.2,
    ),
    ("abs(u - 0.4*[u < s]) < 0.3", lambda u, s: abs(u - 0.4 * (u < s)) < 0.3),
    ("max(u, 0.3*[u < s]) < 0.35 - s/4", lambda u, s: max(u, 0.3 * (u < s)) < 0.35 - s / 4),
    ("u*u + [u < s]*u < 0.3", lambda u, s: u * u + (u < s) * u < 0.3),
    ("u^3 - u*[u < s] < s - 0.3", lambda u, s: u**3 - u * (u < s) < s - 0.3),
    ("exp(u)*(1 + [u < s]) < 1.5", lambda u, s: mp.exp(u) * (1 + (u < s)) < 1.5),
]


@mp.workdps(30)
def by_bisection(holds: Callable[[Any, Any], bool], s: Any) -> Any:
    """The integral of exp(u) over the part of [-1, 1] where a condition holds."""
    nodes = [mp.mpf(k) / 997 for k in range(-997, 998)]
    ends = [mp.mpf(-1)]
    for a, b in itertools.pairwise(nodes):
        if holds(a, s) != holds(b, s):
            left = holds(a, s)
            for _ in range(90):
                c = (a + b) / 2
                a, b = (c, b) if holds(c, s) == left else (a, c)
            ends.append((a + b) / 2)
    ends.append(mp.mpf(1))
    return mp.fsum(mp.exp(b) - mp.exp(a) for a, b in itertools.pairwise(ends) if holds((a + b) / 2, s))


@pytest.mark.parametrize(("condition", "holds"), DEEP, ids=[row[0] for row in DEEP])
@pytest.mark.parametrize("s", [0.13, 0.31])
def test_brackets_in_brackets(condition: str, holds: Callable[[Any, Any], bool], s: float) -> None:
    f = potto.compile(f"def f(s) integral [-1, 1] exp(u)*[{condition}] d(u)").f
    h = mp.mpf(10) ** -9
    answer = potto.deriv(f)((s, 1.0))
    covered(answer, float(by_bisection(holds, mp.mpf(s))), rtol=1e-12)
    with mp.workdps(30):
        slope = (by_bisection(holds, mp.mpf(s) + h) - by_bisection(holds, mp.mpf(s) - h)) / (2 * h)
    covered(answer, float(slope), tangent=True, rtol=1e-11)


# In two variables: a condition, as brackets inside and split by hand

PAIRS = [
    ("0.3*[x + y < s] + 0.5*x - y < 0.2", "x + y < s", "0.3 + 0.5*x - y < 0.2", "0.5*x - y < 0.2"),
    ("0.3*[x < s] + 0.5*y < 0.4", "x < s", "0.3 + 0.5*y < 0.4", "0.5*y < 0.4"),
    ("[x < s]*x^2 + y^2 < 0.3", "x < s", "x^2 + y^2 < 0.3", "y^2 < 0.3"),
    ("x - 0.5*[x^2 + y^2 < s] < y", "x^2 + y^2 < s", "x - 0.5 < y", "x < y"),
    ("y < [x < y]*x + s", "x < y", "y < x + s", "y < s"),
]


@pytest.mark.parametrize(("condition", "inner", "first", "second"), PAIRS, ids=[row[0] for row in PAIRS])
def test_two_variables(condition: str, inner: str, first: str, second: str) -> None:
    """As the same program with its cases written out."""
    over = "integral ([0, 1], [0, 1])"
    lifted = potto.compile(f"def f(s) {over} exp(x)*[{condition}] d(x, y)").f
    byhand = potto.compile(f"def f(s) {over} exp(x)*(if [{inner}] then [{first}] else [{second}]) d(x, y)").f
    one, other = potto.deriv(lifted)((0.3, 1.0)), potto.deriv(byhand)((0.3, 1.0))
    assert one.converged and other.converged
    assert abs(one.value - other.value) <= one.error + other.error
    assert abs(one.tangent - other.tangent) <= one.tangent_error + other.tangent_error


def test_two_variables_by_area() -> None:
    answer = potto.deriv(
        potto.compile("def f(s) integral ([0, 1], [0, 1]) [0.3*[x + y < s] + 0.5*x - y < 0.2] d(x, y)").f
    )((0.3, 1.0))
    zero, one = Fraction(0), Fraction(1)
    outside = [(zero, zero), (one, zero), (one, one), (zero, one)]

    def area(s: Fraction) -> Fraction:
        low, high = cut(outside, (Fraction(-1), Fraction(-1), s)), cut(outside, (Fraction(1), Fraction(1), -s))
        first = cut(low, (-Fraction(0.5), Fraction(1), Fraction(0.2) - Fraction(0.3)))
        second = cut(high, (-Fraction(0.5), Fraction(1), Fraction(0.2)))
        return abs(size(first)) + abs(size(second))

    covered(answer, area(Fraction(0.3)))
    covered(answer, rate(area, 0.3), tangent=True)


Line = tuple[Fraction, Fraction, Fraction]  # a*x + b*y + c


def cut(polygon: Polygon, line: Line) -> Polygon:
    """The part of a convex polygon where a line's form is positive."""
    a, b, c = line
    return clipped(polygon, lambda point: a * point[0] + b * point[1] + c)


NOISE = """
def step(s, t, u) if [s < t] then s + 0.3*(1 - s) + 0.05*u else 0.8*s + 0.05*u
def sim(n, s, t, u) if n > 0 then sim(n - 1, step(s, t, u), t, u) else s
def f(t) integral ([0, 1], [-1, 1]) sim({n}, x, t, u) d(x, u)
"""


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_noise_as_a_second_variable(n: int) -> None:
    def value(t: Fraction) -> Fraction:
        zero, one, gain, drift = Fraction(0), Fraction(1), Fraction(0.3), Fraction(0.05)
        cells = [([(zero, -one), (one, -one), (one, one), (zero, one)], (one, zero, zero))]
        for _ in range(n):
            further = []
            for polygon, (a, b, c) in cells:
                low, high = cut(polygon, (-a, -b, t - c)), cut(polygon, (a, b, c - t))
                further.append((low, ((1 - gain) * a, (1 - gain) * b + drift, (1 - gain) * c + gain)))
                further.append((high, (Fraction(0.8) * a, Fraction(0.8) * b + drift, Fraction(0.8) * c)))
            cells = [(polygon, form) for polygon, form in further if len(polygon) > 2]
        return sum((moment(polygon, *form) for polygon, form in cells), zero)

    answer = potto.deriv(potto.compile(NOISE.format(n=n)).f)((0.47, 1.0))
    covered(answer, value(Fraction(0.47)), rtol=1e-12)
    covered(answer, rate(value, 0.47), tangent=True, rtol=1e-11)


# Deltas of what jumps, second derivatives, samples


def test_a_delta_of_a_controller() -> None:
    answer = potto.deriv(potto.compile("def f(t) integral [-1, 2] delta(0.3*[x < 0.1] + 0.5*x - t)*exp(x) d(x)").f)(
        (0.12, 1.0)
    )
    exact = 2 * (math.exp(-0.36) + math.exp(0.24))  # at x = 2*(t - 0.3) and 2*t
    covered(answer, exact)
    covered(answer, 2 * exact, tangent=True)


def test_second_derivatives() -> None:
    f = potto.compile("def f(s) integral [-1, 1] exp(u)*[0.3*[u < s] + 0.5*u < 0.2] d(u)").f
    found = potto.deriv(potto.deriv(f))(((0.1, 1.0), (1.0, 0.0)))
    (_, first), (_, second) = found.value, found.tangent  # exp(-0.2) - 1/e + exp(0.4) - exp(s)
    assert first == pytest.approx(-math.exp(0.1), rel=1e-12) and second == pytest.approx(-math.exp(0.1), rel=1e-12)


def test_a_derivative_under_another_definition() -> None:
    text = SIMULATION.format(n=5) + "def g(t) snd(deriv(f)((t, 1)))\n"
    covered(potto.compile(text).g(0.5), rate(lambda t: thermostat(5, t), 0.5))


def test_inside_an_inner_integral() -> None:
    f = potto.compile("def f(s) integral [0, 1] exp(integral [0, 1] [0.3*[x < s] + 0.5*y < 0.4] d(y)) d(x)").f
    answer = potto.deriv(f)((0.3, 1.0))
    covered(answer, 0.3 * math.exp(0.2) + 0.7 * math.exp(0.8), rtol=1e-12)
    covered(answer, math.exp(0.2) - math.exp(0.8), tangent=True, rtol=1e-12)


@pytest.mark.parametrize("method", ["mc", "qmc"])
def test_samples_see_the_boundary(method: str) -> None:
    f = potto.compile(SIMULATION.format(n=4)).f
    with potto.settings(method=method, samples=40_000, seed=5):
        answer = potto.deriv(f)((0.5, 1.0))
    value, slope = float(thermostat(4, Fraction(0.5))), float(rate(lambda t: thermostat(4, t), 0.5))
    assert abs(answer.value - value) <= 2 * answer.error + 1e-12
    assert abs(answer.tangent - slope) <= 2 * answer.tangent_error + 1e-12


@pytest.mark.parametrize("n", [20, 80])
def test_many_thresholds_in_one_condition(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """There are n + 1 cases, but 2^n while nothing is known of thresholds: few leaves are looked at to find that out.

    Between two thresholds (j - 1)*t/n and j*t/n there are n - j + 1 above.
    """
    looked = []
    monkeypatch.setattr(_Trees, "leaf", lambda own, term: looked.append(term) or leaf(own, term))
    below = " + ".join(f"{0.1 / n!r}*[x < {k / n!r}*t]" for k in range(1, n + 1))
    answer = potto.deriv(potto.compile(f"def f(t) integral [0, 1] [x + {below} < t] d(x)").f)((0.5, 1.0))

    def area(t: Fraction) -> Fraction:
        ends = [Fraction(k / n) * t for k in range(n + 1)]
        tops = [t - Fraction(0.1 / n) * (n - j) for j in range(n)]
        return sum((max(min(b, top) - a, Fraction(0)) for a, b, top in zip(ends, ends[1:], tops, strict=False)), H * 0)

    covered(answer, area(Fraction(0.5)))
    covered(answer, rate(area, 0.5), tangent=True)
    assert len(looked) <= 30 * n


def test_too_many_cases_are_told() -> None:
    """A step that is not affine, 9 times: no proof says which sides are empty."""
    text = """
def step(s, t) if [s < t] then s + 0.2*cos(s) else s*s
def sim(n, s, t) if n > 0 then sim(n - 1, step(s, t), t) else s
def f(t) integral [0, 1] sim(9, x, t) d(x)
"""
    with potto.settings(max_evals=20_000):
        answer = potto.compile(text).f(0.5)
    assert not answer.converged and math.isinf(answer.error)
    assert any("conditions inside of conditions" in reason for reason in answer.reasons)


# Behind another condition, and such as are decided by the bounds alone; the expected values are lengths by hand


@pytest.mark.parametrize(
    ("condition", "low", "length", "slope"),
    [
        ("x > 0.2 and [x > t] > 0.5", 0.1, 1.5 - 0.7, -1.0),
        ("x < 0.2 or x + [x > t] > 1.8", 0.1, 0.1 + 1.5 - 0.8, 0.0),
        ("x > t and x + [x > t] > 1.5", 0.1, 1.5 - 0.7, -1.0),
        ("[min(x, 0.175) > 0.25] > 0.5", 1.0, 0.0, 0.0),
        ("[min(x, 0.175) < 0.25] > 0.5", 1.0, 0.5, 0.0),
    ],
)
def test_behind_others_or_decided(condition: str, low: float, length: float, slope: float) -> None:
    f = potto.compile(f"def f(t) integral [{low}, 1.5] [{condition}] d(x)").f
    answer = potto.deriv(f)((0.7, 1.0))
    covered(answer, length, rtol=2 * EPS)  # the lengths themselves are differences of rounded numbers
    covered(answer, slope, tangent=True)


# Plans for many parameters


@pytest.fixture
def plans(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The plans that are made from here on."""
    made: list[Any] = []
    monkeypatch.setattr(problem, "make", lambda *args: made.append(make(*args)) or made[-1])
    return made


def test_a_condition_on_an_indicator_has_one_plan(plans: list[Any]) -> None:
    """As many cases as brackets: none is left out, so that what is planned for the first holds for all of them."""
    f = potto.compile("def f(t) integral [0, 1] [[x > t and x < 2*t] > 0]*x d(x)").f
    t = np.array([-1.0, 0.2, 0.3, 0.6, 0.9, 1.5])
    answer = potto.deriv(f)((t, np.ones(6)))
    low, high = np.clip(t, 0, 1), np.clip(2 * t, 0, 1)
    assert np.abs(answer.value - (high**2 - low**2) / 2).max() <= 1e-15  # two roundings of numbers below 1
    assert answer.tangent == pytest.approx([0, 4 * 0.2 - 0.2, 4 * 0.3 - 0.3, -0.6, -0.9, 0], abs=1e-15)
    assert len(plans) == 1 and plans[0].premise is None


def test_plans_of_several_cases_are_made_once(plans: list[Any]) -> None:
    """No one plan holds for all of these; what each of them met is known when they come again."""
    f = potto.deriv(potto.compile(SIMULATION.format(n=3)).f)
    t = np.array([0.05, 0.3, 0.437, 0.5, 0.713, 0.95])
    first = f((t, np.ones(6)))
    known = len(plans)
    again = f((t, np.ones(6)))
    assert known > 1 and len(plans) == known
    assert (again.value == first.value).all() and (again.tangent == first.tangent).all()
    for at, value in zip(t, first.value, strict=True):
        assert value == pytest.approx(float(thermostat(3, Fraction(at))), abs=1e-14)


@pytest.mark.parametrize("inner", ["t*(if [y > 0.3] then y else 0)", "(if [y > 0.3] then t*y else 0)", "t*y*[y > 0.3]"])
def test_a_bracket_on_what_is_not_known_yet(inner: str) -> None:
    """Strips y - s*t*y < x < y, s = 0 below 0.3: that had asked for the sign of nan, as 0 times the unknown t."""
    f = potto.compile(f"def f(t) integral ([0, 1], [-3, 3]) [x < y]*[x > y - {inner}] d(y, x)").f
    answer = potto.deriv(f)((0.1, 1))
    covered(answer, Fraction(91, 2000))
    covered(answer, Fraction(91, 200), tangent=True)
