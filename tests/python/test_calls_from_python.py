"""What Python has as arguments, what its tools say about functions, and derivatives in the form that was given."""

from __future__ import annotations

import inspect
import pickle
from concurrent.futures import ProcessPoolExecutor
from decimal import Decimal
from fractions import Fraction
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

import potto

TEXT = """
# Lengths and what they weigh.

# The length of [0, 1]
# left of t.
def f(t)
    integral [0, 1] [x < t] d(x)
def g(a, t) integral [0, 1] a^2*[x < t]*x d(x)
record Pair(c: Real, d: Real)
record Camera(eye: (Real, Real), pair: Pair)
def product(p: Pair) p.c*p.d^2
def seen(q: Camera, s) q.eye.x*q.pair.c*s
def volume(p: (Real, Real)) p.x^2*p.y
def camera(t) Camera((t, t^2), Pair(t, 1))
def products(ps: [n] Pair) sum p in ps (p.c*p.d)
def curried(a)(b) a*b
def under(shader: (Real) -> Real, c) shader(c)
"""
M = potto.compile(TEXT)


class Tensor:
    """What arrays of other libraries have."""

    def __init__(self, items: Any) -> None:
        self.items = items

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.asarray(self.items, dtype=dtype)


class Scalar:
    def __float__(self) -> float:
        return 0.25


@pytest.mark.parametrize("quarter", [0.25, Fraction(1, 4), Decimal("0.25"), np.float32(0.25), np.array(0.25), Scalar(),
                                     Tensor(0.25), M.f(0.25)], ids=lambda q: type(q).__name__)  # fmt: skip
def test_numbers_of_all_kinds(quarter: Any) -> None:
    assert M.f(quarter) == 0.25


@pytest.mark.parametrize("xs", [[0.25, 0.5], np.array([0.25, 0.5]), Tensor([0.25, 0.5]), [M.f(0.25), M.f(0.5)],
                                [np.float32(0.25), Fraction(1, 2)]])  # fmt: skip
def test_batches_of_all_kinds(xs: Any) -> None:
    found = M.f(xs)
    assert found.value.tolist() == [0.25, 0.5]
    assert M.g(2, xs).value.tolist() == [0.125, 0.5]
    assert potto.grad(M.g, "t")(2, xs).tangent.tolist() == pytest.approx([1, 2], rel=1e-14)
    assert potto.deriv(M.f)((xs, 1)).tangent.tolist() == pytest.approx([1, 1], rel=1e-14)


def test_lists_of_lists_are_batches_of_two_axes() -> None:
    assert M.f([[0.25, 0.5], [0.75, 1]]).value.tolist() == [[0.25, 0.5], [0.75, 1]]
    with pytest.raises(potto.PottoError, match="a number is needed, not a list of 2"):
        M.f([[0.25], [0.5, 0.75]])
    with pytest.raises(potto.PottoError, match="a number is needed, not a list of 2"):
        M.f(["a", "b"])


def test_tuples_may_be_lists_and_arrays() -> None:
    for p in ((2, 3), [2, 3], np.array([2, 3])):
        assert M.volume(p) == 12
    assert M.volume(np.array([[2, 3], [1, 5]])).value.tolist() == [12, 5]
    assert M.volume([[2, 1], [3, 5]]).value.tolist() == [12, 5]  # a tuple of two lists
    slope = potto.grad(M.volume)(np.array([2.0, 3.0])).tangent
    assert isinstance(slope, np.ndarray) and slope.tolist() == [12, 4]
    assert potto.grad(M.volume)(np.array([[2, 3], [1, 5]])).tangent.tolist() == [[12, 4], [10, 1]]


def test_derivatives_by_records_have_the_form_of_the_record() -> None:
    assert potto.grad(M.product)({"c": 2, "d": 3}).tangent == {"c": 9, "d": 12}
    assert potto.grad(M.product)((2, 3)).tangent == (9, 12)
    slopes = potto.grad(M.seen, ["q", "s"])({"pair": {"d": 1, "c": 2}, "eye": [4, 5]}, 3)
    assert slopes["q"] == {"eye": (6, 0), "pair": {"c": 12, "d": 0}} and slopes["s"] == 8
    assert potto.vjp(M.product, 2.0)({"c": 2, "d": 3}).tangent == {"c": 18, "d": 24}
    assert potto.hvp(M.product, {"p": {"c": 1, "d": 0}})({"c": 2, "d": 3}).tangent == {"c": 0, "d": 6}
    by_fields = potto.grad(M.seen)(((4, 5), (2, 1)), 3).tangent
    assert (by_fields.eye, by_fields.pair.c) == ((6, 0), 12)


