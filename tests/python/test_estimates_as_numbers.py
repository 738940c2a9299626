"""Answers in the arithmetic of Python and numpy: values as of floats and arrays, errors to first order."""

from __future__ import annotations

import copy
import json
import math
import pickle
import statistics
from decimal import Decimal
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import potto
from potto import Estimate
from potto.runtime.answers.arithmetic import SLOPES

M = potto.compile("""
# The length of [0, 1] left of t.
def f(t)
    integral [0, 1] [x < t] d(x)
def two(t)
    (t, integral [0, 1] [x < t]*x d(x))
def left(x, c)
    integral [0, 1] [u*x < c] d(u)
""")
R, S = Estimate(2.0, 0.25, evals=3, seconds=1.0, method="mc"), Estimate(0.5, 0.125, evals=4, method="quadrature")
XS = np.linspace(0, 1, 5)


def test_one_number() -> None:
    r = M.f(0.3)
    assert float(r) == 0.3 and int(r) == 0 and bool(r) and not bool(M.f(-1))
    assert r + 1 == 1.3 and 1 - r == 0.7 and 2 * r == 0.6 and r / 3 == 0.3 / 3 and -r == -0.3 and abs(-r) == 0.3
    assert r**2 == 0.3**2 and 2**r == 2**0.3 and r % 0.25 == 0.3 % 0.25 and r // 0.25 == 1
    assert 0 < r < 1 and r <= 0.3 and r >= 0.3 and r != 0.4 and (r == 0.4) is False and r != "0.3"
    assert sum([r, M.f(0.2)]) == 0.5 and max(r, M.f(0.2)) is r and sorted([r, M.f(0.1)])[0] == 0.1
    assert round(r) == 0 and isinstance(round(r), int) and round(M.f(0.256), 2) == 0.26
    assert math.sin(r) == math.sin(0.3) and math.floor(r) == 0 and math.isclose(r, 0.3)
    assert r + Fraction(1, 2) == 0.8 and r + Decimal("0.5") == 0.8 and r + np.float32(0.5) == 0.8 and r + True == 1.3
    assert hash(r) == hash(0.3) and {r: "found"}[0.3] == "found"


def test_formats() -> None:
    r = M.f(0.3)
    assert f"{r:.3f}" == "0.300" and f"{r:8.2e}|" == "3.00e-01|"
    assert f"{M.f(XS):.2f}" == "[0.00, 0.25, 0.50, 0.75, 1.00]" and f"{M.two(0.5):.1f}" == "(0.5, 0.1)"
    bar = Estimate(0.349858807576, 4.05e-12, evals=5, seconds=1e-4)
    assert repr(bar) == "0.3498588075760(41)  5 evaluations  0.1 ms"
    assert str(bar) == f"{bar}" == "0.3498588075760(41)"
    assert repr(Estimate(0.5, 0.1, converged=False)).startswith("not converged: 0.50(10)  ")
    assert str(Estimate(0.5, 0.1, converged=False)) == "not converged: 0.50(10)"


def test_whole_parts_and_complex_numbers() -> None:
    found = divmod(Estimate(7.5, 0.25), 2)
    assert found == (3, 1.5) and found[1].error == pytest.approx(0.25) and divmod(7, Estimate(2.5, 0.25)) == (2, 2)
    assert math.trunc(Estimate(-2.5, 0.1)) == -2 and math.ceil(R + 0.5) == 3
    assert R + 1j == 2 + 1j and 1j * R == 2j and R == 2 + 0j and (R * np.array([1j, 2])).tolist() == [2j, 4]
    assert statistics.fmean([R, S]) == 1.25 and json.dumps({"r": R}, default=float) == '{"r": 2.0}'
    for wrong in (lambda: R < 1j, lambda: divmod(R, "2"), lambda: divmod("2", R)):
        with pytest.raises(TypeError, match=r"unsupported operand|not supported between"):
            wrong()


