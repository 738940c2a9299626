"""The first derivative within the second one is a formula: it must be what the first derivative comes to by numbers.

Each program was once one of which the formula missed a part.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import potto
from potto.calculus.solving import pivots

PROGRAMS = {
    # the surface runs along y where x is the larger one, so that no root in y tells of it
    "max": "integral ([t^2, 1], [t, s*0.7]) [max(x, 0.7*y) >= t]*(t + y) d(x, y)",
    # along the other variable a surface is all of an axis
    "product": "integral [0, 1] x*(integral [0, 1] [(x + t - 0.5)*(z + s) > 0] d(z)) d(x)",
    "inner minimum": "integral [0, 1] x*(integral [0, 1] [min(x + t, z) > s] d(z)) d(x)",
    # all terms have a factor, whose root is not the one that moves
    "factor": "integral ([0, 1], [0, 1]) [sin(z)*t*s >= sin(z)*y]*exp(y*s) d(y, z)",
    "factor behind a kink": "integral ([0, 1], [-1, 1], [0.1, 1]) [abs(z)*t*s >= z*y]*exp(y*s) d(y, x, z)",
    # how many roots there are varies with x
    "sine": "integral ([-0.5, 1.5], [-1, 1]) [sin(2*x + y) > t*0.7] d(x, y)",
    "sines": "integral ([-0.5, 1.5], [-1, 1]) sin(3*[sin(2*x + y) <= t*0.7] + x*s) d(x, y)",
    # a kink of an inner integral's integrand is none of the outer one's
    "kink inside": "integral [0, s] abs(integral [0, 1 + s] min(x - y, t) d(y)) d(x)",
    "center inside": "integral [0, s] exp(sin(integral [0, t] 1/(1 + (x*y - s)^2) d(y))) d(x)",
    # what a surface is given are duals
    "searched": "integral [2, 0] abs(integral [s, 1.87 - s] [2*t*x <= 0.3 + 0.5*y]/(1 + (t - x)^2) d(y))*sin(s) d(x)",
}


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize(("dt", "ds"), [(1.0, 0.0), (0.0, 1.0)])
def test_the_formula_of_the_first_derivative(name: str, dt: float, ds: float) -> None:
    t, s, h = 0.7575, 0.4892, 1e-3
    f = potto.compile(f"def f(t, s) {PROGRAMS[name]}\n").f
    once = potto.deriv(f)((t, dt), (s, ds))
    twice = potto.deriv(potto.deriv(f))(((t, dt), (dt, 0.0)), ((s, ds), (ds, 0.0)))
    assert abs(twice.value[1] - once.tangent) <= 1e-13 + once.tangent_error + twice.error[1]
    there = [potto.deriv(f)((t + dt * k * h, dt), (s + ds * k * h, ds)).tangent for k in (-2, -1, 1, 2)]
    slope = (there[0] - 8 * there[1] + 8 * there[2] - there[3]) / (12 * h)  # to the fourth order in h
    assert abs(twice.tangent[1] - slope) <= 1e-7 * max(1, abs(slope)) + twice.tangent_error[1]


def test_integrals_of_integrals_and_one_over_both() -> None:
    """A disc of radius sqrt(t) under 1 + x*y + y^2: pi*t + pi*t^2/4. By the inner integral alone the formula of the
    first derivative has an end like 1/sqrt, and lost half of the digits."""
    m = potto.compile("""
def nested(t) integral [-1, 1] (integral [-1, 1] [x^2 + y^2 < t]*(1 + x*y + y^2) d(y)) d(x)
def joined(t) integral ([-1, 1], [-1, 1]) [x^2 + y^2 < t]*(1 + x*y + y^2) d(x, y)
""")
    nested, joined = (potto.hessian(f)(0.7) for f in (m.nested, m.joined))
    assert abs(nested.value - math.pi / 2) <= nested.error <= 1e-10
    assert nested.value == joined.value and nested.evals == joined.evals


def test_the_greatest_of_six() -> None:
    """All of six numbers are below t: t^6."""
    f = potto.compile(f"def f(t) integral ({'[0, 1], ' * 5}[0, 1]) [max(a, b, c, u, v, w) < t] d(a, b, c, u, v, w)").f
    found = potto.hessian(f)(0.7)
    assert abs(found.value - 30 * 0.7**4) <= found.error <= 1e-11


def test_a_jump_of_an_inner_integral_moves() -> None:
    """Where y is 0.5 the inner integral jumps, by 0.5 or by 1."""
    m = potto.compile("""
