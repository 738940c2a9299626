"""Deltas whose roots have no closed form: the value at the root over the slope there, and how it moves.

Answers by mpmath: the roots by bisection, derivatives by its central differences at 40 digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto


def at_roots(psi: Callable[[Any, Any], Any], weight: Callable[[Any, Any], Any], brackets: list[tuple[Any, Any]]) -> Any:
    """The sum of weight/|psi'| over the roots in brackets, as a function of the parameter."""

    def total(a: Any) -> Any:
        found = mp.mpf(0)
        for low, high in brackets:
            x = mp.findroot(lambda x: psi(x, a), (mp.mpf(low), mp.mpf(high)), solver="anderson", tol=1e-60)
            found += weight(x, a) / abs(mp.diff(lambda x: psi(x, a), x))
        return found

    return total


def cubic(x: Any, a: Any) -> Any:
    return x**3 + x - a


ONE = [(-1, 1)]
CASES: list[tuple[str, Callable[[Any], Any]]] = [
    ("integral [-1, 1] delta(x^3 + x - a) d(x)", at_roots(cubic, lambda x, a: 1, ONE)),
    ("integral [-1, 1] exp(x)*delta(x^3 + x - a) d(x)", at_roots(cubic, lambda x, a: mp.exp(x), ONE)),
    ("integral [-1, 1] exp(a*x)*delta(a - x^3 - x) d(x)", at_roots(cubic, lambda x, a: mp.exp(a*x), ONE)),
    ("integral [1, -1] exp(x)*delta(x^3 + x - a) d(x)", at_roots(cubic, lambda x, a: -mp.exp(x), ONE)),
    ("integral [-1, 1] (if [x > 0.1] then x else 2)*delta(x^3 + x - a) d(x)", at_roots(cubic, lambda x, a: x, ONE)),
    ("integral [-1, 1] (x + delta(x^3 + x - a)) d(x)", at_roots(cubic, lambda x, a: 1, ONE)),
    ("integral [-1, 1] delta(sinh(x) + x - a)*cos(x) d(x)",
     at_roots(lambda x, a: mp.sinh(x) + x - a, lambda x, a: mp.cos(x), ONE)),
    ("integral [0, 2] delta(x + exp(x) - 2 - a)*x d(x)",
     at_roots(lambda x, a: x + mp.exp(x) - 2 - a, lambda x, a: x, [(0, 2)])),
    ("integral (x ~ normal(0, 1)) delta(x^3 + x - a)*exp(x) d(x)",
     at_roots(cubic, lambda x, a: mp.exp(x)*mp.npdf(x), ONE)),
    ("integral [-inf, inf] delta(x^5 + x - a)*exp(-x^2) d(x)",
     at_roots(lambda x, a: x**5 + x - a, lambda x, a: mp.exp(-x*x), ONE)),
    ("integral ([0, 1], [0, 1]) delta(x^3 + x - a*y)*exp(x*y) d(x, y)",
     lambda a: mp.quad(lambda x: mp.exp(x*(x**3 + x)/a)/a, [0, mp.findroot(lambda x: cubic(x, a), 0.3)])),
    ("integral ([0, 1], [0, 1 - x]) delta(y^3 + y - a*x)*exp(x) d(x, y)",
     lambda a: mp.quad(lambda y: mp.exp((y**3 + y)/a)/a,
                       [0, mp.findroot(lambda y: (y**3 + y)/a - (1 - y), 0.3)])),
    ("integral [-1, 1.5] delta(x^3 - x - a)*exp(x) d(x)",
     at_roots(lambda x, a: x**3 - x - a, lambda x, a: mp.exp(x), [(-1, -0.6), (-0.5, 0), (0.8, 1.5)])),
    ("integral [1.5, -1] delta(x^3 - x - a)*[x < a] d(x)",
     at_roots(lambda x, a: x**3 - x - a, lambda x, a: -1, [(-1, -0.6), (-0.5, 0)])),
    ("integral ([0, 1], [[x >= 0.3]*0.1, a]) [y^2 >= 0.001*a]*delta(y - x^2) d(x, y)",
     lambda a: mp.mpf("0.3") - (a/1000)**0.25 + mp.sqrt(a) - mp.sqrt(mp.mpf("0.1"))),
    ("g(a)", at_roots(cubic, lambda x, a: mp.exp(x), ONE)),
    ("curve(a, 0)", at_roots(cubic, lambda x, a: 1, ONE)),
    ("sin(integral [-1, 1] delta(x^3 + x - a) d(x))",
     lambda a: mp.sin(at_roots(cubic, lambda x, a: 1, ONE)(a))),
]  # fmt: skip
DEFINITIONS = """
def spike(x, a) delta(x^3 + x - a)
def g(a) integral [-1, 1] spike(x, a)*exp(x) d(x)
def odd(x) x^3 + x
def curve(a, b) integral [-1, 1] delta(odd(x) - a - b) d(x)
"""


