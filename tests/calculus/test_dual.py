"""The symbolic dual: interior, boundary and bounds of integrals against closed forms and differences of closed forms.

Every expected value is the exact derivative, written beside its case; values of the derived terms come from the tests'
own evaluator, good to about ten digits for single integrals and six for double ones.
"""

from __future__ import annotations

import mpmath
import pytest
from calculus_terms import term, value

from potto.calculus.differentiation.dual import dual, dual_function
from potto.core import terms as t
from potto.core.terms import ONE, Term
from potto.diagnostics import PottoError

QUADRATIC = "(sqrt(2)*(x + y + c) + 2)^2"  # the quadratic shader, inverted


def derivative(text: str, name: str) -> Term:
    return dual(term(text), {name: ONE})[1]


# text, variable, environment, exact derivative, relative tolerance
CLOSED_FORMS = [
    ("integral(H(t - x), (x, 0, 1))", "t", {"t": 0.5}, 1.0, 1e-12),
    ("integral(H(t - x), (x, 0, 1))", "t", {"t": 1.0}, 0.0, 0),
    ("integral(H(t - x), (x, 0, 1))", "t", {"t": 1.5}, 0.0, 0),
    ("integral(H(x - t), (x, 0, 1))", "t", {"t": 0.5}, -1.0, 1e-12),
    # reversed bounds turn the sign
    ("integral(H(t - x), (x, 1, 0))", "t", {"t": 0.5}, -1.0, 1e-12),
    ("integral(H(t - x), (x, a, b))", "t", {"t": 0.5, "a": 1, "b": 0}, -1.0, 1e-12),
    ("integral(H(t - x), (x, a, b))", "t", {"t": 0.5, "a": 0, "b": 1}, 1.0, 1e-12),
    ("integral(H(t - x), (x, a, b))", "t", {"t": 0.5, "a": 0.6, "b": 1}, 0.0, 0),
    ("integral(x^2, (x, a, b))", "b", {"a": 0.3, "b": 1.5}, 2.25, 1e-12),
    ("integral(x^2, (x, a, b))", "a", {"a": 0.3, "b": 1.5}, -0.09, 1e-12),
    # the value is what jumps, whatever the integrand makes of its brackets
    ("integral(H(t - x)*H(t - x), (x, 0, 1))", "t", {"t": 0.5}, 1.0, 1e-12),
    ("integral(H(t - x)^3, (x, 0, 1))", "t", {"t": 0.5}, 1.0, 1e-12),
    ("integral(sin(3*H(t - x) + x), (x, 0, 1))", "t", {"t": 0.5}, -0.8302087662938228, 1e-12),
    ("integral((x + H(t - x))^2, (x, 0, 1))", "t", {"t": 0.5}, 2.0, 1e-12),
    ("integral(1/(1 + H(t - x)), (x, 0, 1))", "t", {"t": 0.5}, -0.5, 1e-12),
    ("integral(where(t - x, x, t), (x, 0, 1))", "t", {"t": 0.3}, 0.7, 1e-12),
    ("integral(H(t - x)*H(2*x - 2*t + 1), (x, 0, 1))", "t", {"t": 0.7}, 0.0, 0),
    ("integral(H(t - x)*H(3*t - 3*x)*(2 - H(x - t)), (x, 0, 1))", "t", {"t": 0.7}, 2.0, 1e-12),
    # a surface that follows a moving bound: the integral is t
    ("integral(H(t - x), (x, 0, t))", "t", {"t": 0.7}, 1.0, 1e-12),
    ("integral(H(t - x)*exp(x), (x, 0, 2*t))", "t", {"t": 0.5}, float(mpmath.exp(0.5)), 1e-12),
    ("integral(exp(x)*H(t/2 - x), (x, 0, t^2))", "t", {"t": 0.6}, 0.6749294037880016, 1e-12),
    # several roots
    ("integral(H(t - (x - 0.5)^2), (x, 0, 1))", "t", {"t": 2.0**-40}, 1048576.0, 1e-12),
    ("integral(H(t - x^3), (x, -1, 1))", "t", {"t": 2.0**-60}, 2.0**40 / 3, 1e-12),
    ("integral(H(t^2*x^2 - 1), (x, -1, 1))", "t", {"t": 2.0}, 0.5, 1e-12),
    ("integral(H(sin(40*pi*x) - t), (x, 0, 1))", "t", {"t": 0.3}, -0.33367942704714732, 1e-10),
    ("integral(H((x - t)*(x - s)), (x, 0, 1))", "t", {"t": 0.3, "s": 0.7}, 1.0, 1e-12),
    ("integral(H(1/(x - t)), (x, 0, 1))", "t", {"t": 0.3}, -1.0, 1e-12),
    ("integral(H(abs(x - 0.5) - t), (x, 0, 1))", "t", {"t": 0.2}, -2.0, 1e-12),
    ("integral(H(t - x)/sqrt(2*pi)*exp(0 - x^2/2), (x, -inf, inf))", "t", {"t": 1.5}, 0.12951759566589174, 1e-12),
    # scaled conditions
    ("integral(x*H(1e-160*(t - x)), (x, 0, 1))", "t", {"t": 0.3}, 0.3, 1e-12),
    ("integral(H(t - x), (x, 0, 1e150))", "t", {"t": 1e149}, 1.0, 1e-12),
    ("integral(exp(x)*H(t - x)*H(x - t + e), (x, 0, 1))", "t", {"t": 0.5, "e": 2.0**-40}, 1.4995032604014144e-12, 1e-4),
    # the paper's renderer
    ("integral(H(x + y + c), (x, 0, 1), (y, 0, 1))", "c", {"c": -0.7}, 0.7, 1e-6),
    ("integral(H(x + y + c), (x, 0, 1), (y, 0, 1))", "c", {"c": -2}, 0.0, 0),
    (f"integral(H(x + y + c)/{QUADRATIC}, (x, 0, 1), (y, 0, 1))", "c", {"c": -1.3}, 0.1170588335160900, 1e-6),
    ("integral(H(a*x + b*y + c), (x, 0, 1), (y, 0, 1))", "a", {"a": 1, "b": 1, "c": -0.75}, 0.28125, 1e-6),
    ("integral(H(r^2 - x^2 - y^2), (x, -1, 1), (y, -1, 1))", "r", {"r": 0.7}, 4.398229715025710, 1e-6),
    ("integral(exp(x + y)*H(r^2 - x^2 - y^2), (x, 0, 1), (y, 0, 1))", "r", {"r": 1.2}, 2.586850034215618, 1e-6),
    ("integral(H(t - x*y), (x, 0, 1), (y, 0, 1))", "t", {"t": 0.1}, 2.302585092994046, 1e-6),
    ("integral(exp(x*y)*H(t - y), (x, 0, 1), (y, 0, 1))", "t", {"t": 0.5}, 1.2974425414002563, 1e-6),
    ("integral(H(p - x*cos(w) - y*sin(w)), (x, 0, 1), (y, 0, 1))", "w", {"w": 0, "p": 0.5}, -0.5, 1e-6),
    # a factor that is no root of the other variable
    ("integral(H((x - t)*(y - s)), (x, 0, 1), (y, 0, 1))", "t", {"t": 0.3, "s": 0.2}, -0.6, 1e-6),
    # summands with a factor in common, of which one is divided
    ("integral(H(s - s*x/t)*x, (x, 0, 1))", "t", {"t": 0.3, "s": 0.4}, 0.3, 1e-12),
    ("integral(H(s - s*x/t)*x, (x, 0, 1))", "t", {"t": 0.3, "s": -0.4}, -0.3, 1e-12),
    # bounds that depend on variables further out
    ("integral(H(t - x - y), (x, 0, 1), (y, 0, x))", "t", {"t": 0.8}, 0.4, 1e-6),
    # an inner integral, used nonlinearly
    ("integral(integral(H(t - x*y), (y, 0, 1))^2, (x, 0, 1))", "t", {"t": 0.25}, 2 * 0.25 * (1 / 0.25 - 1), 1e-6),
]