def test_sums_means_and_products_of_arrays_keep_errors() -> None:
    """By interval arithmetic on small whole numbers, where nothing but the rounding on top is rounded."""
    b = Estimate(np.arange(6.0).reshape(2, 3), np.full((2, 3), 0.25))
    assert b.sum() == 15 and b.sum().error == 1.5 and b.sum(axis=0) == pytest.approx([3, 5, 7])
    assert b.mean() == 2.5 and b.mean().error == pytest.approx(0.25, rel=1e-15) and np.mean(b, axis=1).error[1] < 0.2501
    assert b.min() == 0 and (np.max(b, axis=1) == [2, 5]).all() and b.max().error == 0.25
    assert b.mean(axis=1, keepdims=True).shape == (2, 1) and R.mean() == 2
    assert R.mean().error == pytest.approx(0.25, rel=1e-15)  # and the rounding of a product
    exact = np.array([1.0, -2.0, 3.0])
    product = b @ exact
    assert product.value.tolist() == [4, 10] and product.error == pytest.approx([1.5, 1.5]) and exact @ b[0] == 4
    assert (b[0] @ b[1]).error == pytest.approx(0.25 * (0 + 1 + 2) + 0.25 * (3 + 4 + 5))  # |x|dy + dx|y|


def test_rows_of_an_array_stand_in_brackets() -> None:
    assert str(Estimate(np.arange(4.0).reshape(2, 2), np.zeros((2, 2)))) == "[[0, 1], [2, 3]]"
    wide = str(Estimate(np.zeros((20, 20)), np.zeros((20, 20))))
    assert wide == f"[[{'0, ' * 12}...], ...]" and str(Estimate(np.zeros((3, 5)), 0.0)).count("]") == 3
    assert str(Estimate(np.zeros((2, 0)), 0.0)) == "[[], []]"


def test_errors_of_sums_and_products() -> None:
    for found, error in [(R + S, 0.375), (R - S, 0.375), (R * S, 0.375), (R / S, 1.5), (3 * R, 0.75), (-R, 0.25),
                         (abs(-R), 0.25), (R + 1, 0.25), (R**2, 1.0), (np.maximum(R, S), 0.25)]:  # fmt: skip
        assert found.error == pytest.approx(error, rel=1e-12), found
    assert (R - R).error == 0.5  # it is not known that both are one
    assert (Estimate(3.0, 0.0) * 2).error == 0.0  # what is exact stays exact


def test_what_was_computed_cost_what_its_parts_did() -> None:
    found = R + S
    assert isinstance(found, Estimate) and found.evals == 7 and found.seconds == 1.0 and found.method == "mc+quadrature"
    missed = Estimate(1.0, 0.5, converged=False)
    assert not (R + missed).converged and (R + S).converged


@pytest.mark.parametrize("ufunc", [u for u in SLOPES if u.nin == 1], ids=lambda u: u.__name__)
@given(at=st.floats(0.05, 0.9))
def test_slopes_of_functions_are_the_derivatives(ufunc: np.ufunc, at: float) -> None:
    at = at + 1.1 if ufunc is np.arccosh else at
    known = {"absolute": "fabs", "arcsin": "asin", "arccos": "acos", "arctan": "atan", "arcsinh": "asinh",
             "arccosh": "acosh", "arctanh": "atanh"}  # fmt: skip
    plain = {"negative": lambda x: -x, "positive": lambda x: x, "conjugate": lambda x: x, "square": lambda x: x * x,
             "reciprocal": lambda x: 1 / x, "exp2": lambda x: 2**x, "log2": lambda x: mpmath.log(x, 2),
             "rad2deg": mpmath.degrees, "deg2rad": mpmath.radians}  # fmt: skip
    name = ufunc.__name__
    function = plain.get(name) or getattr(mpmath, known.get(name, name))
    with mpmath.workdps(40):
        slope = abs(float(mpmath.diff(function, at)))
    found: Any = ufunc(Estimate(at, 1e-3))
    assert found.value == ufunc(at) and found.error == pytest.approx(1e-3 * slope, rel=1e-6)