@pytest.mark.parametrize(("body", "exact"), CASES, ids=[body for body, _ in CASES])
def test_the_delta_is_at_the_searched_root(body: str, exact: Callable[[Any], Any]) -> None:
    m = potto.compile(f"{DEFINITIONS}def f(a)\n    {body}\n")
    plain, dual = m.f(0.3), potto.deriv(m.f)((0.3, 1.0))
    with mp.workdps(40):
        value, slope = exact(mp.mpf("0.3")), mp.diff(exact, mp.mpf("0.3"), h=mp.mpf("1e-8"))  # to 1e-16 of its size
    for found, error, truth in (
        (plain.value, plain.error, value), (dual.value, dual.error, value), (dual.tangent, dual.tangent_error, slope),
    ):  # fmt: skip
        assert abs(found - truth) <= error + 1e-14 * (1 + abs(truth)), (found, error, truth)
        assert error <= 1e-9 * (1 + abs(truth))
    assert plain.converged and dual.converged


def test_arrays_and_roots_beyond_the_bounds() -> None:
    f = potto.compile("def f(a) integral [-1, 1] exp(x)*delta(x^3 + x - a) d(x)").f
    places = [-3.0, -1.2, 0.0, 0.3, 1.9, 2.5]
    exact = at_roots(cubic, lambda x, a: mp.exp(x), ONE)
    found = f(np.array(places))
    for a, value, error in zip(places, found.value, found.error, strict=True):
        truth = exact(mp.mpf(a)) if abs(a) < 2 else 0.0
        assert abs(value - truth) <= error + 1e-14 <= 1e-9


def test_a_function_that_is_passed_on_places_deltas_monotone_or_not() -> None:
    m = potto.compile("""
def w(c, a) integral [-2, 2] delta(c(x) - a)*(x + 3) d(x)
def wave(x) x^3 - x
def rise(x) x^3 + x
""")
    three = [(mp.mpf(low), mp.mpf(high)) for low, high in ((-2, -0.58), (-0.57, 0.57), (0.58, 2))]
    exact = at_roots(lambda x, a: x**3 - x - a, lambda x, a: x + 3, three)(mp.mpf("0.2"))
    found = m.w(m.wave, 0.2)
    assert abs(found.value - exact) <= found.error + 1e-14 <= 1e-9
    exact = at_roots(cubic, lambda x, a: x + 3, [(-2, 2)])(mp.mpf("0.2"))
    found = m.w(m.rise, 0.2)
    assert abs(found.value - exact) <= found.error + 1e-14 <= 1e-9


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("integral [-1, 1] delta(x^3 + x - a)*[x^3 + x < a] d(x)", "P0505"),
        ("integral [-1, 1] delta(x^3 + x - a)*delta(2*a - 2*x - 2*x^3) d(x)", "P0505"),
    ],
)
def test_what_has_no_meaning_is_told(body: str, code: str) -> None:
    with pytest.raises(potto.PottoError) as problem:
        potto.compile(f"def f(a)\n    {body}\n").f(0.3)
    assert problem.value.diagnostics[0].code == code


DIVISIONS = [  # a divisor that is 0 for just these parameters: the other surface's section is nowhere then
    "[exp(-x) >= a*y]*[x*x + (y - 0.5)^2 < 0.06]",
    "[x*x + (y - 0.5)^2 < 0.06]*[exp(-x) > y*a]",
    "[a*y <= exp(-x)]*[(y - 0.5)^2 < 0.06 - x^2]",
    "[exp(-x) >= a^2*y]*[x*x + (y - 0.5)^2 < 0.06]",
    "[cosh(x) >= a*y]*[x*x + (y - 0.5)^2 < 0.06]",
    "[exp(-x) >= sin(a)*y]*[x*x + (y - 0.5)^2 < 0.06]",
]


@pytest.mark.parametrize("order", ["x, y", "y, x"])
@pytest.mark.parametrize("body", DIVISIONS)
def test_a_section_that_is_nowhere_divides_by_nothing(body: str, order: str) -> None:
    """Half of a disc, of which the other condition leaves out nothing."""
    f = potto.compile(f"def f(a)\n    integral ([0, 1], [0, 1]) ({body}) d({order})\n").f
    found = potto.deriv(f)((0.0, 1.0))
    assert abs(found.value - 0.03 * mp.pi) <= found.error + 1e-15 <= 1e-9
    assert abs(found.tangent) <= found.tangent_error <= 1e-9 and found.converged