@pytest.mark.parametrize(("text", "name", "env", "exact", "tolerance"), CLOSED_FORMS)
def test_derivative_in_closed_form(text: str, name: str, env: dict[str, float], exact: float, tolerance: float) -> None:
    found = float(value(derivative(text, name), env))
    assert found == pytest.approx(exact, rel=tolerance, abs=1e-300)


def test_sums_of_surfaces_are_forced_one_by_one() -> None:
    x, i, n = t.var("x"), t.var("i"), t.const(5.0)
    surface = t.sub(t.mul(i, t.div(t.var("t"), t.const(6.0))), x)
    weight = t.mul(i, i)
    body = t.sum_("i", ONE, n, t.mul(weight, t.branch((surface,), True, ONE, t.ZERO)))
    whole = t.integral(("x",), ((t.ZERO, ONE),), t.mul(body, body))
    # (sum i^2 [x < i t/6])^2: between (i-1)t/6 and it/6 the sum is s_i = i^2 + ... + 25.
    tails = [sum(k * k for k in range(j, 6)) for j in range(1, 7)]
    exact = sum((tails[j - 1] ** 2 - tails[j] ** 2) * j / 6 for j in range(1, 6))
    found = float(value(dual(whole, {"t": ONE})[1], {"t": 0.9}))
    assert found == pytest.approx(exact, rel=1e-12, abs=0)


