"""`potto.to_scipy`, and what a bridge says of what it can't pass on. Expected values are closed forms."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
from scipy.optimize import least_squares, minimize
from scipy.special import ndtri

import potto
from potto.bridges.flat import FlatFunction

m = potto.compile(r"""
def area(a, c)
    integral [0, 1] a*[x < c^2]*exp(x) d(x)

def loss(c)
    ((integral [-inf, inf] [x < c]*exp(-x^2/2) d(x))/sqrt(2*pi) - 0.3)^2

def rosenbrock(x, y)
    (1 - x)^2 + 100*(y - x^2)^2

def censored(mean, width, y)
    integral [-inf, inf] [y < u]*exp(-((u - mean)/width)^2/2)/(width*sqrt(2*pi)) d(u)

def two(a, b)
    (a*b, a^2)

def quadratic(xs: [n] Real, k)
    k*sum i in 0..n-1 ((i + 1)*xs[i]^2)

def applied(shader, c)
    shader(c)

def listed(xs: [n] Real)
    [2*xs[i] for i in 0..n-1]
""")


def test_values_and_derivatives_in_a_row() -> None:
    area = potto.to_scipy(m.area, {"a": 2.0, "c": 0.5})
    e = math.exp(0.25)
    assert list(area.x0) == [2, 0.5]
    assert area.fun([2, 0.5]) == pytest.approx(2 * (e - 1), rel=1e-12)
    assert area.jac([2, 0.5]) == pytest.approx([e - 1, 2 * e], rel=1e-10)
    assert area.hess([2, 0.5]) == pytest.approx(np.array([[0, e], [e, 4 * e + 2 * e]]), rel=1e-9, abs=1e-12)
    assert area.hessp([2, 0.5], [1, 2]) == pytest.approx([2 * e, e + 12 * e], rel=1e-9)
    assert 0 <= area.error([2, 0.5]) < 1e-10
    assert area.parameters([1, 3]) == {"a": 1.0, "c": 3.0}


def test_minimize_with_first_and_second_derivatives() -> None:
    loss = potto.to_scipy(m.loss, {"c": 0.9})
    assert minimize(loss.fun, loss.x0, jac=loss.jac).x == pytest.approx([ndtri(0.3)], abs=1e-5)
    rosen = potto.to_scipy(m.rosenbrock, {"x": -1.2, "y": 1.0})
    for method, second in (("trust-exact", {"hess": rosen.hess}), ("trust-ncg", {"hessp": rosen.hessp})):
        found = minimize(rosen.fun, rosen.x0, jac=rosen.jac, method=method, **second)
        assert found.x == pytest.approx([1, 1], abs=1e-6)


def test_least_squares_of_residuals_over_an_array() -> None:
    y = np.linspace(-2, 3, 12)
    truth = np.array([0.5 * math.erfc((v - 0.7) / 1.3 / math.sqrt(2)) for v in y])
    tail = potto.to_scipy(m.censored, {"mean": 0.0, "width": 1.0}, given={"y": y})
    found = least_squares(lambda x: tail.fun(x) - truth, tail.x0, jac=tail.jac)
    assert found.x == pytest.approx([0.7, 1.3], abs=1e-6)


def test_arrays_and_tuples_of_answers() -> None:
    q = potto.to_scipy(m.quadratic, {"xs": [1.0, 2.0, 3.0], "k": 2.0})
    assert q.jac(q.x0) == pytest.approx([4, 16, 36, 36])
    assert q.hess(q.x0)[:3, :3] == pytest.approx(np.diag([4, 8, 12]))
    both = potto.to_scipy(m.two, {"a": 3.0, "b": 2.0})
    assert both.fun(both.x0) == pytest.approx([6, 9])
    assert both.jac(both.x0) == pytest.approx(np.array([[2, 3], [6, 0]]))
    several = potto.to_scipy(m.two, {"a": 3.0}, given={"b": np.array([2.0, 5.0])})
    assert several.fun([3]) == pytest.approx([6, 9, 15, 9]) and several.jac([3]).ravel() == pytest.approx([2, 6, 5, 6])


def test_what_is_asked_twice_at_one_place_is_computed_once() -> None:
    asked = potto.to_scipy(m.area, {"c": 0.5}, given={"a": 1.0})
    asked.fun([0.4])
    seen = asked._seen
    asked.jac([0.4])
    assert asked._seen is seen


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: FlatFunction(m.applied), "given={'shader'"),
        (lambda: FlatFunction(m.listed), "a number or a tuple of numbers"),
        (lambda: FlatFunction(m.area, given={"b": 1.0}), "has no parameter `b`"),
        (lambda: FlatFunction(m.area, wrt="d"), "has no parameter `d`"),
        (lambda: FlatFunction(m.area, wrt="a", given={"a": 1.0}), "`a` is given"),
        (lambda: FlatFunction(m.area).bound((1.0,), {}), "needs `c`"),
        (lambda: FlatFunction(m.area).bound((1.0,), {"a": 2.0, "c": 1.0}), "given twice"),
        (lambda: FlatFunction(m.area).bound((1.0, 2.0, 3.0), {}), "takes 2 arguments"),
        (lambda: potto.to_scipy(m.area, {}), "no parameter is named"),
        (lambda: potto.to_scipy(m.area, {"a": "x"}), "not at numbers"),
        (lambda: potto.to_scipy(m.area, {"a": 1.0}, given={"c": 1.0}).fun([1, 2]), "2 numbers are given"),
    ],
)
def test_what_cannot_be_passed_on_is_told(make, told) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(potto.PottoError) as caught:
        make()
    diagnostic = caught.value.diagnostics[0]
    assert told in f"{diagnostic.message} {diagnostic.help}"


def test_neither_library_is_imported_before_it_is_asked_for() -> None:
    program = (
        "import potto, sys; potto.to_jax, potto.to_torch, potto.to_scipy; print({'jax', 'torch'} & {*sys.modules})"
    )
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout.strip() == "set()"