@pytest.mark.parametrize("ufunc", [u for u in SLOPES if u.nin == 2 and u not in (np.remainder, np.fmod, np.copysign)],
                         ids=lambda u: u.__name__)  # fmt: skip
@given(x=st.floats(0.1, 3), y=st.floats(0.1, 3))
def test_slopes_of_two_arguments_are_those_of_differences(ufunc: np.ufunc, x: float, y: float) -> None:
    h = 1e-6
    dx = abs(ufunc(x + h, y) - ufunc(x - h, y)) / (2 * h)
    dy = abs(ufunc(x, y + h) - ufunc(x, y - h)) / (2 * h)
    found: Any = ufunc(Estimate(x, 1e-3), Estimate(y, 2e-3))
    assert found.error == pytest.approx(1e-3 * dx + 2e-3 * dy, rel=1e-5, abs=1e-11)


@given(st.floats(-5, 5), st.floats(1e-9, 1e-6), st.floats(-1, 1))
def test_an_interval_stays_around_what_it_was_around(x: float, error: float, off: float) -> None:
    """Whatever within the error the true number is, the result's interval has it, up to second order."""
    true, known = x + off * error, Estimate(x, error)
    for function in (lambda v: v * 3 + 1, lambda v: v * v - v, np.sin, np.exp, lambda v: 1 / (v * v + 1), abs):
        found = function(known)
        assert abs(found.value - function(true)) <= found.error + 200 * error**2 + 1e-12 * abs(found.value)


def test_arrays() -> None:
    r = M.f(XS)
    assert r.shape == (5,) and r.ndim == 1 and r.size == 5 and len(r) == 5
    assert np.asarray(r).dtype == float and np.asarray(r).tolist() == r.value.tolist()
    assert np.stack([r, r]).shape == (2, 5) and np.array([M.f(0.1), M.f(0.2)]).tolist() == [0.1, 0.2]
    assert (r + 1).shape == (5,) and isinstance(r + XS, Estimate) and isinstance(XS + r, Estimate)
    assert np.allclose(XS + r, 2 * XS) and np.isclose(M.f(0.3), 0.3) and np.allclose([r], XS)
    assert (r < 0.4).tolist() == [True, True, False, False, False] and (r == XS).all()
    assert r[1] == 0.25 and isinstance(r[1], Estimate) and r[1:3].shape == (2,) and r[r > 0.6].shape == (2,)
    assert [float(x) for x in r] == XS.tolist() and float(sum(r)) == 2.5 and float(np.sum(r)) == 2.5
    assert np.sum(r).error == pytest.approx(r.error.sum()) and float(np.max(r)) == 1 and np.mean(r) == 0.5
    assert np.interp(0.1, XS, r) == pytest.approx(0.1) and np.dot(XS, r) == pytest.approx(XS @ XS)
    assert np.round(r, 1).tolist() == [0, 0.2, 0.5, 0.8, 1]
    with pytest.raises(ValueError, match="ambiguous"):
        bool(r == XS)


def test_other_libraries_take_them_by_dlpack() -> None:
    assert np.from_dlpack(M.f(XS)).tolist() == XS.tolist() and np.from_dlpack(M.f(0.25)) == 0.25  # type: ignore[arg-type]


def test_members_keep_what_they_missed() -> None:
    with potto.settings(method="mc", samples=64, seed=1, rtol=1e-9, max_evals=64):
        r = M.left(np.array([0.1, 1.0, 2.0]), 0.7)
    assert r.member_converged.tolist() == [r[i].converged for i in range(3)]
    assert r[2].reasons == r.reasons_of(2) and not r[2].converged
    assert not (r + M.f(0.3)).converged and (r + M.f(0.3)).member_converged.tolist() == r.member_converged.tolist()