def test_derivatives_by_records_are_shown_as_records() -> None:
    record = M.camera(2.0)
    for given in (record, record.value, ((2, 4), (2, 1)), {"eye": (2, 4), "pair": {"c": 2, "d": 1}}):
        slopes = potto.grad(M.seen, ["q", "s"])(given, 3)
        assert str(slopes) == "(12, (Camera(eye=(6, 0), pair=Pair(c=6, d=0)), 4))"
    rows = potto.grad(M.products)([{"c": 2, "d": 3}, {"c": 1, "d": 4}])
    assert str(rows) == "(10, [Pair(c=3, d=2), Pair(c=4, d=1)])"
    assert rows.tangent == [{"c": 3, "d": 2}, {"c": 4, "d": 1}]


def test_duals_that_are_answers_are_arguments_of_derivatives() -> None:
    """The chain rule: what `deriv` answers goes into another one, by the place or the name of its parameter."""
    m = potto.compile("""
record Row(x: Real, y: Real)
def square(t) t^2
def times(a, b) a*b
def pair(t) (t, 5)
def powers(t) [t, t^3]
def whole(xs: [n] Real, k) k*sum x in xs (x^2)
def row(t) Row(t, t^2)
def product(r: Row, k) k*r.x*r.y
def rows(t) [Row(t, t^2), Row(t^2, 1)]
def products(rs: [n] Row, k) k*sum r in rs (r.x*r.y)
""")
    once = potto.deriv(m.square)((3.0, 1.0))
    square, times = potto.deriv(m.square), potto.deriv(m.times)
    for twice in (square(once), square(t=once), square(dt=once)):
        assert (twice.value, twice.tangent) == (81, 108)  # t^4
    assert times(once, 2).tangent == times((once, 2)).tangent == times(2, once).tangent == 12
    assert square(m.pair(3.0)).tangent == 30  # a pair of a program
    for part, whole, slope in (("powers", "whole", 2 * (2 * 2 + 6 * 2**5)), ("row", "product", 2 * 3 * 2**2),
                               ("rows", "products", 2 * (3 * 2**2 + 2 * 2))):  # fmt: skip
        inner, outer = getattr(m, part), getattr(m, whole)
        assert potto.deriv(outer)(potto.deriv(inner)((2.0, 1.0)), 2).tangent == slope
        assert potto.deriv(outer)(inner(2.0), (2.0, 1.0)).tangent == outer(inner(2.0), 1).value
    by_name = potto.deriv(m.whole)(xs=(np.array([1.0, 2.0]), np.array([1.0, 0.0])), k=2)
    assert (by_name.value, by_name.tangent) == (10, 4)
    with pytest.raises(potto.PottoError, match="P0615"):
        square(m.square(3.0))


def test_gradients_of_gradients() -> None:
    """a^2 t^2/2: by a, a t^2; by t, a^2 t; then t^2, 2 a t, a^2."""
    once = potto.grad(potto.grad(M.g))(2, 0.5)
    assert once.value == pytest.approx(0.5, rel=1e-14) and once.tangent == pytest.approx(0.25, rel=1e-14)
    both = potto.grad(potto.grad(M.g, ["a", "t"]), ["t", "a"])(2, 0.5)
    assert both.value == pytest.approx((0.5, 2), rel=1e-14)
    assert both["t"] == pytest.approx((2, 4), rel=1e-14) and both["a"] == pytest.approx((0.25, 2), rel=1e-14)
    batch = potto.grad(potto.grad(M.g, "t"), "t")(2, [0.5, 0.25])
    assert batch.tangent.tolist() == pytest.approx([4, 4], rel=1e-14) and batch.converged
    with pytest.raises(potto.PottoError, match="taken by numbers"):
        potto.grad(potto.grad(M.volume))((2, 3))


MADE = [
    potto.value_and_grad(M.g, "t"), potto.jacobian(M.g, ["a", "t"]), potto.hessian(M.g, ["a", "t"]),
    potto.jvp(M.g, {"t": 2.0}), potto.vjp(M.g, 3.0, wrt=["a"]), potto.hvp(M.g, along={"t": 2.0}),
    potto.grad(M.g, "a"), potto.grad(potto.grad(M.g, "t"), "t"), potto.deriv(M.f),
]  # fmt: skip


@pytest.mark.parametrize("made", MADE, ids=repr)
def test_derivatives_pickle_as_functions_do(made: Any) -> None:
    again = pickle.loads(pickle.dumps(made))
    arguments = ((0.5, 1.0),) if made is MADE[-1] else (2.0, 0.5)
    assert repr(again) == repr(made)
    assert np.array_equal(*(np.asarray(f(*arguments), dtype=float) for f in (again, made)))