def low(y) integral [0, 1] [min(y, z) > 0.5] d(z)
def rows(y) integral [0, 1] [(y - 0.5)*(z + 1) > 0] d(z)
def f(t) integral [0, 1] y*low(y + t) d(y)
def g(t) integral [0, 1] y*rows(y + t) d(y)
def h(a) integral [0, 1] y*snd(deriv(low)((y, a))) d(y)
def k(a) integral [0, 1] y*snd(deriv(rows)((y, a))) d(y)
""")
    for function, size in ((m.f, 0.5), (m.g, 1.0)):
        got = potto.deriv(function)((0.03, 1.0))
        assert abs(got.tangent - size * 0.47) <= 1e-13 + got.tangent_error and got.tangent_error <= 1e-11
    for function, size in ((m.h, 0.5), (m.k, 1.0)):
        got = function(1.0)
        assert abs(got.value - size * 0.5) <= 1e-13 + got.error and got.error <= 1e-11


ALONG = "def f(t) integral ([-1, 1], [0, 1]) (y + 2)*[exp((y + t)*z) > 1] d(y, z)"


def test_a_surface_along_the_variable_that_it_is_solved_for() -> None:
    """[exp(y*z) > 1] jumps at y = 0 for all z, of which its root in z, log(1)/y, says nothing."""
    got = potto.deriv(potto.deriv(potto.compile(ALONG).f))(((0.03, 1.0), (1.0, 0.0)))
    assert abs(got.value[1] - 1.97) <= got.error[1] <= 1e-11  # of y + 2 at -t
    assert abs(got.tangent[1] + 1) <= got.tangent_error[1] <= 1e-11 and got.converged


def test_a_formula_that_misses_a_part_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pivots, "_is_a_factor", lambda *_: False)
    m = potto.compile(ALONG.replace("y + 2", "y + 3"))
    got = potto.deriv(potto.deriv(m.f))(((0.03, 1.0), (1.0, 0.0)))
    assert abs(got.value[1] - 2.97) <= 1e-12  # of y + 3 at -t
    assert got.error[1] <= 1e-11 and got.tangent_error[1] == float("inf")
    assert not got.converged and "disagree about the first one" in got.reasons[0]
    short = m.eval("D(D(f))(0.03)")
    assert not short.converged and short.error == float("inf") and "disagree" in short.reasons[0]


# An integral with a surface for each value of an index, and its second derivative at t = 0.4.
INDEXED = [
    ("[0, 1]", "product i in 1..2 ([x^2 < i*t])", "x", -0.25 * 0.4**-1.5),
    ("[0, 1]", "product i in 1..2 (1 - [x^2 < i*t]/2)", "x", (1 + 2 * 2**0.5) / 16 * 0.4**-1.5),
    ("[0, 1]", "fold s = 1 for i in 1..2 (s*[x^2 < i*t])", "x", -0.25 * 0.4**-1.5),
    ("[0, 1]", "[(sum i in 1..2 ([x^2 < i*t])) > 1]", "x", -0.25 * 0.4**-1.5),
    ("([0, 1], [0, 1])", "product i in 1..2 ([x + i*y < t])", "x, y", 0.5),
    ("([0, 1], [0, 1])", "sum i in 1..2 ([i*x + y < t])", "x, y", 1.5),
    ("([0, 1], [0, 1])", "sum i in 0..2 ([x + i*y < t])", "x, y", 1.5),
    ("([0, 1], [0, 1])", "sum i in 1..2 (x*delta(i*x + y - t))", "x, y", 1.25),
]


@pytest.mark.parametrize(("bounds", "body", "names", "exact"), INDEXED, ids=[row[1] for row in INDEXED])
def test_a_surface_for_each_value_of_an_index(bounds: str, body: str, names: str, exact: float) -> None:
    """For one value of the index a surface is solved for x, for another for y; where one is passed the others hold."""
    r = potto.hessian(potto.compile(f"def f(t) integral {bounds} ({body}) d({names})").f)(0.4)
    assert abs(r.value - exact) <= r.error + 1e-14
    assert r.error < 1e-10


# A condition whose edge is a bound that moves, wherever that is, and the second derivative at t = 0.6.
ON_BOUNDS = [
    ("[0, t]", "exp(x)*[x <= t]", math.exp(0.6)),
    ("[t, t + 2]", "exp(x)*[x >= t]", math.exp(2.6) - math.exp(0.6)),
    ("[t, 2]", "[x >= t]*max(x - 1/2, t)", -1.0),
    ("[0, t]", "(fold s = x for i in 1..2 (if [s < t] then s - 1 else s + s^2))", 1.0),
]


@pytest.mark.parametrize(("bounds", "body", "exact"), ON_BOUNDS, ids=[row[1] for row in ON_BOUNDS])
def test_an_edge_that_is_a_bound(bounds: str, body: str, exact: float) -> None:
    r = potto.hessian(potto.compile(f"def f(t) integral {bounds} {body} d(x)").f)(0.6)
    assert abs(r.value - exact) <= r.error + 1e-15
    assert r.error < 1e-12


# What is nothing for all parameters: a coefficient, or a range.
NOTHING = [
    ("integral [0, 1] [x*(t - t) <= t]*exp(x*t) d(x)", 0.3),  # of x^2 exp(x t), below
    ("integral [0, 1] [x*(t^2 - t*t) >= t - 1]*exp(x*t) d(x)", 0.3),
    ("integral ([0, 1], [0, 1]) [(x + y)*(t - t) <= t]*exp(x*t) d(x, y)", 0.3),
    ("integral [t, t] (if diffeo(2*x - s(t)) then t - s(t) else 1 + s(t)) d(x)", 0.0),
    ("integral [s(t), s(t)] max([x^2 + (t + 3)*x < (t + 3)^2]*(t - x), t^2) d(x)", 0.0),
    ("integral [s(t), 2*s(t)/2] ([0.7*x > t]*x)^3 d(x)", 0.0),
]


@pytest.mark.parametrize(("body", "t"), NOTHING, ids=[row[0] for row in NOTHING])
def test_what_is_nothing_has_no_deltas(body: str, t: float) -> None:
    m = potto.compile(f"def s(t) 1 + t/2\ndef f(t) {body}")
    r = potto.hessian(m.f)(0.3)
    exact = (math.exp(0.3) * (0.3**2 - 2 * 0.3 + 2) - 2) / 0.3**3 if t else 0.0
    assert abs(r.value - exact) <= r.error + 1e-15
    assert r.error < 1e-12


# Recursions that jump as often as their first argument says, and the second derivative of the integral at t = 0.5.
RECURSIONS = {
    "summands": ("if n > 0 then [x < t^2*n/4] + g(n - 1, x, t) else 0", 3.0),  # of 3 t^2/2
    "factors": ("if n > 0 then [x < t*n/4]*x*t*g(n - 1, x, t) else 1", 42*0.5**5/1024),  # of (t/4)^4/4 t^3
    "the same factor": ("if n > 0 then [x < t]*t*g(n - 1, x, t) else 1", 12*0.5**2),  # of t^4
    "a condition at the end": ("if n > 0 then x*g(n - 1, x, t) else [x < t]", 3*0.5**2),  # of t^4/4
    "kinks": ("if n > 0 then max(x*g(n - 1, x, t), t) else x", 0.5**-0.75/4),  # of (4 t^(5/4) + 1)/5
    # of t/3 + 2 t^3/25 + 3 t^2/5
    "two calls": ("if n > 1 then x*g(n - 1, x, t) + [x < t*n/5]*g(n - 2, x, t) else t", 1.44),
}  # fmt: skip


@pytest.mark.parametrize(("body", "exact"), RECURSIONS.values(), ids=RECURSIONS)
def test_a_recursion_is_written_out(body: str, exact: float) -> None:
    r = potto.hessian(potto.compile(f"def g(n, x, t) {body}\ndef f(t) integral [0, 1] g(3, x, t) d(x)").f)(0.5)
    assert abs(r.value - exact) <= r.error + 1e-15
    assert r.error < 1e-12


def test_a_surface_that_is_a_recursion() -> None:
    """x^(n + 1) < t: the length is t^(1/(n + 1))."""
    m = potto.compile("def g(n, x) if n > 0 then x*g(n - 1, x) else x\ndef f(n, t) integral [0, 1] [g(n, x) < t] d(x)")
    for n in (3, 40):
        r, power = potto.hessian(m.f, ["t"])(n, 0.5), 1 / (n + 1)
        assert abs(r.value - power * (power - 1) * 0.5 ** (power - 2)) <= r.error + 1e-15
        assert r.error < 1e-12


def test_members_of_a_batch_go_to_depths_of_their_own() -> None:
    """The length of the least of the intervals is t/4, if there are any."""
    m = potto.compile("""
