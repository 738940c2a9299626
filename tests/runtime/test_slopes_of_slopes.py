"""Derivatives of functions that take a derivative themselves: of one argument, the others standing still."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import potto

PROGRAM = """
def cut(t, c) integral [0, 1] [x < t]*c*x d(x)
def total(ws: [n] Real, t) sum w in ws (integral [0, 1] [x < t*w]*x d(x))
def part(s, b) integral ([0, 1], [0, 1]) [s*exp(z)*exp(w) < b] d(z, w)

def by_number(t) snd(deriv(cut)((t, 1), 2))
def by_array(t) snd(deriv(total)([1, 0.5], (t, 1)))
def by_scale(s) snd(deriv(part)((s, 1), 3))
"""


@pytest.mark.parametrize(
    ("name", "place", "value", "slope"),
    [
        ("by_number", 0.3, 0.6, 2),  # c t^2/2: the argument that is a plain number has tangent 0
        ("by_array", 0.3, 0.375, 1.25),  # t^2/2 (1 + 1/4)
        # with u = 2 - log(3/s) the area is 1 - u^2/2; z only scales its own surface
        ("by_scale", 1.0, -0.9013877113318903, -0.0986122886681097),
    ],
)
def test_slope_of_a_slope(name: str, place: float, value: float, slope: float) -> None:
    found = potto.compile(PROGRAM).eval(f"deriv({name})(({place}, 1))")
    assert found.converged
    assert abs(float(found.value) - value) < 1e-13 and abs(float(found.tangent) - slope) < 1e-12


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_powers_of_a_negative_base_by_an_exponent_that_stands_still(backend: Any) -> None:
    """x^n with n a parameter is differentiable by x below 0 for whole n: by n, which stands still, it is not. Closed
    forms, to some roundings. What n - 1 rounds off is nothing there, and errors of such slopes were infinite."""
    m = potto.compile("def f(x, n) x^n\ndef g(x, n) n*x^(n - 1)\ndef h(x, n) integral [0, 1] (y*x)^(n - 1) d(y)")
    with potto.settings(backend=backend):
        second = potto.hessian(m.f, ["x"])(-2.0, 3.0)
        assert abs(second.value + 12) <= second.error <= 1e-14 and second.converged
        x, n = np.array([-2.0, -1.0, 2.0]), np.array([3.0, 4.0, 5.0])
        slope = potto.grad(m.g, ["x"])(x, n)
        assert np.all(np.abs(slope.tangent - n * (n - 1) * x ** (n - 2)) <= slope.tangent_error)
        assert (slope.tangent_error <= 2e-15 * np.abs(slope.tangent)).all() and slope.converged
        inside = potto.grad(m.h, ["x"])(-2.0, 3.0)
        assert abs(inside.tangent + 4 / 3) <= inside.tangent_error <= 1e-12
        mixed = potto.hessian(m.f, ["x", "n"])(-2.0, 3.0)
        assert abs(mixed.value[0, 0] + 12) <= 1e-14 and not mixed.converged and np.isnan(mixed.value[0, 1])


ANGLE = "def f(x, y) atan2(y, x)"


@pytest.mark.parametrize("x", [1e-3, 0.3, 1.0, 2.0])
def test_second_derivatives_on_the_side_of_the_origin_where_an_angle_does_not_jump(x: float) -> None:
    """They are (2xy, y^2 - x^2, -2xy)/(x^2 + y^2)^2, to some roundings of 1/x^2."""
    matrix = potto.hessian(potto.compile(ANGLE).f, ["x", "y"])(x, 0.0)
    exact = np.array([[0, -1], [-1, 0]]) / x**2
    assert (np.abs(matrix.value - exact) <= matrix.error + 4e-16 / x**2).all() and (matrix.error <= 1e-14 / x**2).all()
    assert matrix.converged and not matrix.notes


def test_a_batch_of_which_some_members_lie_on_the_axis() -> None:
    x, y = np.array([1.0, 2.0, 0.5]), np.array([0.0, 0.5, 0.0])
    matrix = potto.hessian(potto.compile(ANGLE).f, ["x", "y"])(x, y)
    exact = np.array([[2 * x * y, y**2 - x**2], [y**2 - x**2, -2 * x * y]]) / (x**2 + y**2) ** 2
    assert (np.abs(np.moveaxis(matrix.value, 0, -1) - exact) <= 1e-14).all() and matrix.converged


def test_so_with_a_branch_whose_sides_agree_to_the_second_order() -> None:
    matrix = potto.hessian(potto.compile("def f(x, y) [x > 0]*x^3 + y^2").f, ["x", "y"])(0.0, 1.0)
    assert matrix.value.tolist() == [[0, 0], [0, 2]] and matrix.converged


@pytest.mark.parametrize(
    ("body", "at"),
    [
        ("atan2(y, x)", (-1.0, 0.0)),
        ("atan2(y, x)", (0.0, 0.0)),
        ("(integral [0, 1] [u < x]*[u < 2*x - 1/2] d(u))*y", (0.5, 1.0)),
    ],
)
def test_there_is_none_where_sides_differ(body: str, at: tuple[float, float]) -> None:
    with pytest.raises(potto.PottoError) as caught:
        potto.hessian(potto.compile(f"def f(x, y) {body}").f, ["x", "y"])(*at)
    assert caught.value.diagnostics[0].code == "P0505"


def test_of_some_numbers_there_is_none() -> None:
    """The first derivative by x jumps in one, in the other that by y does so across: these rows are not known."""
    matrix = potto.hessian(potto.compile("def f(x, y) [x > 0]*x + y^2").f, ["x", "y"])(0.0, 1.0)
    assert np.isnan(matrix.value[0]).all() and np.isinf(matrix.error[0]).all() and not matrix.converged
    assert matrix.value[1].tolist() == [0, 2] and matrix.reasons[0].startswith("no second derivative is known here")
    matrix = potto.hessian(potto.compile("def f(x, y) [x > 0]*y^2 + x").f, ["x", "y"])(0.0, 0.0)
    assert np.isnan(matrix.value[1]).all() and matrix.value[0].tolist() == [0, 0] and not matrix.converged


def test_those_to_either_side_are_told() -> None:
    (note,) = potto.hessian(potto.compile("def f(x, y) [x > 0]*x^2 + y^2").f, ["x", "y"])(0.0, 1.0).notes
    assert np.array_equal(note.backward, [[0, 0], [0, 2]]) and np.array_equal(note.forward, [[2, 0], [0, 2]])
    corner = potto.hessian(potto.compile("def f(t) integral ([0, 1], [0, 1]) [x + y < t] d(x, y)").f)
    at = corner(1.0)  # t^2/2 below, 1 - (2 - t)^2/2 beyond
    assert abs(at.notes[0].backward - 1) <= 1e-9 and abs(at.notes[0].forward + 1) <= 1e-9
    assert np.allclose(corner(np.array([0.5, 1.0, 1.5])).value[[0, 2]], [1, -1], rtol=0, atol=1e-12)


def test_members_of_a_batch_that_have_none_spoil_no_others() -> None:
    """min(a, b) jumps in its slope where a = b."""
    found = potto.hessian(potto.compile("def f(a, b) integral [0, 1] [x < a]*[x < b]*x d(x)").f, ["a"])(
        np.array([0.3, 0.5, 0.7]), 0.5
    )
    assert found.value[[0, 2]].tolist() == [1, 0] and np.isnan(found.value[1])
    assert found.member_converged.tolist() == [True, False, True]


@pytest.mark.parametrize(
    ("body", "at", "bend"),
    [
        ("integral [0, 1] (sum k in 0..3 ([x < k*t/3]*x)) d(x)", 0.5, 14 / 9),  # of k^2 t^2/18, with k = 0 among them
        ("integral ([0, 1], [0, 1]) (sum k in 0..3 ([x < k*t*y/3]*x)) d(x, y)", 0.5, 14 / 27),
        ("integral [0, 1] [x < t*0]*x d(x) + t^2", 0.5, 2),
        ("integral [0, 1] [x < t^2] d(x)", 0.0, 2),  # rests there but for a moment: nothing at t, something beside
    ],
)
def test_roots_that_rest_on_a_bound(body: str, at: float, bend: float) -> None:
    found = potto.hessian(potto.compile(f"def f(t) {body}").f)(at)
    assert abs(found.value - bend) <= found.error + 1e-14 and found.error <= 1e-9 and found.converged


def test_derivatives_of_a_power_of_nothing() -> None:
    """0^y is infinite below y = 0, 1 at it and 0 above: the slope by y was 0. So was that of y*x^(y - 1), at y = 1."""
    f = potto.compile("def f(x, y) x^y").f
    slopes = potto.grad(f, ["x", "y"])(0.0, 0.0)
    assert slopes.tangent[0] == 0 and slopes.tangent[1] == -np.inf
    none = potto.hessian(f, ["x", "y"])(0.0, 0.0)
    assert not none.converged and none.error[1, 1] == np.inf
    assert potto.hessian(f, ["x", "y"])(0.0, 1.0).value[0, 1] == -np.inf
    for y in (2.0, 2.5, 3.0):  # what is like x^(y - 1)*log(x) vanishes at x = 0
        matrix = potto.hessian(f, ["x", "y"])(0.0, y)
        assert matrix.value.tolist() == [[2.0 * (y == 2), 0], [0, 0]] and matrix.converged