def test_an_objective_of_scipy_pickles() -> None:
    loss = potto.to_scipy(M.g, {"t": 0.5}, given={"a": 2.0})
    again = pickle.loads(pickle.dumps(loss))
    assert again.fun([0.5]) == loss.fun([0.5]) == 0.5 and again.jac([0.5]).tolist() == loss.jac([0.5]).tolist()


def test_what_inspect_says() -> None:
    assert str(inspect.signature(M.f)) == "(t: 'Real') -> 'Real'"
    assert list(inspect.signature(M.seen).parameters) == ["q", "s"] and M.seen.__annotations__["q"] == "Camera"
    assert list(inspect.signature(M.curried).parameters) == ["a", "b"]
    assert list(inspect.signature(M.curried(2)).parameters) == ["b"]
    assert inspect.signature(M.g).bind(1, t=2).arguments == {"a": 1, "t": 2}
    assert M.f.__name__ == "f" and M.f.__doc__ == "The length of [0, 1]\nleft of t." and M.g.__doc__ is None
    assert inspect.getdoc(M) == "Lengths and what they weigh."
    assert potto.Function.__doc__ is not None and potto.Function.__doc__.startswith("A function of Potto")


def test_errors_start_with_their_message_and_travel() -> None:
    with pytest.raises(potto.PottoError) as caught:
        M.f("a")
    assert str(caught.value).startswith("the argument `t` cannot be given a Python str")
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.diagnostics == caught.value.diagnostics and str(again) == str(caught.value)
    with pytest.raises(potto.PottoError) as caught:
        potto.compile("def f(t) integral [0, 1] (x < t ? 1 : 0) d(x)")
    text = str(caught.value)
    assert text.startswith("this condition depends on the variable of integration `x` [P0301]\n -->")
    assert "^^^" in text and str(pickle.loads(pickle.dumps(caught.value))) == text


def _evaluated(function: Any, t: float) -> tuple[Any, str]:
    try:
        function("a")
    except potto.PottoError as error:
        return function(t), str(error)
    return None, ""


@pytest.mark.slow
def test_functions_answers_and_errors_come_and_go_by_processes() -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        found, error = pool.submit(_evaluated, M.f, 0.25).result()
        assert found == 0.25 and error.startswith("the argument `t`")
        slope = pool.submit(potto.grad(M.product), {"c": 2, "d": 3}).result()
        assert slope.tangent == {"c": 9, "d": 12}
        with pytest.raises(potto.PottoError, match="Python str"):
            pool.submit(M.f, "a").result()
        assert pool.submit(getattr, M, "f").result()(0.5) == 0.5


REPEATED = """
def bend(x) abs(x - 0.5)^3 + x
def corner(x) abs(x - 0.5)
def pole(x) 0.3/x
def whole(x, y) 2*x - y
def by(shader, x) shader(x)^2
def double(x) 2*x
def choice(x) if x < 0.5 then x else integral [0, x] u d(u)
def loop(x) sum i in 0..3 (x^i)
"""
GRID = np.linspace(0.0, 1.0, 12).reshape(3, 4)
KINDS = {"number": 0.3, "one": np.array([[0.3]]), "grid": GRID, "floats": GRID.astype(np.float32),
         "whole": np.arange(3), "gaps": GRID[:, ::2]}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("wrt", [None, "x"])
def test_what_is_called_again_is_answered_as_the_first_time(kind: str, wrt: str | None) -> None:
    """What calls of a kind go by is kept, not what they tell: at bends and poles, over other shapes before."""
    x = KINDS[kind]
    for name in ("bend", "corner", "pole", "whole", "choice", "loop"):
        first, again = (
            getattr(m, name) if wrt is None else potto.grad(getattr(m, name), wrt)
            for m in (potto.compile(f"{REPEATED}# {n} {name} {kind} {wrt}") for n in range(2))
        )
        rest = (0.1,) if name == "whole" else ()
        for other in (0.7, GRID, x):
            again(other, *rest)
        found, known = again(x, *rest), first(x, *rest)
        for part in ("value", "error", "tangent", "tangent_error"):
            np.testing.assert_array_equal(getattr(found, part), getattr(known, part), f"{name}: {part}")
        assert np.array_equal(found.member_converged, known.member_converged) and found.method == known.method
        assert (found.converged, found.reasons, len(found.notes)) == (known.converged, known.reasons, len(known.notes))
        assert np.shape(found.value) == np.shape(x) and found.stats.keys() == known.stats.keys()


def test_a_function_that_is_given_may_be_another_one_the_next_time() -> None:
    m = potto.compile(REPEATED)
    for shader in (m.double, m.loop, m.double, m.bend):
        for x in (0.25, GRID, np.full(3, 0.25)):
            np.testing.assert_array_equal(m.by(shader, x).value, shader(x).value ** 2)