def test_tuples_are_taken_apart() -> None:
    a, b = M.two(0.5)
    assert a == 0.5 and b == 0.125 and isinstance(b, Estimate) and b.error == M.two(0.5).error[1]
    assert M.two(0.5)[1] == 0.125 and len(M.two(0.5)) == 2 and M.two(0.5) == (0.5, 0.125)
    first, second = M.two(XS)
    assert first.shape == (5,) and second[4] == 0.5 and np.asarray(M.two(XS)).shape == (2, 5)
    with pytest.raises(TypeError, match="tuple of 2"):
        M.two(0.5) + 1
    value, tangent = potto.deriv(M.f)((0.3, 1))
    assert value == 0.3 and tangent == 1


def test_a_value_with_its_derivative_takes_no_part_in_arithmetic() -> None:
    r = potto.grad(M.f)(0.3)
    for wrong in (lambda: r + 1, lambda: r < 1, lambda: np.sin(r)):
        with pytest.raises(TypeError, match=r"write `\.value` or `\.tangent`"):
            wrong()


def test_what_is_no_number_is_refused_by_python() -> None:
    for wrong in (lambda: R + "1", lambda: R < "1", lambda: R + None, lambda: len(R), lambda: R[0], lambda: list(R)):
        with pytest.raises(TypeError):
            wrong()
    with pytest.raises(TypeError, match="hashed"):
        hash(M.f(XS))


def test_copies_and_pickles_are_equal() -> None:
    for r in (M.f(0.3), M.two(0.5), potto.grad(M.f)(0.3)):
        assert pickle.loads(pickle.dumps(r)) == r and copy.deepcopy(r) == r
    assert (pickle.loads(pickle.dumps(M.f(XS))) == XS).all()


def test_notebooks() -> None:
    r = Estimate(0.027, 0.0051, evals=5, seconds=1e-4)
    assert r._repr_latex_() == r"$0.0270 \pm 0.0051$"
    assert "<code>0.0270 ± 0.0051</code>" in r._repr_html_() and "5 evaluations" in r._repr_html_()
    assert Estimate(2.7e-7, 5.1e-9)._repr_latex_() == r"$2.700 \times 10^{-7} \pm 5.1 \times 10^{-9}$"
    assert "not converged" in Estimate(1.0, 0.5, converged=False)._repr_html_()
    assert Estimate(0.5, 0.1, converged=False)._repr_latex_() == r"$\text{not converged: }0.50 \pm 0.10$"
    many = Estimate(np.arange(20.0), np.full(20, 0.5))
    assert r"\text{at most }0.50" in many._repr_latex_() and repr(Estimate(1.0, 0.0, evals=1)).endswith(
        "1 evaluation  0.0 ms"
    )
    assert Estimate(math.inf, 0.0)._repr_latex_() == r"$\infty$"


def test_scipy_finds_a_root() -> None:
    from scipy.integrate import quad
    from scipy.optimize import brentq, minimize_scalar

    assert brentq(lambda t: M.f(t) - 0.25, 0, 1) == pytest.approx(0.25, abs=1e-9)
    assert brentq(lambda t: M.two(t)[1] - 0.125, 0.1, 1) == pytest.approx(0.5, abs=1e-9)
    assert quad(M.f, 0, 1)[0] == pytest.approx(0.5, abs=1e-9)
    assert minimize_scalar(lambda t: (M.f(t) - 0.25) ** 2, bounds=(0, 1)).x == pytest.approx(0.25, abs=1e-4)


def test_matplotlib_plots_answers() -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot", reason="matplotlib is not installed")
    figure, axes = pyplot.subplots()
    axes.plot(XS, M.f(XS))
    axes.errorbar(XS, M.f(XS), yerr=M.f(XS).error)
    axes.axhline(M.f(0.3))
    assert axes.lines[0].get_ydata(orig=False).tolist() == XS.tolist()
    pyplot.close(figure)
