"""`value_and_grad`, `jacobian`, `hessian`, `vjp`, `jvp` and `grad` without names, against derivatives of closed forms.

The tolerance is 1e-11 of the number: all integrands here are polynomials or exponentials that the rules integrate to
rounding, and the answers are sums of a few of them. The error that stands beside a number must cover what is off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import potto

Closed = Callable[..., Any]
RTOL = 1e-11

# name: program with a function `f` of numbers, where, closed form (a list where the answer is a tuple)
CASES: dict[str, tuple[str, tuple[float, ...], Closed]] = {
    "boundary": ("def f(a, t) integral [0, 1] a*x*[x < t*t] d(x)", (3.0, 0.7), lambda a, t: a * t**4 / 2),
    "bound": ("def f(a, b) integral [a, a*b] x d(x)", (0.5, 3.0), lambda a, b: ((a * b) ** 2 - a**2) / 2),
    "nested": (
        "def f(a, t) integral [0, 1] (integral [0, 1] a*[y < t*x] d(y))^2 d(x)", (1.5, 0.7), lambda a, t: (a * t)**2 / 3
    ),
    "sum": (
        "def f(a, t) sum k in 1..5 (a^k*(integral [0, 1] k*[x < t/k] d(x)))", (0.9, 0.7),
        lambda a, t: t * sum(a**k for k in range(1, 6)),
    ),
    "call": (
        "def part(u, v) integral [0, 1] exp(u*x)*[x < v] d(x)\ndef f(a, b) part(a*b, b)^2 + part(a, a*b)", (0.6, 0.8),
        lambda a, b: ((mp.e ** (a * b * b) - 1) / (a * b)) ** 2 + (mp.e ** (a * a * b) - 1) / a,
    ),
    "condition": (
        "def f(a, b) if a < b then a*(integral [0, b] x d(x)) else a^2", (0.6, 0.8), lambda a, b: a * b**2 / 2
    ),
    "fold": (
        "def power(x, n) if n < 1 then 1 else x*power(x, n - 1)\n"
        "def f(a, t) power(a, 4)*(integral [0, 1] [x < t] d(x))", (1.2, 0.4), lambda a, t: a**4 * t,
    ),
    "tuple": (
        "def f(a, t) (a*t^2, integral [0, 1] a*[x < t] d(x), exp(a))", (1.2, 0.4),
        lambda a, t: [a * t**2, a * t, mp.e**a],
    ),
}  # fmt: skip
SINGLE = [name for name in CASES if name != "tuple"]


def exact(closed: Closed, at: tuple[float, ...], *orders: int) -> Any:
    with mp.workdps(30):
        point = tuple(mp.mpf(a) for a in at)
        value = closed(*point)
        if isinstance(value, list):
            return [float(mp.diff(lambda *p, i=i: closed(*p)[i], point, orders)) for i in range(len(value))]
        return float(mp.diff(closed, point, orders))


def gradient(closed: Closed, at: tuple[float, ...]) -> Any:
    """(answers, parameters), or (parameters,) for one answer."""
    return np.array([exact(closed, at, 1, 0), exact(closed, at, 0, 1)]).T


def hold(value: Any, error: Any, wanted: Any) -> None:
    value, error, wanted = (np.asarray(x, dtype=float) for x in (value, error, wanted))
    assert value.shape == wanted.shape
    off = np.abs(value - wanted)
    assert (off <= RTOL * np.maximum(1, np.abs(wanted))).all()
    assert (off <= error + 1e-15 * np.maximum(1, np.abs(wanted))).all()


@pytest.mark.parametrize("name", CASES)
def test_all_of_them_agree_with_closed_forms(name: str) -> None:
    text, at, closed = CASES[name]
    f = potto.compile(text).f
    wanted = gradient(closed, at)
    matrix = potto.jacobian(f, f.parameters)(*at)
    hold(matrix.value, matrix.error, wanted)
    assert matrix.converged

    along = potto.jvp(f, dict(zip(f.parameters, (0.75, -1.25))))(*at)
    hold(along.tangent, along.tangent_error, wanted @ (0.75, -1.25))
    hold(along.value, along.error, exact(closed, at, 0, 0))

    weights: Any = (1.5, -2.0, 0.5) if wanted.ndim == 2 else 1.5
    pulled = potto.vjp(f, weights, f.parameters)(*at)
    hold(pulled.tangent, pulled.tangent_error, np.asarray(weights) @ wanted if wanted.ndim == 2 else weights * wanted)
    hold(pulled.value, pulled.error, exact(closed, at, 0, 0))


@pytest.mark.parametrize("name", SINGLE)
def test_values_with_gradients_and_hessians(name: str) -> None:
    text, at, closed = CASES[name]
    f = potto.compile(text).f
    value, slope = potto.value_and_grad(f, f.parameters)(*at)
    hold(value.value, value.error, exact(closed, at, 0, 0))
    hold(slope.value, slope.error, gradient(closed, at))
    assert value.tangent is None and slope.tangent is None
    second = potto.hessian(f, f.parameters)(*at)
    wanted = [[exact(closed, at, 2, 0), exact(closed, at, 1, 1)], [exact(closed, at, 1, 1), exact(closed, at, 0, 2)]]
    hold(second.value, second.error, wanted)


def test_derivatives_have_the_names_of_their_parameters() -> None:
    f = potto.compile("def f(a, t) integral [0, 1] a*[x < t] d(x)").f
    slope = potto.value_and_grad(f, ["t", "a"])(3.0, 0.25)[1]
    hold(slope["a"].value, slope["a"].error, 0.25)
    hold(slope["t"].value, slope["t"].error, 3.0)
    assert slope["a"] == slope[1] and potto.value_and_grad(f, "t")(3.0, 0.25)[1]["t"] == 3.0
    for answer in (slope, potto.grad(f, ["t", "a"])(3.0, 0.25)):
        with pytest.raises(KeyError, match="no derivative by 'b' here, but by t, a"):
            answer["b"]


def test_the_first_parameter_is_meant_where_none_is_named() -> None:
    f = potto.compile(CASES["boundary"][0]).f
    at = CASES["boundary"][1]
    by_first = 0.7**4 / 2
    assert float(potto.value_and_grad(f)(*at)[1]) == pytest.approx(by_first, rel=RTOL)
    for found in (potto.grad(f)(*at).tangent, potto.jacobian(f)(*at).value, potto.vjp(f, 2.0)(*at).tangent / 2):
        assert found == pytest.approx(by_first, rel=RTOL)
    assert potto.hessian(f)(*at).value == pytest.approx(0.0, abs=1e-14)  # linear in a: what is left is rounding


def test_arrays_broadcast_and_come_first() -> None:
    f = potto.compile(CASES["tuple"][0]).f
    a, t = np.array([[1.0], [2.0]]), np.array([0.2, 0.4, 0.6])
    wide_a, wide_t = np.broadcast_arrays(a, t)
    matrix = potto.jacobian(f, ["a", "t"])(a, t).value
    wanted = [[wide_t**2, 2 * wide_a * wide_t], [wide_t, wide_a], [np.exp(wide_a), 0 * wide_a]]
    np.testing.assert_allclose(matrix, np.moveaxis(np.array(wanted), (0, 1), (-2, -1)), rtol=RTOL)
    pulled = potto.vjp(f, (1.0, t, 0.0), ["t"])(a, t)
    np.testing.assert_allclose(pulled.tangent, 2 * wide_a * wide_t + wide_t * wide_a, rtol=RTOL)
    g = potto.compile("def g(a, t) integral [0, 1] a^2*[x < t^3] d(x)").g
    second = potto.hessian(g, ["a", "t"])(a, t)
    np.testing.assert_allclose(second.value[..., 0, 1], 6 * wide_a * wide_t**2, rtol=RTOL)
    np.testing.assert_allclose(second.value[..., 1, 1], 6 * wide_a**2 * wide_t, rtol=RTOL)
    assert second.converged and second.member_converged.shape == (2, 3)


def test_parameters_that_are_tuples() -> None:
    f = potto.compile("def f(p, q) integral [0, 1] fst(p)^2*[x < snd(p)*q] d(x)").f
    at = (3.0, 0.5), 0.25
    assert np.allclose(potto.grad(f)(*at).tangent, (0.75, 2.25), rtol=RTOL)
    assert np.allclose(potto.jacobian(f, ["q", "p"])(*at).value, (4.5, 0.75, 2.25), rtol=RTOL)
    assert np.allclose(potto.jvp(f, {"p": (1.0, 2.0), "q": 3.0})(*at).tangent, 0.75 + 4.5 + 13.5, rtol=RTOL)
    wanted = [[0.25, 1.5, 3.0], [1.5, 0.0, 9.0], [3.0, 9.0, 0.0]]
    np.testing.assert_allclose(potto.hessian(f, ["p", "q"])(*at).value, wanted, rtol=RTOL, atol=1e-13)
    product = potto.hvp(f, {"p": (1.0, 2.0), "q": 0.0})(*at)
    assert np.allclose(product["p"], (0.25 + 3.0, 1.5), rtol=RTOL) and np.isclose(product["q"], 21.0, rtol=RTOL)


MODULE = "def f(a, s) integral [0, 1] s(x)*[x < a] d(x)\ndef square(x) x^2\ndef two(a, b) (a*b, a)\ndef later(a)(b) a*b"


def test_functions_stand_beside_parameters() -> None:
    m = potto.compile(MODULE)
    assert potto.value_and_grad(m.f)(0.5, m.square)[1].value == pytest.approx(0.25, rel=RTOL)
    assert potto.hessian(m.f)(0.5, m.square).value == pytest.approx(1.0, rel=RTOL)


@pytest.mark.parametrize(("mistake", "message"), [
    (lambda m: potto.grad(m.f, "b"), "no parameter `b`"),
    (lambda m: potto.jacobian(m.f, 0), "takes the names of parameters, not 0"),
    (lambda m: potto.hessian(m.f, []), "names no parameter"),
    (lambda m: potto.value_and_grad(m.f, "s")(0.5, m.square), "`s` is a function and not a number"),
    (lambda m: potto.jvp(m.f, {"s": 1.0})(0.5, m.square), "`s` is a function and not a number"),
    (lambda m: potto.jvp(m.f, {"z": 1.0}), "no parameter `z`"),
    (lambda m: potto.jvp(m.two, {"a": (1.0, 2.0)})(1.0, 2.0), "must have its form, a number"),
    (lambda m: potto.vjp(m.two, 1.0)(1.0, 2.0), "a tuple of 2, and is a number"),
    (lambda m: potto.vjp(m.two, (1.0, 2.0, 3.0))(1.0, 2.0), "a tuple of 2, and is a tuple of 3"),
    (lambda m: potto.vjp(m.two, (1.0, np.ones(3)))(np.ones(2), 2.0), "do not broadcast"),
    (lambda m: potto.vjp(m.two, "one")(1.0, 2.0), "cannot be given a Python str"),
    (lambda m: potto.hessian(m.two)(1.0, 2.0), "only a function that gives one number"),
    (lambda m: potto.jvp(m.later, {"b": 1.0})(1.0), "given no value"),
    (lambda m: potto.vjp(m.later, 1.0, "b")(1.0), "given no value"),
    (lambda m: potto.vjp(abs, 1.0), "not a Python builtin_function_or_method"),
])  # fmt: skip
def test_mistakes_are_told(mistake: Callable[[Any], Any], message: str) -> None:
    with pytest.raises(potto.PottoError, match=message):
        mistake(potto.compile(MODULE))


def test_the_derivative_of_what_is_left_of_a_function() -> None:
    """Of one to which its first group was given, a number or a function: as of any other. It was a function."""
    m = potto.compile(
        "def g(a)(x) a*a*x\ndef times(f)(x) f(x)*x\ndef q(u) u^3\ndef j(c)(t, r) integral [0, 1] [x < t]*c*r d(x)"
    )
    for found, exact in (
        (potto.deriv(m.g(3.0))((2.0, 1.0)), (18.0, 9.0)),
        (potto.deriv(m.times(m.q))((2.0, 1.0)), (16.0, 32.0)),
        (potto.deriv(m.j(2.0))((0.5, 1.0), (3.0, 0.0)), (3.0, 6.0)),
    ):
        assert (found.value, found.tangent) == pytest.approx(exact, rel=RTOL)