def test_the_second_derivative_of_an_integral() -> None:
    first = derivative("integral(exp(2*x)*H(t - x), (x, 0, 1))", "t")
    second = dual(first, {"t": ONE})[1]
    assert float(value(second, {"t": 0.5})) == pytest.approx(2 * float(mpmath.e), rel=1e-12, abs=0)


@pytest.mark.slow
def test_the_second_derivative_counts_how_boundaries_end() -> None:
    # d2/dc2 of the seed with the quadratic shader: F(c + 2) - 2 F(c + 1) + F(c) with F'' = s where the edge is inside.
    first = derivative(f"integral(H(x + y + c)/{QUADRATIC}, (x, 0, 1), (y, 0, 1))", "c")
    second = dual(first, {"c": ONE})[1]
    assert float(value(second, {"c": -0.75})) == pytest.approx(-0.2906200436995931, rel=1e-6, abs=0)


def test_a_mixed_second_derivative_of_crossing_surfaces() -> None:
    first = derivative("integral(exp(x*y)*H(t - x)*H(s - y), (x, 0, 1), (y, 0, 1))", "t")
    second = dual(first, {"s": ONE})[1]
    assert float(value(second, {"t": 0.4, "s": 0.6})) == pytest.approx(float(mpmath.exp(0.24)), rel=1e-8, abs=0)


def test_directions_add_up() -> None:
    text = "integral(H(a*x + b*y + c)*exp(a*x*y), (x, 0, 1), (y, 0, 1))"
    env = {"a": 1.1, "b": 0.7, "c": -0.8}
    together = dual(term(text), {"a": t.const(2.0), "c": t.const(-3.0)})[1]
    apart = 2 * value(derivative(text, "a"), env) - 3 * value(derivative(text, "c"), env)
    assert float(value(together, env)) == pytest.approx(float(apart), rel=1e-9, abs=0)


# Deltas


def test_a_delta_takes_the_value_on_its_surface() -> None:
    whole, _ = dual(term("integral(x*delta(2*x - t), (x, 0, 1))"), {"t": ONE})
    assert float(value(whole, {"t": 0.5})) == pytest.approx(0.125, rel=1e-12, abs=0)


def test_a_delta_counts_every_root() -> None:
    whole, _ = dual(term("integral(exp(x)*delta(x^2 - t), (x, -1, 1))"), {"t": ONE})
    root = mpmath.sqrt(mpmath.mpf("0.25"))
    assert float(value(whole, {"t": 0.25})) == pytest.approx(float(mpmath.cosh(root) / root), rel=1e-12, abs=0)


def test_deltas_on_crossing_surfaces_multiply() -> None:
    whole, _ = dual(term("integral(exp(x*y)*delta(x + y - t)*delta(x - y), (x, 0, 1), (y, 0, 1))"), {"t": ONE})
    assert float(value(whole, {"t": 0.8})) == pytest.approx(float(mpmath.exp(0.16) / 2), rel=1e-12, abs=0)


@pytest.mark.parametrize(
    "text",
    [
        "integral(delta(x - t)^2, (x, 0, 1))",
        "integral(delta(x - t)*delta(2*x - 2*t), (x, 0, 1))",
        "integral(delta(x - t)*delta(t - x)*y, (x, 0, 1), (y, 0, 1))",
        "integral(delta(x - t)*H(x - t), (x, 0, 1))",
    ],
)
def test_a_product_of_deltas_on_one_surface_is_an_error(text: str) -> None:
    with pytest.raises(PottoError) as caught:
        dual(term(text), {"t": ONE})
    assert caught.value.diagnostics[0].code == "P0505"


