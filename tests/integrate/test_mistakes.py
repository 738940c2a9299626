"""Mistakes that other systems make, each silent there: a test that they are not made here.

Expected values are closed forms, worked out beside each test.
"""

from __future__ import annotations

import math

import pytest

import potto
from potto.diagnostics import PottoError


def derivative(program: str, *duals: object) -> potto.Estimate:
    """The dual of `f` of a program at the duals given."""
    return potto.deriv(potto.compile(program).f)(*duals)


def close(got: float, exact: float, rel: float = 1e-12) -> bool:
    """To `rel`, of the exact number alone: no absolute tolerance that could hide a small wrong value."""
    return abs(got - exact) <= rel * abs(exact)


def test_samples_outside_of_the_domain_count_as_zero() -> None:
    # The mean of 40,000 samples of [x < 1/2] over [0, 1] has a standard error of 0.0025; left out samples would give 1.
    with potto.settings(method="mc", samples=40_000, seed=3):
        r = potto.compile("def f(t) integral [0, 1] [x < t] d(x)").f(0.5)
    assert abs(r.value - 0.5) < 5 * 0.0025


def test_boundary_terms_are_weighted_by_the_gradient_of_the_whole_surface() -> None:
    # {3x + y < t} in the unit square, 1 < t < 3: area (2t - 1)/6, derivative 1/3.
    r = derivative("def f(t) integral ([0, 1], [0, 1]) [3*x + y < t] d(x, y)", (2.0, 1.0))
    assert close(r.value, 0.5) and close(r.tangent, 1 / 3)


def test_a_delta_feels_the_density_of_its_measure() -> None:
    # P(x < t) for x ~ normal(0, 2): the derivative is the density at t.
    r = derivative("def f(t) integral (x ~ normal(0, 2)) [x < t] d(x)", (1.0, 1.0))
    assert close(r.tangent, math.exp(-1 / 8) / (2 * math.sqrt(2 * math.pi)))


def test_nested_measures_are_weighted_once() -> None:
    # E[x y] of independent uniform(0, 1) and uniform(0, 2) is 1/2.
    r = potto.compile("def f(b) integral (x ~ uniform(0, 1), y ~ uniform(0, b)) x*y d(x, y)").f(2.0)
    assert close(r.value, 0.5)


@pytest.mark.parametrize(
    ("integrand", "exact"),
    [
        ("[x < t]*[x < t]", 1.0),
        ("[x < t]^2", 1.0),
        ("[x < t]^3", 1.0),
        ("[x < t and x < t]", 1.0),
        ("[x < t or x < t]", 1.0),
        ("exp([x < t])", math.e - 1),
        ("1/(1 + [x < t])", -0.5),
        ("sin(3*[x < t] + x)", math.sin(3.5) - math.sin(0.5)),
        ("(if [x < t] then [2*x < 2*t] else 5*[t > x])", 1.0),
        ("[x < t]*[t > x]*[not t <= x]", 1.0),
    ],
)
def test_the_jump_of_the_whole_integrand_counts(integrand: str, exact: float) -> None:
    r = derivative(f"def f(t) integral [0, 1] ({integrand}) d(x)", (0.5, 1.0))
    assert close(r.tangent, exact)


def test_a_nonlinear_function_of_an_inner_integral() -> None:
    # int_0^1 (int_0^1 [y < t x] dy)^2 dx = t^2/3 for t < 1. One sample of the inner integral would give t/2.
    r = derivative("def f(t) integral [0, 1] (integral [0, 1] [y < t*x] d(y))^2 d(x)", (0.6, 1.0))
    assert close(r.value, 0.12) and close(r.tangent, 0.4)


@pytest.mark.parametrize(
    ("condition", "value", "tangent"),
    [
        ("t^2*x^2 > 1", 2 * (2 - 1 / 0.8), 2 / 0.8**2),  # x < -1/t and x > 1/t in [-2, 2]
        ("x^2 < t", 2 * math.sqrt(0.8), 1 / math.sqrt(0.8)),
        ("abs(x) < t", 1.6, 2.0),
    ],
)
def test_all_roots_of_a_condition(condition: str, value: float, tangent: float) -> None:
    r = derivative(f"def f(t) integral [-2, 2] [{condition}] d(x)", (0.8, 1.0))
    assert close(r.value, value) and close(r.tangent, tangent)


def test_a_wrong_inverse_is_refused() -> None:
    with pytest.raises(PottoError) as caught:
        potto.compile("""
diffeo half(x, y; c) = (x + y + c, x - y)
    inverse (u, v) . ((u + v - c)/2, (u + v - c)/2)
def f(c) integral ([0, 1], [0, 1]) (half (x, y) c ? 1 : 0) d(x, y)
""")
    assert caught.value.diagnostics[0].code.startswith("P04")


