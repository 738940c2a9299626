"""Neighbours of the hard cases: the other quantity, the other side of a limit, another weight. Closed forms by mpmath.

A row says what is integrated, where, what by, and the answer as a formula of 50 digits. Every error must cover, and
every answer must be as accurate as the row says (relative to the answer; absolute where it is 0). Long, as a table is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mpmath as mp
import pytest

import potto

EPS = 2.0**-52
inf = float("inf")


@dataclass(frozen=True)
class Row:
    """An integral `text` of parameters, where it is asked for, by which parameter (or the value), and the answer."""

    name: str
    text: str
    at: dict[str, float]
    by: str | None
    exact: Callable[..., Any]
    rtol: float = 1e-12
    note: bool = False  # a surface lies on a bound: the one-sided derivatives are told


def line(body: str, lo: str = "0", hi: str = "1") -> str:
    return f"integral [{lo}, {hi}] {body} d(x)"


def square(body: str, side: str = "[0, 1]") -> str:
    return f"integral ({side}, {side}) {body} d(x, y)"


def triangle(c: Any) -> Any:
    """The area of x + y + c >= 0 in the unit square."""
    return 1 if c >= 0 else 1 - c * c / 2 if c >= -1 else (2 + c) ** 2 / 2 if c >= -2 else 0


def lens(r: Any) -> Any:
    """The area of the disc of radius r in the square [-1, 1]^2, 1 <= r <= sqrt 2."""
    return mp.pi * r * r - 4 * (r * r * mp.acos(1 / r) - mp.sqrt(r * r - 1))


def lens_rate(r: Any) -> Any:
    return 2 * mp.pi * r - 8 * r * mp.acos(1 / r)


def normal(t: Any) -> Any:
    return mp.ncdf(t)


def simplex(t: Any, n: int) -> Any:
    """The volume of x1 + ... + xn <= t in the unit cube (Irwin and Hall)."""
    return sum((-1) ** k * mp.binomial(n, k) * (t - k) ** n for k in range(int(t) + 1)) / mp.factorial(n)


def density(t: Any, n: int) -> Any:
    return sum((-1) ** k * mp.binomial(n, k) * (t - k) ** (n - 1) for k in range(int(t) + 1)) / mp.factorial(n - 1)


def peak(t: Any) -> Any:
    s = mp.mpf(1e-6)
    m = mp.mpf(0.3)
    return (mp.erf((t - m) / s / mp.sqrt(2)) + mp.erf(m / s / mp.sqrt(2))) / 2


def roots_of_wave(t: Any) -> Any:
    """The length of sin(40 pi x) >= t in [0, 1]: twenty times (1/2 - asin(t)/pi)/20."""
    return mp.mpf(1) / 2 - mp.asin(t) / mp.pi


STEP = "[x <= t]"
ROWS = [
    Row("on the lower bound", line(STEP), {"t": 0.0}, "t", lambda t: 0, note=True),
    Row("an ulp past the upper bound", line(STEP), {"t": 1 + EPS}, "t", lambda t: 0),
    Row("the least number inside", line(STEP), {"t": 5e-324}, "t", lambda t: 1),
    Row("the least normal number inside, value", line(STEP), {"t": 2.0**-1022}, None, lambda t: t, 1e-12),
    Row("far outside", line(STEP), {"t": -1e300}, "t", lambda t: 0),
    Row("through two corners", square("[x + y + c >= 0]"), {"c": -1.0}, "c", lambda c: 1),
    Row("just before a corner", square("[x + y + c >= 0]"), {"c": -1e-12}, "c", lambda c: -c, 1e-12),
    Row("just before a corner, value", square("[x + y + c >= 0]"), {"c": -1e-12}, None, triangle),
    Row("near the far corner, value", square("[x + y + c >= 0]"), {"c": -1.9999999925494194}, None, triangle, 1e-7),
    Row("a disc within", square("[r^2 - x^2 - y^2 >= 0]", "[-1, 1]"), {"r": 0.7}, None, lambda r: mp.pi * r * r),
    Row(
        "a disc just within",
        square("[r^2 - x^2 - y^2 >= 0]", "[-1, 1]"),
        {"r": 1 - 1e-12},
        "r",
        lambda r: 2 * mp.pi * r,
    ),
    Row("a disc past the sides", square("[r^2 - x^2 - y^2 >= 0]", "[-1, 1]"), {"r": 1.2}, None, lens),
    Row("a disc past the sides, rate", square("[r^2 - x^2 - y^2 >= 0]", "[-1, 1]"), {"r": 1.2}, "r", lens_rate),
    Row("a disc just past the sides, value", square("[r^2 - x^2 - y^2 >= 0]", "[-1, 1]"), {"r": 1 + 1e-12}, None, lens),
    Row("a disc past the corners", square("[r^2 - x^2 - y^2 >= 0]", "[-1, 1]"), {"r": 1.5}, "r", lambda r: 0),
    Row(
        "an ellipse far from round",
        square("[1 - (x/a)^2 - (100*y)^2 >= 0]", "[-1, 1]"),
        {"a": 0.5},
        "a",
        lambda a: mp.pi / 100,
    ),
    Row("a hyperbola, value", square("[x*y <= t]"), {"t": 0.1}, None, lambda t: t - t * mp.log(t)),
    Row("a hyperbola near its saddle, value", square("[x*y <= t]"), {"t": 2.0**-40}, None, lambda t: t - t * mp.log(t)),
    Row("a fold, value", line("[(x - 0.5)^2 <= t]"), {"t": 2.0**-40}, None, lambda t: 2 * mp.sqrt(t), 1e-9),
    Row("a cubic, value", line("[x^3 <= t]", "-1"), {"t": 2.0**-60}, None, lambda t: 1 + mp.cbrt(t)),
    Row("a parabola", square("[y >= x^2 - t]"), {"t": 0.25}, "t", lambda t: mp.sqrt(1 + t) * 0 + 1 - mp.sqrt(t)),
    Row("opposite deltas that cancel", line("(2*[x <= t] + 2*[x > t])"), {"t": 0.5}, "t", lambda t: 0),
    Row(
        "opposite deltas that nearly cancel",
        line("(exp(x)*[x <= t] - exp(x)*[x <= t - e])"),
        {"t": 0.5, "e": 1e-9},
        "t",
        lambda t, e: mp.exp(t) - mp.exp(t - e),
        1e-6,
    ),
    Row(
        "a sliver's width",
        square("exp(x)*[x >= y]*[y - x + w >= 0]"),
        {"w": 2.0**-33},
        "w",
        lambda w: mp.exp(1) - mp.exp(w),
    ),
    Row("coincident, three times", line("([x <= t] + [x <= t])*[x <= t]^2"), {"t": 0.5}, "t", lambda t: 2),
    Row("along the outer variable", square("exp(x*y)*[x <= t]"), {"t": 0.5}, "t", lambda t: mp.expm1(t) / t),
    Row("nearly along an axis", square("[y + 1e-12*x <= t]"), {"t": 0.5}, "t", lambda t: 1),
    Row("nearly along the other", square("[x + 1e-12*y <= t]"), {"t": 0.5}, "t", lambda t: 1),
    Row(
        "a condition a hundred and sixty orders larger",
        line("x*[s*(t - x) >= 0]"),
        {"t": 0.3, "s": 1e160},
        "t",
        lambda t, s: t,
    ),
    Row("by the scale of a condition", line("x*[s*(t - x) >= 0]"), {"t": 0.3, "s": 1e-160}, "s", lambda t, s: 0),
    Row(
        "a rotation, a little turned",
        square("[x*cos(h) + y*sin(h) <= 0.5]"),
        {"h": 1e-9},
        "h",
        lambda h: (0.5 * mp.sin(h) - 0.5) / mp.cos(h) ** 2,
    ),
    Row("a huge box, value", line(STEP, hi="1e150"), {"t": 1e149}, None, lambda t: t),
    Row("a tiny box, value", square("[x + y <= t]", "[0, 1e-150]"), {"t": 1e-150}, None, lambda t: t * t / 2),
    Row("a tiny box in one dimension", line(STEP, hi="1e-300"), {"t": 3e-301}, "t", lambda t: 1),
    Row(
        "far from 0, value",
        line("exp(x - 1e8)*[x <= t]", "1e8", "1e8 + 1"),
        {"t": 1e8 + 0.5},
        None,
        lambda t: mp.expm1(t - 10**8),
    ),
    Row("a mean of x", line("x*[x <= t]/t"), {"t": 0.3}, "t", lambda t: mp.mpf(1) / 2),
    Row("a root's pole, rate", line("[x <= t]/sqrt(x)"), {"t": 0.3}, "t", lambda t: 1 / mp.sqrt(t)),
    Row("a strong pole", line("x^(-0.9)*[x <= t]"), {"t": 0.3}, None, lambda t: 10 * t ** mp.mpf("0.1"), 1e-9),
    Row("a logarithm", line("log(x)*[x <= t]"), {"t": 0.3}, None, lambda t: t * mp.log(t) - t),
    Row("a logarithm, rate", line("log(x)*[x <= t]"), {"t": 0.3}, "t", lambda t: mp.log(t)),
    Row("an infinite jump, value", line("[x < t]/sqrt(t - x)"), {"t": 0.3}, None, lambda t: 2 * mp.sqrt(t)),
    Row(
        "a root past the jump, value",
        line("[x > t]*sqrt(x - t)"),
        {"t": 0.3},
        None,
        lambda t: 2 * (1 - t) ** mp.mpf(1.5) / 3,
    ),
    Row("a logarithm past the jump", line("[x > t]*log(x - t)"), {"t": 0.3}, "t", lambda t: -mp.log(1 - t)),
    Row(
        "what overflows is not taken",
        line("(if [x >= t] then 1 else exp(10000*(x - t)))"),
        {"t": 0.5},
        None,
        lambda t: 1 - t - mp.expm1(-10000 * t) / 10000,
    ),
    Row("fast waves, rate", line("sin(1000*x)*[x <= t]"), {"t": 0.7}, "t", lambda t: mp.sin(1000 * t), 1e-11),
    Row("forty surfaces, value", line("[sin(40*pi*x) >= t]"), {"t": 0.3}, None, roots_of_wave),
    Row(
        "a narrow peak, value",
        line("exp(-((x - 0.3)/1e-6)^2/2)/(1e-6*sqrt(2*pi))*[x <= t]"),
        {"t": 0.3},
        None,
        peak,
        1e-9,
    ),
    Row(
        "a narrow peak cut off its center",
        line("exp(-((x - 0.3)/1e-6)^2/2)/(1e-6*sqrt(2*pi))*[x <= t]"),
        {"t": 0.300001},
        None,
        peak,
        1e-9,
    ),
    Row(
        "a steep sigmoid, rate",
        line("[x <= t]/(1 + exp(-10000*(x - 0.5)))"),
        {"t": 0.5001},
        "t",
        lambda t: 1 / (1 + mp.exp(-10000 * (t - 0.5))),
    ),
    Row(
        "a simplex, value",
        "integral ([0,1], [0,1], [0,1]) [x + y + z <= t] d(x, y, z)",
        {"t": 1.25},
        None,
        lambda t: simplex(t, 3),
    ),
    Row(
        "a simplex in four",
        "integral ([0,1], [0,1], [0,1], [0,1]) [x + y + z + w <= t] d(x, y, z, w)",
        {"t": 1.75},
        "t",
        lambda t: density(t, 4),
        1e-2,
    ),
    Row(
        "a sphere in a cube, value",
        "integral ([-1,1], [-1,1], [-1,1]) [x^2 + y^2 + z^2 <= r^2] d(x, y, z)",
        {"r": 1.1},
        None,
        lambda r: 4 * mp.pi * r**3 / 3 - 6 * mp.pi * (r - 1) ** 2 * (2 * r + 1) / 3,
    ),
    Row("bounds and jump, value", line("exp(x)*[x <= t/2]", hi="t^2"), {"t": 0.6}, None, lambda t: mp.expm1(t / 2)),
    Row("a bound alone", line("exp(x)*[x <= t/2]", hi="t^2"), {"t": 0.3}, "t", lambda t: 2 * t * mp.exp(t * t)),
    Row("turned bounds", line("exp(x)*[x <= t]", "1", "0"), {"t": 0.5}, "t", lambda t: -mp.exp(t)),
    Row("a normal tail, value", line("exp(-x^2/2)/sqrt(2*pi)*[x <= t]", "-inf", "inf"), {"t": 1.5}, None, normal),
    Row("a far normal tail", line("exp(-x^2/2)/sqrt(2*pi)*[x <= t]", "-inf", "inf"), {"t": -20.0}, None, normal, 1e-9),
    Row(
        "a normal in the plane, value",
        "integral ([-inf, inf], [-inf, inf]) exp(-(x^2 + y^2)/2)/(2*pi)*[x + y <= t] d(x, y)",
        {"t": 0.8},
        None,
        lambda t: normal(t / mp.sqrt(2)),
    ),
    Row(
        "an exponential tail, value",
        line("exp(-x)*[x >= t]", hi="inf"),
        {"t": 700.0},
        None,
        lambda t: mp.exp(-t),
        1e-11,
    ),
    Row(
        "Cauchy",
        line("[x <= t]/(pi*(1 + x^2))", "-inf", "inf"),
        {"t": 3.0},
        None,
        lambda t: mp.atan(t) / mp.pi + mp.mpf(1) / 2,
    ),
    Row("a maximum", line("max(x, t)"), {"t": 0.3}, "t", lambda t: t),
    Row("a plain condition that fails", line("(if t > 0 then [x <= t] else 7)"), {"t": -0.5}, "t", lambda t: 0),
    Row("a square of a sum", line("(x + [x <= t])^2"), {"t": 0.5}, None, lambda t: mp.mpf(1) / 3 + t * t + t),
    Row(
        "hemisphere",
        square("(if [x^2+y^2 <= r^2] then sqrt(r^2-x^2-y^2) else 0)", "[-1, 1]"),
        {"r": 0.8},
        None,
        lambda r: 2 * mp.pi * r**3 / 3,
        1e-10,
    ),
    Row(
        "hemisphere rate",
        square("(if [x^2+y^2 <= r^2] then sqrt(r^2-x^2-y^2) else 0)", "[-1, 1]"),
        {"r": 0.8},
        "r",
        lambda r: 2 * mp.pi * r**2,
        1e-8,
    ),
    Row(
        "root of distance",
        line("sqrt(abs(x - t))"),
        {"t": 0.3},
        None,
        lambda t: 2 * (t**1.5 + (1 - t) ** mp.mpf(1.5)) / 3,
        1e-10,
    ),
    Row(
        "root of distance rate", line("sqrt(abs(x - t))"), {"t": 0.3}, "t", lambda t: mp.sqrt(t) - mp.sqrt(1 - t), 1e-8
    ),
    Row("corner log", square("log(x+y)"), {"t": 0.3}, None, lambda t: 2 * mp.log(2) - mp.mpf(3) / 2, 1e-9),
    Row(
        "moving gaussian",
        line("exp(-1000000*(x - t)^2)", "-1"),
        {"t": 0.1234},
        None,
        lambda t: mp.sqrt(mp.pi) / 1000,
        1e-10,
    ),
    Row("moving gaussian rate", line("exp(-1000000*(x - t)^2)", "-1"), {"t": 0.1234}, "t", lambda t: mp.mpf(0), 1e-10),
    Row("slow tail", line("x^(-1.1)", "1", "inf"), {"t": 0.1}, None, lambda t: mp.mpf(1) / (mp.mpf(1.1) - 1), 1e-9),
    Row(
        "fat tails",
        line("(1+x^2)^(-0.6)", "-inf", "inf"),
        {"t": 0.1},
        None,
        lambda t: mp.sqrt(mp.pi) * mp.gamma(mp.mpf(0.6) - 0.5) / mp.gamma(mp.mpf(0.6)),
        1e-8,
    ),
    Row("pole beyond a jump", line("(if [x >= t] then 1/x else 0)"), {"t": 0.3}, "t", lambda t: -1 / t),
    Row(
        "a wave's area",
        square("[y >= t*(sin(10*x)+1)]"),
        {"t": 0.3},
        None,
        lambda t: 1 - t * (1 + (1 - mp.cos(10)) / 10),
    ),
    Row(
        "a wave's area rate", square("[y >= t*(sin(10*x)+1)]"), {"t": 0.3}, "t", lambda t: -(1 + (1 - mp.cos(10)) / 10)
    ),
    Row("two lines that cross", square("[x + y <= 1]*[x - y <= t]"), {"t": 0.2}, "t", lambda t: (1 - t) / 2),
    Row(
        "two lines at a small angle",
        square("[y <= 0.5 + 0.001*(x - t)]*[y >= 0.5 - 0.001*(x - t)]"),
        {"t": 0.2},
        "t",
        lambda t: -2 * mp.mpf(0.001) * (1 - t),
        1e-10,
    ),
    Row(
        "five brackets",
        line("exp(x)*[x>=t]*[x<=t+0.5]*[x>=2*t-0.3]*[x<=3*t]*[x>=t/2]"),
        {"t": 0.2},
        "t",
        lambda t: 3 * mp.exp(3 * t) - mp.exp(t),
        1e-12,
    ),
    Row("exp of an integral", "exp(integral [0,1] x*[x <= t] d(x))", {"t": 0.6}, "t", lambda t: t * mp.exp(t * t / 2)),
    Row(
        "integral of a square of an integral",
        "integral [0,1] (integral [0,1] [y <= t*x] d(y))^2 d(x)",
        {"t": 0.6},
        "t",
        lambda t: 2 * t / 3,
    ),
    Row(
        "kink inside",
        line("(integral [0,1] abs(y - t*x) d(y))"),
        {"t": 0.6},
        "t",
        lambda t: 2 * t / 3 - mp.mpf(1) / 2 + mp.mpf(0),
    ),
    Row("moving bounds in two", "integral ([0, t], [0, x]) exp(x - y) d(x, y)", {"t": 0.7}, "t", lambda t: mp.expm1(t)),
    Row("moving bounds, jump", "integral ([0, t], [0, x]) [x + y <= 1] d(x, y)", {"t": 0.7}, "t", lambda t: 1 - t),
    Row(
        "atan step",
        line("atan(1000000*(x - t))"),
        {"t": 0.3},
        "t",
        lambda t: -(mp.atan(1000000 * (1 - t)) + mp.atan(1000000 * t)),
        1e-9,
    ),
    Row(
        "tanh step value",
        line("tanh(10000*(x - t))"),
        {"t": 0.3},
        None,
        lambda t: (mp.log(mp.cosh(10000 * (1 - t))) - mp.log(mp.cosh(10000 * t))) / 10000,
        1e-9,
    ),
    Row(
        "erf step",
        line("erf(100000*(x - t))"),
        {"t": 0.3},
        "t",
        lambda t: -(mp.erf(100000 * (1 - t)) + mp.erf(100000 * t)),
        1e-9,
    ),
    Row("min of three", line("min(min(x, t), 1 - x)"), {"t": 0.3}, "t", lambda t: 1 - 2 * t),
    Row("sum of brackets", line("(sum k in 1..5 (k*[x <= t/k]))"), {"t": 0.6}, "t", lambda t: mp.mpf(5)),
    Row(
        "cos(1/x)",
        line("cos(1/x)", "t", "1"),
        {"t": 0.01},
        None,
        lambda t: mp.quad(lambda u: mp.cos(u) / u**2, mp.linspace(1, 1 / t, 60)),
        1e-9,
    ),
    Row(
        "boundary layers",
        line("exp(-x/e) + exp(-(1-x)/e)"),
        {"e": 1e-7},
        None,
        lambda e: 2 * e * (1 - mp.exp(-1 / e)),
        1e-9,
    ),
    Row("layers rate", line("exp(-x/e)"), {"e": 1e-7}, "e", lambda e: mp.mpf(1), 1e-8),
    Row("runge", line("1/(1+(25*x)^2)", "-1"), {"t": 1.0}, None, lambda t: 2 * mp.atan(25) / 25),
    Row(
        "runge narrow",
        line("1/(1+(1000000*(x-t))^2)", "-1"),
        {"t": 0.3},
        None,
        lambda t: (mp.atan(1000000 * (1 - t)) + mp.atan(1000000 * (1 + t))) / 1000000,
        1e-10,
    ),
    Row("quartic root", line("[x^4 <= t]", "-1"), {"t": 0.0001}, "t", lambda t: 2 * mp.mpf(1) / 4 * t ** mp.mpf(-0.75)),
    Row("exp surface", line("[exp(x) <= t]"), {"t": 2.0}, "t", lambda t: 1 / t),
    Row(
        "implicit surface 2d",
        square("[x + y + 0.1*sin(x*y) <= t]"),
        {"t": 0.8},
        None,
        lambda t: mp.quad(
            lambda x: max(
                mp.mpf(0), min(mp.mpf(1), mp.findroot(lambda y: x + y + mp.mpf(0.1) * mp.sin(x * y) - t, 0.4))
            ),
            [0, t],
        ),
        1e-9,
    ),
    Row(
        "ellipse rotated",
        square("[x^2 + x*y + y^2 <= r^2]", "[-2, 2]"),
        {"r": 0.9},
        "r",
        lambda r: 4 * mp.pi * r / mp.sqrt(3),
        1e-11,
    ),
    Row(
        "lens of two discs",
        square("[x^2+y^2 <= 1]*[(x-t)^2+y^2 <= 1]", "[-2, 2]"),
        {"t": 1.0},
        None,
        lambda t: 2 * mp.acos(t / 2) - t / 2 * mp.sqrt(4 - t * t),
        1e-11,
    ),
    Row(
        "lens rate",
        square("[x^2+y^2 <= 1]*[(x-t)^2+y^2 <= 1]", "[-2, 2]"),
        {"t": 1.0},
        "t",
        lambda t: -mp.sqrt(4 - t * t),
        1e-10,
    ),
    Row(
        "annulus",
        square("([x^2+y^2 <= r^2] - [x^2+y^2 <= r^2/4])", "[-1, 1]"),
        {"r": 0.9},
        "r",
        lambda r: 2 * mp.pi * r * mp.mpf(3) / 4,
        1e-11,
    ),
    Row(
        "cone", "integral ([-1,1],[-1,1],[0,1]) [x^2+y^2 <= z^2*t] d(x,y,z)", {"t": 0.5}, "t", lambda t: mp.pi / 3, 1e-9
    ),
    Row(
        "tetra",
        "integral ([0,1],[0,1-x],[0,1-x-y]) [z <= t] d(x,y,z)",
        {"t": 0.3},
        "t",
        lambda t: (1 - t) ** 2 / 2,
        1e-11,
    ),
]


@pytest.mark.parametrize("row", ROWS, ids=lambda r: r.name)
def test_the_error_covers_and_the_answer_is_as_accurate_as_it_should_be(row: Row) -> None:
    m = potto.compile(f"def f({', '.join(row.at)}) {row.text}\n")
    if row.by is None:
        answer = m.f(*row.at.values())
        got, error = answer.value, answer.error
    else:
        answer = potto.deriv(m.f)(*((v, 1.0 if n == row.by else 0.0) for n, v in row.at.items()))
        got, error = answer.tangent, answer.tangent_error
    with mp.workdps(50):
        exact = mp.mpf(row.exact(*(mp.mpf(v) for v in row.at.values())))
        off = float(abs(mp.mpf(got) - exact))
        size = float(abs(exact))
    assert off <= error + EPS * size + 5e-324, f"{got!r} is off by {off:.1e}, its error is said to be {error:.1e}"
    assert off <= (row.rtol * size if size else 1e-15), f"{got!r}, not {float(exact)!r}: off by {off / (size or 1):.1e}"
    assert bool(answer.notes) == row.note
    assert answer.evals <= 20_000_000


@pytest.mark.parametrize("x", [1e-6, 7.8e-5, 2.1421029343956044e-4, 2.5e-4, 1e-3, 1e-2])
def test_a_smooth_corner_beside_a_polynomial_is_not_taken_for_one(x: float) -> None:
    # sqrt(x^2 + y^2) is nearly |y|: what is left of it at a graded piece hides behind the end of a polynomial
    f = potto.compile("def f(x, r) integral [-2, 2] (if diffeo(r - hypot(x, y)) then hypot(x, y) else 0) d(y)").f
    with mp.workdps(30):
        height = mp.sqrt(mp.mpf(0.25) - mp.mpf(x) ** 2)
        exact = height / 2 + mp.mpf(x) ** 2 * mp.asinh(height / mp.mpf(x))
    found = f(x=x, r=0.5)
    assert abs(found.value - exact) <= found.error <= 1e-7


@pytest.mark.parametrize("r", [0.30103008747109183, 0.5, 0.8570169324674892])
def test_the_mean_radius_of_a_disc_is_covered(r: float) -> None:
    text = "integral ([-2, 2], [-2, 2]) (if diffeo(r - hypot(x, y)) then hypot(x, y) else 0) d(x, y)"
    found = potto.compile(f"def f(r) {text}").f(r=r)
    assert abs(found.value - 2 * mp.pi * mp.mpf(r) ** 3 / 3) <= found.error <= 1e-7