def g(n, x, t) if n > 0 then [x < t*n/4]*g(n - 1, x, t) else 1
def f(n, t) integral [0, 1] t^2*g(n, x, t) d(x)
""")
    n, t = np.array([2.0, 0.0, 3.0, 1.0]), np.array([0.5, 0.5, 0.6, 0.2])
    r = potto.hessian(m.f, ["t"])(n, t)
    assert (abs(r.value - np.where(n > 0, 1.5 * t, 2.0)) <= r.error + 1e-15).all()
    assert (r.error < 1e-12).all()


@pytest.mark.parametrize("n", [3, 200])
def test_a_recursion_that_places_deltas_is_refused_where_its_depth_is_not_known(n: int) -> None:
    m = potto.compile(
        "def g(n, x) if n > 0 then x*g(n - 1, x) else x\ndef f(n, t) integral [0, 1] delta(g(n, x) - t) d(x)"
    )
    with pytest.raises(potto.PottoError) as caught:
        potto.hessian(m.f, ["t"])(n, 0.5)
    assert [d.code for d in caught.value.diagnostics] == ["P0510"]
    assert "recursion" in caught.value.diagnostics[0].message


ROUND = {
    "disc": ("[-sqrt(t), sqrt(t)] (integral [-sqrt(t - x^2), sqrt(t - x^2)] x^2 d(y)) d(x)", math.pi / 2),  # pi t^2/4
    "half": ("[-sqrt(t), sqrt(t)] (integral [0, sqrt(t - x^2)] y d(y)) d(x)", 0.5 / math.sqrt(0.7)),  # 2/3 t^1.5
    "quarter": ("[0, sqrt(t)] (integral [0, sqrt(t - x^2)] x*y d(y)) d(x)", 0.25),  # t^2/8
    "sheared": ("[1 - sqrt(t), 1 + sqrt(t)] "
                "(integral [x - sqrt(t - (x - 1)^2), x + sqrt(t - (x - 1)^2)] (y - x)^2 d(y)) d(x)", math.pi / 2),
    "bracket that touches": ("[-sqrt(t), sqrt(t)] (integral [-2, 2] [y^2 < t - x^2]*x^2 d(y)) d(x)", math.pi / 2),
    "ball": ("[-sqrt(t), sqrt(t)] (integral [-sqrt(t - x^2), sqrt(t - x^2)] "
             "(integral [-sqrt(t - x^2 - y^2), sqrt(t - x^2 - y^2)] z^2 d(z)) d(y)) d(x)",
             math.pi * math.sqrt(0.7)),  # 4/15 pi t^2.5
}  # fmt: skip


@pytest.mark.parametrize("name", ROUND)
def test_bounds_that_turn_where_a_body_ends_are_its_rim(name: str) -> None:
    program, second = ROUND[name]
    found = potto.hessian(potto.compile(f"def f(t) integral {program}").f)(0.7)
    assert abs(found.value - second) <= found.error <= 1e-9