# A delta on a surface that a loop makes, and what it comes to at t = 0.4, its derivative with it.
LOOPS = [
    ("t - (sum i in 1..n (i*x))", 1 / 6, 0.0),
    ("t - (sum i in 1..2 (i*x^2))", 1 / (2 * math.sqrt(3 * 0.4)), -1 / (4 * math.sqrt(3) * 0.4**1.5)),
    ("t - (fold s = x for i in 1..2 (s*2 + x))", 1 / 7, 0.0),
    ("t - (product i in 1..2 (i*x))", 1 / math.sqrt(8 * 0.4), -1 / (2 * math.sqrt(8) * 0.4**1.5)),
]


@pytest.mark.parametrize(("surface", "value", "slope"), LOOPS, ids=[row[0] for row in LOOPS])
def test_a_surface_that_a_loop_makes(surface: str, value: float, slope: float) -> None:
    m = potto.compile(
        f"def f(t, n) integral [0, 1] delta({surface}) d(x)\ndef g(t, n) integral [0, 1] [{surface} > 0] d(x)"
    )
    r = potto.deriv(m.f)((0.4, 1.0), (3, 0.0))
    assert abs(r.value - value) <= r.error + 1e-15 and r.error < 1e-12
    assert abs(r.tangent - slope) <= r.tangent_error + 1e-15 and r.tangent_error < 1e-11
    twice = potto.hessian(m.g, wrt=["t"])(0.4, 3)
    assert abs(twice.value - slope) <= twice.error + 1e-15 and twice.error < 1e-11


@pytest.mark.parametrize("method", ["quadrature", "qmc"])
def test_all_of_many_roots_count(method: str) -> None:
    """955 of them, searched for; the same ones by bisection between points of a grid."""
    x, n, t = np.linspace(0, 1, 100_001), 3000, 0.3
    here = np.nonzero(np.diff(np.sign(np.sin(n * x) + x - t)))[0]
    low, high = x[here], x[here + 1]
    rises = np.sin(n * low) + low < t
    for _ in range(60):
        middle = (low + high) / 2
        before = (np.sin(n * middle) + middle < t) == rises
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    exact = np.sum(1 / np.abs(n * np.cos(n * low) + 1))
    text = (
        f"def f(t) integral [0, 1] [sin({n}*x) + x < t] d(x)\ndef g(t) integral [0, 1] delta(sin({n}*x) + x - t) d(x)"
    )
    m = potto.compile(text)
    with potto.settings(method=method, samples=256):
        r = potto.deriv(m.f)((t, 1.0))
        assert abs(r.tangent - exact) <= r.tangent_error + 1e-14 and r.tangent_error < 1e-9
    if method == "quadrature":
        assert abs(m.g(t) - exact) <= m.g(t).error + 1e-14


def test_the_second_derivative_where_roots_go_on_without_end() -> None:
    """Phi(c/t) for the ends c of the stretches in which a cosine is less than 0.3."""
    t, c = 1.1, math.acos(0.3)
    exact = 0.0
    for k in range(20):
        for end, sign in ((2 * math.pi * k + c, -1), (2 * math.pi * (k + 1) - c, 1)):
            exact += 2 * sign * math.exp(-((end / t) ** 2) / 2) * (2 * end / t**3 - end**3 / t**5)
    f = potto.compile("def f(t) integral [-inf, inf] exp(-x^2/2)*[cos(x*t) < 0.3] d(x)").f
    r = potto.hessian(f)(t)
    assert abs(r.value - exact) <= r.error + 1e-14 and r.error < 1e-10


# What these are given is beyond what they come to, so that the formula of a root has no value.
NOWHERE = ["tanh(x)", "erf(x)", "erf(exp(-x^2/2))", "-sqrt(1 + (x + 1/2)^2)", "-exp(x)", "2*sin(x)/3", "1/(1 + x^2)"]


@pytest.mark.parametrize("body", NOWHERE)
def test_a_delta_that_is_nowhere_is_nothing(body: str) -> None:
    m = potto.compile(f"def f(t) integral [0, 1] exp(x)*delta(t - {body}) d(x)")
    r = potto.deriv(m.f)((1.25, 1.0))
    assert (r.value, r.error, r.tangent, r.tangent_error, r.converged) == (0.0, 0.0, 0.0, 0.0, True)
