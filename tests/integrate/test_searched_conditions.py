"""Conditions without closed-form roots, accepted in definitions: values and derivatives against mpmath.

The reference finds every root by the sign of the condition on a fine grid and by the turning points between, refined by
bisection to 30 digits. What is integrated has an antiderivative in closed form.

Tolerance: every answer must lie within its reported error plus 64 ulp of what is added up; converged answers must be
right to 1e-10.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable
from typing import Any

import mpmath as mp
import pytest
from references.tools import roots

import potto

EPS = 2.0**-52
NODES = 1500  # of the grid on which the reference looks for sign changes and turns
Function = Callable[[Any, Any], Any]


def polynomial(draw: random.Random) -> tuple[str, Function]:
    c = [draw.uniform(-2, 2) for _ in range(draw.randint(4, 6))]
    text = " + ".join(f"{a!r}*x^{n}" for n, a in enumerate(c, 1))
    return text, lambda x, t: mp.fsum(a * x**n for n, a in enumerate(c, 1)) - t


def waves(draw: random.Random) -> tuple[str, Function]:
    a, b = draw.uniform(0.5, 2), draw.uniform(0.5, 2)
    w, v = draw.uniform(1, 6), draw.uniform(1, 6)
    return (
        f"{a!r}*cos({w!r}*x) + {b!r}*sin({v!r}*x) + x/3",
        lambda x, t: a * mp.cos(w * x) + b * mp.sin(v * x) + x / 3 - t,
    )


def damped(draw: random.Random) -> tuple[str, Function]:
    a, b, c = (draw.uniform(-2, 2) for _ in range(3))
    k = draw.uniform(0.5, 2)
    return (
        f"({a!r} + {b!r}*x + {c!r}*x^2)*exp(-{k!r}*x)",
        lambda x, t: (a + b * x + c * x**2) * mp.exp(-k * x) - t,
    )


def with_bracket(draw: random.Random) -> tuple[str, Function]:
    text, function = polynomial(draw)
    jump, at = draw.uniform(-1, 1), draw.uniform(-0.5, 0.5)
    return f"{text} + {jump!r}*[x < {at!r}]", lambda x, t: function(x, t) + jump * (x < at)


KINDS = {"polynomial": polynomial, "waves": waves, "damped": damped, "with a bracket": with_bracket}
LO, HI = -1.0, 1.5


def bisected(f: Callable[[Any], Any], a: Any, b: Any) -> Any:
    sign = mp.sign(f(a))
    for _ in range(110):
        middle = (a + b) / 2
        a, b = (middle, b) if mp.sign(f(middle)) == sign else (a, middle)
    return (a + b) / 2


@mp.workdps(34)
def truth(function: Function, t: float) -> tuple[Any, Any, Any]:
    """The integral of exp(x) where function(x, t) < 0, its derivative by t, and the size of what is added up."""

    def f(x: Any) -> Any:
        return function(x, mp.mpf(t))

    cuts = roots(f, LO, HI, NODES, bisected)
    ends = [mp.mpf(LO), *cuts, mp.mpf(HI)]
    value = mp.mpf(0)
    for a, b in itertools.pairwise(ends):
        if f((a + b) / 2) < 0:
            value += mp.exp(b) - mp.exp(a)
    h = mp.mpf(10) ** -12
    slopes = [(f(x + h) - f(x - h)) / (2 * h) for x in cuts]
    parts = [mp.exp(x) / abs(s) if abs(s) < 1e9 else mp.mpf(0) for x, s in zip(cuts, slopes, strict=True)]
    return value, mp.fsum(parts), mp.fsum(abs(p) for p in parts)


def inside(found: float, error: float, exact: Any, size: Any) -> bool:
    return abs(found - exact) <= error + 64 * EPS * max(1, float(size))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(6))
def test_random_conditions(kind: str, seed: int) -> None:
    draw = random.Random(f"{kind} {seed}")
    for _ in range(3):
        text, function = KINDS[kind](draw)
        t = draw.uniform(-1, 1)
        f = potto.compile(f"def f(t) integral [{LO}, {HI}] exp(x)*[{text} < t] d(x)").f
        value, rate, size = truth(function, t)
        answer = potto.deriv(f)((t, 1.0))
        assert inside(answer.value, answer.error, value, 4), (text, t, answer, value)
        assert inside(answer.tangent, answer.tangent_error, rate, size), (text, t, answer, rate)
        assert answer.converged, (text, t, answer.reasons)
        assert answer.value == pytest.approx(float(value), rel=1e-10, abs=1e-12)


TWO = [
    # what folds where no formula says so: the answers of both orders of the variables must be told apart by their bars
    "0.979*y^2 + 0.612*y^3 - 1.094*x + 0.089*x*y^2 - 1.158*x^2 + 0.868*x^2*y^2 - 0.451*x^3 + 0.691*x^3*y",
    "x^3 - x + y^5 + y",
    "x^2*y + y^3*x + x",
    "x*exp(y) + y*exp(x)",
    "sin(3*x*y) + x^2",
]


@pytest.mark.parametrize("text", TWO)
@pytest.mark.parametrize("t", [-0.5424839629313064, 0.2])
def test_two_variables_in_both_orders(text: str, t: float) -> None:
    square = "integral ([-1, 1], [-1, 1])"
    one, other = (potto.compile(f"def f(t) {square} [{text} < t] d({o})").f(t) for o in ("x, y", "y, x"))
    assert abs(one.value - other.value) <= one.error + other.error


@pytest.mark.parametrize(
    "program",
    [
        "def f(t) integral [-1, 1] [x^3 - x < t]*x d(x)",
        "def cubic(x) x^3 - x\ndef area(g, t) integral [-1, 1] [g(x) < t]*x d(x)\ndef f(t) area(cubic, t)",
        "def area(g, t) integral [-1, 1] [g(x) < t]*x d(x)\ndef f(t) area(\\x . x^3 - x, t)",
        "def below(u, t) [u^3 - u < t]\ndef f(t) integral [-1, 1] below(x, t)*x d(x)",
        "def f(t) integral [-1, 1] (if [x^3 - x < t] then x else 0) d(x)",
        "def f(t) integral [1, -1] -[not (x^3 - x >= t)]*x d(x)",
        "def h(p) integral [-1, 1] [x^3 - fst p*x < snd p]*x d(x)\ndef f(t) h((1, t))",
        "def w(t) integral [-1, 1] [x^3 - x < t]*x d(x)\ndef f(t) fst(deriv(w)((t, 1)))",
    ],
)
def test_however_it_is_written(program: str) -> None:
    """x^3 - x < 0.1 outside of the two lower roots in [-1, 1] and below the third, which lies beyond 1."""
    t = 0.1
    a, b = sorted(float(r.real) for r in mp.polyroots([1, 0, -1, -t]))[:2]
    exact = ((a * a - 1) + (1 - b * b)) / 2
    if "deriv" in program:
        answer = potto.compile(program).f(t)
    else:
        answer = potto.deriv(potto.compile(program).f)((t, 1.0))
        rate = a / abs(3 * a * a - 1) + b / abs(3 * b * b - 1)
        assert abs(answer.tangent - rate) <= answer.tangent_error + 64 * EPS
    assert abs(answer.value - exact) <= answer.error + 16 * EPS and answer.converged


@pytest.mark.parametrize("n", [1, 2, 4, 9])
@pytest.mark.parametrize("given", ["1..{n}", "1..n"])
def test_a_sum_in_a_condition_is_the_sum_written_out(n: int, given: str) -> None:
    """Partial sums of a sawtooth, with as many roots as they have turns."""
    written = " + ".join(f"sin({k}*x)/{k}" for k in range(1, n + 1))
    summed = f"sum k in {given.format(n=n)} (sin(k*x)/k)"
    for condition in (f"{summed} < t", f"t > {summed} + (if n > 3 then 0 else 0*x)"):
        f = potto.compile(f"def f(t, n) integral [0, 6] [{condition}]*exp(-x/3) d(x)").f
        g = potto.compile(f"def f(t) integral [0, 6] [{written} < t]*exp(-x/3) d(x)").f
        one, other = potto.grad(f, "t")(0.3, n), potto.grad(g, "t")(0.3)
        assert abs(one.value - other.value) <= one.error + other.error
        assert abs(one.tangent - other.tangent) <= one.tangent_error + other.tangent_error
        assert one.converged and one.evals <= 2 * other.evals


@pytest.mark.parametrize("text", [
    "k = 0.3\ndef f(t) integral [0, 1] [sin(x) + x^2*t < k] d(x)",
    "half = 0.15\nk = 2*half\ndef below(x, t, q) [sin(x) + x^2*t < q]\ndef f(t) integral [0, 1] below(x, t, k) d(x)",
    "k = 0.6/2\ndef below(x, t) [sin(x) + x^2*t < k]\ndef f(t) integral [0, 1] below(x, t) d(x)",
])  # fmt: skip
def test_a_number_may_have_a_name(text: str) -> None:
    """The root r of the surface; t moves it by -r^2/(cos r + 2 t r)."""
    root = mp.findroot(lambda x: mp.sin(x) + x**2 / 2 - mp.mpf("0.3"), 0.27)
    found = potto.grad(potto.compile(text).f)(0.5)
    assert found.value == pytest.approx(float(root), rel=1e-14)
    assert found.tangent == pytest.approx(float(-(root**2) / (mp.cos(root) + root)), rel=1e-12)


_COMPARED = {
    "a name": "k = integral [0, 1] y*exp(y/2) d(y)\ndef f(t) integral [0, 1] [sin(x) + x^2*t < k] d(x)",
    "a call": "def f(t) integral [0, 1] [sin(x) + x^2*t < k(t)] d(x)",
    "written in": "def f(t) integral [0, 1] [sin(x) + x^2*t < (integral [0, 1] y*exp(t*y) d(y))] d(x)",
    "in arithmetic": "def f(t) integral [0, 1] [sin(x) + x^2*t - k(t)/2 < k(t)/2] d(x)",
    "behind a call": "def below(x, t) [sin(x) + x^2*t < k(t)]\ndef f(t) integral [0, 1] below(x, t) d(x)",
    "a parameter": "def g(t, q) integral [0, 1] [sin(x) + x^2*t < q(t)] d(x)\ndef f(t) g(t, k)",
    "a delta": "def f(t) integral [0, 1] delta(k(t) - sin(x) - x^2*t)*x d(x)",
    "guarded": "def f(t) integral [0, 1] (if t > 0 then [sin(x) + x^2*t < k(t)] else [x < 1/2]) d(x)",
}


def _level(t: Any) -> Any:
    """The integral of y exp(t y) over y in [0, 1]."""
    return (mp.exp(t) * (t - 1) + 1) / t**2


@pytest.mark.parametrize("how", _COMPARED)
def test_what_a_condition_compares_with_may_be_an_integral(how: str) -> None:
    """The root of the surface, or under a delta x over the surface's slope there; within 1e-12, and its derivatives."""
    text = f"def k(t) integral [0, 1] y*exp(t*y) d(y)\n{_COMPARED[how]}" if how != "a name" else _COMPARED[how]
    text += "\ndf = deriv(f)\ndef rate(t) snd(df((t, 1)))"

    def exact(t: Any) -> Any:
        level = _level(mp.mpf("0.5") if how == "a name" else t)
        root = mp.findroot(lambda x: mp.sin(x) + x**2 * t - level, 0.5)
        return root / (mp.cos(root) + 2 * t * root) if how == "a delta" else root

    module = potto.compile(text)
    one, two = potto.grad(module.f)(0.5), potto.grad(module.rate)(0.5)
    with mp.workdps(40):
        rates = [mp.diff(exact, mp.mpf("0.5"), n) for n in range(3)]
    assert one.converged and two.converged
    for found, error, rate in (
        (one.value, one.error, rates[0]), (one.tangent, one.tangent_error, rates[1]),
        (two.value, two.error, rates[1]), (two.tangent, two.tangent_error, rates[2]),
    ):  # fmt: skip
        assert abs(found - rate) <= error + 64 * EPS * abs(rate)
        assert found == pytest.approx(float(rate), rel=1e-12)
    many = module.f([0.25, 0.5, 0.75])
    assert all(abs(v - exact(mp.mpf(t))) < 1e-12 for v, t in zip(many.value, (0.25, 0.5, 0.75), strict=True))


def test_what_is_compared_is_found_only_where_it_is_asked_for() -> None:
    """The integral of 1/y^2 over [0, 1] is infinite, and nothing depends on it at t = 2. Within 4 ulp."""
    f = potto.compile(
        "def k(t) integral [0, 1] 1/y^t d(y)\n"
        "def f(t) integral [0, 1] (if t < 1 then [sin(x) + x^2/2 < k(t) - 1] else [x < 1/2]) d(x)"
    ).f
    assert abs(f(2).value - 0.5) <= 4 * EPS and f(2).converged


@pytest.mark.parametrize("t", [2.0, 3.0])
def test_metaballs_are_cut_where_their_halves_turn(t: float) -> None:
    """Of the roots y^2 of a quadratic one is c/q: where c is 0 the section turns, and few nodes do."""
    f = potto.compile(
        "def f(t) integral ([-2, 2], [-2, 2]) [1/(0.1 + (x-0.5)^2 + y^2) + 1/(0.1 + (x+0.5)^2 + y^2) > t] d(x, y)"
    ).f
    answer = potto.deriv(f)((t, 1.0))
    assert answer.converged and answer.evals < 3000
