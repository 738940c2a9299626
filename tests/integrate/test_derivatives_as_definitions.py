"""A derivative that has a name, is passed on or is called under an integral, with its dual varying there."""

from __future__ import annotations

import numpy as np
import pytest

import potto

# q(c) = c^2/2 on [0, 1], so snd dq((x t, x)) = x t x and its integral over [0, 1] is t/3.
PROGRAM = """
def q(c) integral [0, 1] y*[y < c] d(y)
dq = deriv q
def named(t) integral [0, 1] snd (dq ((x*t, x))) d(x)
def spelled(t) integral [0, 1] snd ((deriv q) ((x*t, x))) d(x)
def taking(g, t) integral [0, 1] snd (g ((x*t, x))) d(x)
def passed(t) taking (dq, t)
def passed_on(t) taking (deriv q, t)
"""


@pytest.mark.parametrize("name", ["named", "spelled", "passed", "passed_on"])
def test_its_jump_is_found_in_the_value_of_the_dual(name: str) -> None:
    m = potto.compile(PROGRAM)
    got = potto.deriv(getattr(m, name))((0.5, 1.0))
    # Polynomials on either side of the cut: exact for the rule, up to rounding.
    assert abs(got.value - 1 / 6) <= 1e-15 and abs(got.tangent - 1 / 3) <= 1e-15


def test_a_condition_of_a_derivative_jumps_where_the_primal_says() -> None:
    m = potto.compile("""
def step(x, t) [x < t]
dstep = deriv step
def f(t) integral [0, 1] fst (dstep ((x, 0), (t, 0))) d(x)
""")
    got = potto.deriv(m.f)((0.4, 1.0))
    assert abs(got.value - 0.4) <= 1e-15 and abs(got.tangent - 1) <= 1e-15


def test_a_variable_of_integration_stands_still_in_a_call_of_a_derivative() -> None:
    """d/db of [a < b]*a^2*b, with its jump at a = b: int_0^t x^2 dx + t^3."""
    m = potto.compile("""
def part(a, b) [a < b]*a^2*b
def f(t) integral [0, 1] snd(deriv(part)(x, (t, 1))) d(x)
""")
    assert abs(m.f(0.5).value - (0.5**3 / 3 + 0.5**3)) <= 1e-15


@pytest.mark.parametrize(
    "place",
    ["[x, 2][i]", "(if i == 0 then x else 2)", "(if i == 0 then x else if t > 1 then 2 else x^2)"],
)
def test_a_delta_whose_place_is_chosen_has_the_roots_of_each_choice(place: str) -> None:
    """x^2 t = 1/2 at sqrt(1/2t), 2 x t = 1/2 at 1/4t: x^2/(2 x t) + 2 x/2t = sqrt(1/8 t^3) + 1/4t^2."""
    m = potto.compile(f"def f(t) integral [0, 1] (sum i in 0..1 (delta(x*t*{place} - 0.5)*{place}*x)) d(x)")
    got = potto.grad(m.f)(2.0)
    assert abs(got.value - 3 / 16) <= 1e-15 and abs(got.tangent - (-3 / 32 - 1 / 16)) <= 1e-15


def test_a_parameter_stands_for_a_dual_where_deltas_count() -> None:
    """d/dt of [y > 0.3] s at y = x t: s/t^2 times 0.3, from the delta at x = 0.3/t."""
    m = potto.compile("""
def step(y, s) [y > 0.3]*s
def f(t, s) integral [0, 1] snd(deriv(step)((x*t, x), s)) d(x)
def handed(t, s) let r = s in integral [0, 1] snd(deriv(step)((x*t, x), r)) d(x)
""")
    for function in (m.f, m.handed):
        assert abs(function(0.8, 0.5).value - 0.3 * 0.5 / 0.64) <= 1e-15


@pytest.mark.parametrize(
    ("call", "value", "tangent"),
    [  # by t: of delta(x - t) x^k s t^k, of delta'(x - t) x -s
        ("one((x - t, 0), (s, 1))", "t", "1"),
        ("one(x - t, (s, x))", "t^2", "2*t"),
        ("one((x - t, 1), (s, 0))", "-s", "0"),
        ("all((x - t, 0), ([1, s], [1, 1]), (s, x))", "(1 + s)*t^2 + 2*s*t", "(1 + s)*2*t + 2*s"),
        ("counted(x - t, (s, 1))", "6*t", "6"),
        ("counted((x - t, 1), s)", "-6*s", "0"),
    ],
)
def test_a_delta_of_what_is_derived_stands_still_or_moves(call: str, value: str, tangent: str) -> None:
    name, given = call.split("(", 1)[0], call[call.index("(") :]
    m = potto.compile(f"""
def one(a, s) s*delta(a)
def all(a, ys: [n] Real, s) sum y in ys (s*y*delta(a))
def counted(a, s) sum i in 1..3 (s*i*delta(a))
def f(t, s) integral [0, 1] x*snd(deriv({name}){given}) d(x)
def expected(t, s) {value}
def slope(t, s) {tangent}
""")
    got = potto.grad(m.f, "t")(0.4, 0.7)
    assert abs(got.value - m.expected(0.4, 0.7).value) <= 2e-15  # some roundings
    assert abs(got.tangent - m.slope(0.4, 0.7).value) <= 2e-15


@pytest.mark.parametrize("given", ["[1, s]", "named", "local", "[s for i in 0..1]", "([1, s], [0, 0])", "xs"])
def test_an_array_stands_for_a_dual_where_deltas_count(given: str) -> None:
    """d/dt of [y > 0.3] xs[1] + y at y = x t: the delta as above, and the integral of x."""
    m = potto.compile(f"""
def step(xs: [n] Real, y) [y > 0.3]*xs[1] + y
named = [1, 0.5]
def f(t, s, xs: [n] Real)
    local = [1, s]
    integral [0, 1] snd(deriv(step)({given}, (x*t, x))) d(x)
""")
    got = m.f(0.8, 0.5, np.array([1, 0.5]))
    assert abs(got.value - 0.3 * 0.5 / 0.64 - 0.5) <= 1e-14  # some roundings of what is added up