def test_a_condition_with_a_term_that_is_not_affine() -> None:
    # {x y < t} in the unit square: t (1 - ln t), derivative -ln t.
    r = derivative("def f(t) integral ([0, 1], [0, 1]) [x*y < t] d(x, y)", (0.1, 1.0))
    assert close(r.value, 0.1 * (1 - math.log(0.1))) and close(r.tangent, -math.log(0.1))


def test_a_surface_that_follows_a_moving_bound() -> None:
    # int_0^t [x < t] dx = t.
    r = derivative("def f(t) integral [0, t] [x < t] d(x)", (0.7, 1.0))
    assert close(r.value, 0.7) and close(r.tangent, 1.0)


def test_reversed_bounds_are_negative() -> None:
    # int_1^t x dx = (t^2 - 1)/2 below 0 for t < 1; with a surface: int_1^0 [x < t] dx = -t.
    r = derivative("def f(t) integral [1, t] x d(x)", (0.5, 1.0))
    assert close(r.value, -0.375) and close(r.tangent, 0.5)
    r = derivative("def f(t) integral [1, 0] [x < t] d(x)", (0.3, 1.0))
    assert close(r.value, -0.3) and close(r.tangent, -1.0)


def test_an_inner_variable_hides_an_outer_one() -> None:
    # int_0^1 x (int_0^t x dx) dx = t^2/4.
    r = derivative("def f(t) integral [0, 1] x*(integral [0, t] x d(x)) d(x)", (0.5, 1.0))
    assert close(r.value, 0.0625) and close(r.tangent, 0.25)


def test_bounds_that_depend_on_outer_variables() -> None:
    # The part of {y < x} below y = t, 0 < x < 1: t - t^2/2.
    r = derivative("def f(t) integral ([0, 1], [0, x]) [y < t] d(x, y)", (0.4, 1.0))
    assert close(r.value, 0.4 - 0.08) and close(r.tangent, 0.6)


def test_second_derivatives_are_not_zero() -> None:
    # int_0^1 x^2 [x < t] dx = t^3/3: t^2, 2 t.
    f = potto.compile("def f(t) integral [0, 1] x^2*[x < t] d(x)").f
    r = potto.deriv(potto.deriv(f))(((0.5, 1.0), (1.0, 0.0)))
    assert close(r.tangent[1], 1.0)


@pytest.mark.parametrize("t", [math.nan])
def test_a_parameter_that_is_not_a_number_gives_one_that_is_not(t: float) -> None:
    r = derivative("def f(t) integral [0, 1] [x < t]*x d(x)", (t, 1.0))
    assert math.isnan(r.value) and math.isnan(r.tangent) and not r.converged


def test_infinite_parameters() -> None:
    r = derivative("def f(t) integral [0, 1] [x < t]*x d(x)", (math.inf, 1.0))
    assert close(r.value, 0.5) and r.tangent == 0.0


def test_the_branch_not_taken_cannot_spoil() -> None:
    # int_0^1 sqrt(x - t) [x > t] dx = 2/3 (1-t)^(3/2), derivative -(1-t)^(1/2).
    r = derivative("def f(t) integral [0, 1] (if [x > t] then sqrt(x - t) else 0) d(x)", (0.3, 1.0))
    assert close(r.value, 2 / 3 * 0.7**1.5) and close(r.tangent, -math.sqrt(0.7))


def test_strict_and_not_strict_differ_only_at_equality() -> None:
    m = potto.compile("def a(t) [t < 0.5]\ndef b(t) [t <= 0.5]\ndef c(t) [not t < 0.5]\ndef d(t) [t >= 0.5]")
    assert [m.a(0.5).value, m.b(0.5).value, m.c(0.5).value, m.d(0.5).value] == [0, 1, 1, 1]


def test_numbers_keep_all_digits() -> None:
    assert potto.compile("def f(t) t").f(0.1234567890123456).value == 0.1234567890123456


def test_settings_do_not_leak() -> None:
    f = potto.compile("def f(t) integral [0, 1] [x < t] d(x)").f
    with potto.settings(method="mc", samples=100, seed=1):
        rough = f(0.3)
    with potto.settings(method="mc", samples=100, seed=2):
        other = f(0.3)
    exact = f(0.3)
    assert rough.method == other.method == "mc" and rough.value != other.value
    assert exact.method == "quadrature" and close(exact.value, 0.3)


def test_a_sum_of_two_thousand_terms() -> None:
    # sum k = 1..2000 of k x over [0, 1]: 2001000/2.
    terms = " + ".join(f"{k}*x" for k in range(1, 2001))
    assert close(potto.compile(f"def f(t) integral [0, t] ({terms}) d(x)").f(1.0).value, 1000500.0)