def test_the_square_of_a_derivative_with_deltas_is_an_error() -> None:
    step = t.lam(("s",), t.branch((t.sub(t.var("s"), t.var("x")),), True, ONE, t.ZERO))
    slope = t.proj(t.app(t.deriv(step), (t.tuple_((t.var("t"), ONE)),)), 1)
    once = t.integral(("x",), ((t.ZERO, ONE),), slope)
    assert float(value(dual(once, {})[0], {"t": 0.5})) == 1.0
    twice = t.integral(("x",), ((t.ZERO, ONE),), t.mul(slope, slope))
    with pytest.raises(PottoError) as caught:
        dual(twice, {})
    assert caught.value.diagnostics[0].code == "P0505"


# Functions


def test_a_function_becomes_one_over_pairs() -> None:
    square = t.lam(("x",), term("x^2*k"))
    body = t.app(dual_function(square), (t.tuple_((t.const(3.0), t.const(1.0))),))
    whole, _ = dual(t.proj(body, 1), {})
    assert float(value(whole, {"k": 2.0})) == 12.0


def test_a_function_parameter_is_applied_to_pairs() -> None:
    # f(t) = shader(t) * t with shader given as x -> x^3: derivative 4 t^3.
    shader = t.lam(("x",), term("x^3"))
    function = t.lam(("t", "shader"), t.mul(t.app(t.var("shader"), (t.var("t"),)), t.var("t")))
    derived = dual_function(function)
    call = t.app(derived, (t.tuple_((t.var("a"), ONE)), dual_function(shader)))
    whole, _ = dual(call, {})
    assert [float(v) for v in value(whole, {"a": 2.0})] == [16.0, 32.0]


def test_an_unknown_definition_stays_a_derivative() -> None:
    call = t.app(t.global_("m", "f"), (t.var("x"),))
    shown, tangent = dual(call, {"x": ONE})
    pair = t.app(t.deriv(t.global_("m", "f")), (t.tuple_((t.var("x"), ONE)),))
    assert (shown, tangent) == (t.proj(pair, 0), t.proj(pair, 1))


def test_a_known_definition_is_carried_out_under_an_integral() -> None:
    step = t.lam(("u",), t.branch((t.var("u"),), True, ONE, t.ZERO))
    body = t.app(t.global_("m", "step"), (term("t*x - 1"),))
    whole = t.integral(("x",), ((t.ZERO, t.const(2.0)),), body)
    tangent = dual(whole, {"t": ONE}, lambda g: step)[1]
    assert float(value(tangent, {"t": 2.0})) == pytest.approx(0.25, rel=1e-12, abs=0)


def test_an_integrand_of_two_components_has_two_tangents() -> None:
    body = t.tuple_((term("H(t - x)"), term("x*H(t - x)")))
    whole = t.integral(("x",), ((t.ZERO, ONE),), body)
    tangent = dual(whole, {"t": ONE})[1]
    assert [float(v) for v in value(tangent, {"t": 0.25})] == [1.0, 0.25]


def test_a_surface_without_roots_in_closed_form_leaves_a_delta() -> None:
    assert derivative("integral(H(x*exp(x) - t), (x, 0, 1))", "t") is term("integral(-delta(x*exp(x) - t), (x, 0, 1))")


def test_the_derivative_of_a_plain_conditional_only_chooses() -> None:
    whole = t.if_(t.prim("lt", t.ZERO, t.var("t")), term("integral(H(t - x), (x, 0, 1))"), t.const(7.0))
    tangent = dual(whole, {"t": ONE})[1]
    assert (float(value(tangent, {"t": 0.5})), float(value(tangent, {"t": -0.5}))) == (1.0, 0.0)


def test_a_sum_of_thousands_of_terms_does_not_overflow_the_stack() -> None:
    big: Term = t.var("t")
    for i in range(2000):
        big = t.add(t.prim("sin", big), t.const(i + 0.5))
    assert dual(big, {"t": ONE})[1] is not t.ZERO