def test_the_papers_introduction() -> None:
    program = "def f(t) integral [0, 1] [x < t] d(x)"
    for t, exact in ((0.3, 1.0), (1.0 - 2**-53, 1.0), (-0.5, 0.0), (1.5, 0.0)):
        r = derivative(program, (t, 1.0))
        assert r.tangent == pytest.approx(exact, rel=1e-14, abs=0) and not r.notes
    for t, backward, forward in ((0.0, 0.0, 1.0), (1.0, 1.0, 0.0)):
        r = derivative(program, (t, 1.0))
        (note,) = r.notes
        assert r.tangent == 0.0
        assert float(note.backward) == pytest.approx(backward, rel=1e-14, abs=0)
        assert float(note.forward) == pytest.approx(forward, rel=1e-14, abs=0)


def test_an_angle_jumps_where_it_passes_the_negative_axis() -> None:
    # With A(u) = atan2(u, -1), f(t) is the integral of A from -1 - t to 1 - t, so that f' = A(-1 - t) - A(1 - t). What
    # differentiates the integrand alone finds 2 pi more, as A jumps at 0.
    program = "def f(t) integral [-1, 1] atan2(x - t, -1) d(x)"
    exact = math.atan2(-1.3, -1) - math.atan2(0.7, -1)
    assert close(derivative(program, (0.3, 1.0)).tangent, exact)
    through_a_call = "def angle(p) atan2(p, -1)\ndef f(t) integral [-1, 1] angle(x - t) d(x)"
    assert close(derivative(through_a_call, (0.3, 1.0)).tangent, exact)
    with potto.settings(method="mc", samples=100_000, seed=3):
        r = derivative(program, (0.3, 1.0))
    assert abs(r.tangent - exact) < 5 * r.tangent_error < 0.1
    # In a plane f'(0) is -2 times the integral of atan2(1, x) over x in [-2, 0], which is pi - atan(1/s) at x = -s.
    r = derivative("def f(t) integral ([-2, 0], [-1, 1]) atan2(y - t, x) d(x, y)", (0.0, 1.0))
    assert close(r.tangent, -2 * (2 * math.pi - 2 * math.atan(0.5) - math.log(5) / 2), 1e-9)


@pytest.mark.parametrize(("condition", "value", "tangent"), [
    ("atan2(0, x) > 0.7", 2.0, 0.0),  # pi left of the origin, else 0
    ("atan2(0, x + t) < 0.7", 3.3, 1.0),
    ("atan2(t - 0.3, x) < 0.7", 3.0, None),
    ("atan2(0, x - t) > 0.7 or x > 1", 4.3, 1.0),
])  # fmt: skip
def test_an_angle_jumps_at_the_origin(condition: str, value: float, tangent: float | None) -> None:
    answer = derivative(f"def f(t) integral [-2, 3] [{condition}] d(x)", (0.3, 1.0))
    assert abs(answer.value - value) <= answer.error + 1e-15 < 1e-12
    if tangent is None:  # before it the angle is negative to the left, and behind it positive
        assert not answer.converged or answer.notes
    else:
        assert abs(answer.tangent - tangent) <= answer.tangent_error + 1e-15 < 1e-12


def test_a_second_derivative_does_not_meet_the_jump_of_an_angle_again() -> None:
    # f'' = A'(1 - t) - A'(-1 - t) with A'(u) = -1/(1 + u^2).
    program = """def g(t) integral [-1, 1] atan2(x - t, -1) d(x)
dg = deriv(g)
def f(t) snd(dg((t, 1)))"""
    r = derivative(program, (0.3, 1.0))
    assert close(r.tangent, 1 / (1 + 1.3**2) - 1 / (1 + 0.7**2), 1e-10)


@pytest.mark.parametrize("mode", [0.0, 1.0])
def test_a_derivative_is_not_vouched_for_where_a_density_degenerates(mode: float) -> None:
    # The mean is (0 + m + 1)/3, so that its derivative is 1/3 from inside; but at m = 0 and at m = 1 one slope of the
    # triangle is 0/0, and the other one alone gives 1/3 by luck or -2/3.
    r = derivative("def f(m) integral (x ~ triangular(0, m, 1)) x d(x)", (mode, 1.0))
    assert close(r.value, (1 + mode) / 3)
    assert not r.converged and r.tangent_error == math.inf and "lies on a bound" in r.reasons[0]
    still = derivative("def f(t) integral (x ~ triangular(0, 1, 1)) t*x d(x)", (1.0, 1.0))
    assert still.converged and close(still.tangent, 2 / 3)
