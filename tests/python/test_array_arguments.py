"""Arrays of Python as arrays of Potto and back: batches of them, derivatives by them, fits of them."""

from __future__ import annotations

import math
import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import potto
from potto.python import derived_calls

MODULE = potto.compile("""
def total(xs: [n] Real, k) sum i in 0..n-1 (k*xs[i]^2)
def scaled(xs: [n] Real, k) [k*x^2 for x in xs]
def grid(a: [n, m] Real) sum i in 0..n-1, j in 0..m-1 ((i + 1)*a[i, j]^3)
def turned(a: [n, m] Real) [a[i, j] for j in 0..m-1, i in 0..n-1]
def areas(ps: [n] (Real, Real)) sum p in ps (p.x^2*p.y)
def mirrored(ps: [n] (Real, Real)) [(p.y, 2*p.x) for p in ps]
def bent(xs: [n] Real) sum i in 0..n-1 (xs[i]^3*xs[0])
def mean(xs: [n] Real) (sum x in xs (x))/n
def ends(xs: [n] Real, k) (xs[0]*k, xs[n - 1])
def both(u: ([n] Real, Real)) (sum x in u.0 (x^2))*u.1
""")

numbers = st.integers(-8, 8).map(float)  # so that what is expected is exact


def array(*shape: st.SearchStrategy[int] | int) -> st.SearchStrategy[Any]:
    sizes = st.tuples(*[st.just(n) if isinstance(n, int) else n for n in shape])
    return arrays.arrays(float, sizes, elements=numbers)


few = st.integers(1, 4)


# Batches


@given(array(few, few, few))
def test_axes_before_those_of_an_array_are_a_batch(xs: Any) -> None:
    found = MODULE.total(xs, 2.0)
    assert found.value.tolist() == (2 * xs**2).sum(axis=-1).tolist()
    assert MODULE.scaled(xs, 2.0).value.tolist() == (2 * xs**2).tolist()


@given(array(3, few), array(2, 1))
def test_batches_of_arrays_and_of_numbers_broadcast(xs: Any, k: Any) -> None:
    found = MODULE.scaled(xs, k)
    assert found.value.tolist() == (k[..., None] * xs**2).tolist()
    assert found.error.shape == found.value.shape


@given(array(few, few, few))
def test_a_batch_of_matrices(a: Any) -> None:
    rows = np.arange(1.0, a.shape[1] + 1)[:, None]
    found = potto.grad(MODULE.grid)(a)
    assert found.value.tolist() == (rows * a**3).sum(axis=(1, 2)).tolist()
    assert found.tangent.tolist() == (3 * rows * a**2).tolist()
    assert MODULE.turned(a).value.tolist() == np.swapaxes(a, -1, -2).tolist()


@given(array(few, few, 2))
def test_tuples_are_the_last_axis(ps: Any) -> None:
    x, y = ps[..., 0], ps[..., 1]
    found = potto.grad(MODULE.areas)(ps)
    assert found.value.tolist() == (x**2 * y).sum(axis=-1).tolist()
    assert found.tangent.tolist() == np.stack([2 * x * y, x**2], axis=-1).tolist()
    assert MODULE.mirrored(ps).value.tolist() == np.stack([y, 2 * x], axis=-1).tolist()


def test_a_large_batch_of_arrays() -> None:
    xs = np.arange(15000.0).reshape(5000, 3) % 7
    found = MODULE.total(xs, np.arange(5000.0))
    assert found.value.tolist() == (np.arange(5000.0)[:, None] * xs**2).sum(axis=-1).tolist()


@pytest.mark.parametrize("shape", [(0,), (2, 0), (0, 3), (0, 0)])
def test_arrays_and_batches_of_nothing(shape: tuple[int, ...]) -> None:
    xs = np.zeros(shape)
    assert MODULE.total(xs, 1.0).value == pytest.approx(np.zeros(shape[:-1]), abs=0)
    assert np.shape(MODULE.scaled(xs, 1.0).value) == shape
    found = potto.grad(MODULE.total, ["xs", "k"])(xs, 1.0)
    assert np.shape(found["xs"]) == shape
    assert np.shape(found["k"]) == shape[:-1]


@pytest.mark.parametrize(("items", "shape"), [([], (0,)), ([[], []], (2, 0)), ((), None)])
def test_an_empty_list_where_a_number_is_wanted_is_a_batch_of_nothing(
    items: Any, shape: tuple[int, ...] | None
) -> None:
    f = potto.compile("def f(a, b) integral [0, 1] a*[x < b] d(x)").f
    if shape is None:
        with pytest.raises(potto.PottoError, match="a number is needed, not a tuple of 0"):
            f(items, 0.5)
        return
    assert f(items, 0.5).value.shape == shape and f(items, 0.5).converged
    assert [part.shape for part in potto.grad(f, wrt=["a", "b"])(items, 0.5).tangent] == [shape, shape]


class Column:
    """What pandas gives for a column of a table, as far as it is asked."""

    def __init__(self, numbers: list[float]) -> None:
        self.numbers = numbers

    def to_numpy(self) -> Any:
        return np.array(self.numbers)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return self.to_numpy()


def test_columns_lists_and_answers_are_arrays() -> None:
    assert MODULE.mean(Column([1.0, 2.0, 6.0])).value == 3.0
    assert MODULE.mean([1, 2, 6]).value == 3.0
    assert MODULE.mean([np.array([1.0, 2.0]), 3.0]).value.tolist() == [2.0, 2.5]
    assert MODULE.areas([(1.0, 2.0), (3.0, 4.0)]).value == 38.0
    assert potto.grad(MODULE.mean)(Column([1.0, 2.0])).tangent.tolist() == [0.5, 0.5]


class Table:
    """What pandas gives for a table, as far as it is asked."""

    index, columns = ("ann", "bob", "cy"), ("x", "y")

    def __init__(self, **columns: list[Any]) -> None:
        self.held = columns

    def __getitem__(self, name: str) -> Any:
        column: Any = Column(self.held[name])
        column.index = self.index
        return column

    def to_numpy(self) -> Any:
        return np.array(list(self.held.values())).T


def test_a_gap_in_a_table_is_told_with_row_and_column() -> None:
    m = potto.compile(
        "record Row(x: Real, y: Real)\n"
        "def area(rows: [n] Row) sum r in rows (r.x*r.y)\n"
        "def trace(xs: [n, m] Real) xs[0, 0] + xs[1, 1]\n"
    )
    table = Table(x=[1.0, 2.0, 3.0], y=[1.0, None, None])
    with pytest.raises(potto.PottoError, match=r"`rows.y` has no value in row bob, and 1 more are missing"):
        m.area(table)
    with pytest.raises(potto.PottoError, match=r"`xs` has no value in row cy of column `x`"):
        m.trace(Table(x=[1.0, 2.0, np.nan], y=[1.0, 2.0, 3.0]))
    with pytest.raises(potto.PottoError, match=r"`xs` has no value in row 1 \["):
        MODULE.mean(Column([1.0, np.nan]))
    assert m.area(Table(x=[1.0, 2.0], y=[3.0, 4.0])).value == 11.0


def test_an_answer_keeps_its_error_as_an_array() -> None:
    rough = potto.compile("def f(t) [integral [0, 1] (exp(sin(k*x*t))) d(x) for k in 1..3]").f(2.0)
    assert rough.value.shape == rough.error.shape == (3,)
    assert MODULE.mean(rough).error >= rough.error.mean() * (1 - 1e-12) > 0


@pytest.mark.parametrize(
    ("call", "why"),
    [
        (lambda: MODULE.grid(np.ones(3)), "2 axes or more"),
        (lambda: MODULE.areas(np.ones((2, 3))), "tuples of 2"),
        (lambda: MODULE.total(np.ones((2, 3)), np.ones(4)), "do not broadcast"),
        (lambda: MODULE.total(np.array([True]), 1.0), "real numbers"),
        (
            lambda: MODULE.total(np.ma.array([1.0, 2.0, 3.0], mask=[0, 0, 1]), 1.0),
            r"`xs\[2\]` has no value: it is masked",
        ),
        (
            lambda: MODULE.total(np.ones(2), np.ma.array([[1.0, 2.0]], mask=[[0, 1]])),
            r"`k\[0, 1\]` has no value: it is",
        ),
        (lambda: MODULE.total(np.ones(2), np.ma.masked), "`k` has no value: it is masked"),
        (lambda: MODULE.areas((np.ma.array([1.0, 2.0], mask=[1, 0]), 1.0)), r"`ps.0\[0\]` has no value: it is masked"),
        (lambda: potto.jvp(MODULE.total, {"xs": np.ones(4)})(np.ones(3), 1.0), "an array of 3"),
        (lambda: potto.jvp(MODULE.total, (np.ones(3), 1.0), (np.ones(3), 0.0)), "as a dict by the names of parameters"),
        (lambda: potto.vjp(MODULE.scaled, np.ones(2), "xs")(np.ones(3), 1.0), "an array of 3"),
        (lambda: potto.vjp(MODULE.scaled, 1.0, "xs")(np.ones(3), 1.0), "an array of 3"),
        (lambda: potto.fit(MODULE.total, {"xs": "one"}, given={"k": 1.0}), "not at numbers"),
    ],
)
def test_what_does_not_fit_is_said(call: Any, why: str) -> None:
    with pytest.raises(potto.PottoError, match=why):
        call()


# Derivatives


@pytest.fixture(params=[1 << 30, 1], ids=["forward", "reverse"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(derived_calls, "MANY", request.param)


@pytest.mark.usefixtures("way")
def test_gradients_have_the_shape_of_the_argument() -> None:
    a = np.arange(20.0).reshape(4, 5)
    assert potto.grad(MODULE.grid)(a).tangent.tolist() == (3 * np.arange(1, 5)[:, None] * a**2).tolist()
    found = potto.grad(MODULE.both)((np.array([1.0, 2.0]), 3.0))
    assert found.tangent[0].tolist() == [6.0, 12.0]
    assert found.tangent[1] == 5.0


@pytest.mark.usefixtures("way")
def test_products_with_arrays_from_either_side() -> None:
    xs, k = np.array([[1.0, 2.0, 3.0], [0.0, -1.0, 4.0]]), 2.0
    along = np.array([1.0, 0.5, -1.0])
    forward = potto.jvp(MODULE.scaled, {"xs": along, "k": 3.0})(xs, k)
    assert forward.tangent.tolist() == (2 * k * xs * along + 3 * xs**2).tolist()
    back = potto.vjp(MODULE.scaled, along, ["xs", "k"])(xs, k)
    assert back["xs"].tolist() == (2 * k * xs * along).tolist()
    assert back["k"].tolist() == (xs**2 * along).sum(axis=-1).tolist()
    points = np.array([[1.0, 2.0], [3.0, 4.0]])
    weights = np.array([[1.0, 10.0], [100.0, 1000.0]])
    assert potto.vjp(MODULE.mirrored, weights)(points).tangent.tolist() == [[20.0, 1.0], [2000.0, 100.0]]
    assert potto.jvp(MODULE.areas, {"ps": weights})(points).tangent == 4 * 1 + 1 * 10 + 24 * 100 + 9 * 1000


@pytest.mark.usefixtures("way")
def test_jacobians_by_arrays_element_by_element() -> None:
    xs = np.array([1.0, 2.0, 3.0])
    found = potto.jacobian(MODULE.scaled, ["xs", "k"])(xs, 2.0)
    assert found.value.tolist() == np.column_stack([np.diag(4 * xs), xs**2]).tolist()
    batch = potto.jacobian(MODULE.ends, ["xs", "k"])(np.stack([xs, 2 * xs]), 2.0)
    assert batch.value.tolist() == [[[2, 0, 0, 1], [0, 0, 1, 0]], [[2, 0, 0, 2], [0, 0, 1, 0]]]
    a = np.arange(6.0).reshape(2, 3)
    assert potto.jacobian(MODULE.grid)(a).value.tolist() == [0, 3, 12, 54, 96, 150]
    assert potto.jacobian(MODULE.areas)(np.array([[1.0, 2.0], [3.0, 4.0]])).value.tolist() == [4, 1, 24, 9]
    assert potto.jacobian(MODULE.scaled)(np.zeros(0), 1.0).value.shape == (0, 0)


def hessian_of_bent(x: Any) -> Any:
    matrix = np.diag(6 * x * x[0])
    matrix[0, 1:] = matrix[1:, 0] = 3 * x[1:] ** 2
    matrix[0, 0] = 12 * x[0] ** 2
    return matrix


def test_second_derivatives_by_arrays() -> None:
    xs = np.array([[1.0, 2.0, 3.0], [2.0, -1.0, 4.0]])
    both = np.stack([hessian_of_bent(x) for x in xs])
    assert potto.hessian(MODULE.bent)(xs[0]).value.tolist() == both[0].tolist()
    assert potto.hessian(MODULE.bent)(xs).value.tolist() == both.tolist()
    along = np.array([1.0, -1.0, 2.0])
    assert potto.hvp(MODULE.bent, {"xs": along})(xs[0]).tangent.tolist() == (both[0] @ along).tolist()
    found = potto.hessian(MODULE.total, ["xs", "k"])(np.array([1.0, 2.0]), 3.0)
    assert found.value.tolist() == [[6, 0, 2], [0, 6, 4], [2, 4, 0]]
    points = potto.hessian(MODULE.areas)(np.array([[0.0, 1.0], [2.0, 3.0]]))
    assert points.value.tolist() == [[2, 0, 0, 0], [0, 0, 0, 0], [0, 0, 6, 4], [0, 0, 4, 0]]


def test_a_hessian_through_a_fold() -> None:
    fold = potto.compile("def f(xs: [n] Real, k) fold s = k for i in 0..n-1 (s*xs[i] + xs[i]^2)").f
    found = potto.hessian(fold, ["xs", "k"])(np.array([2.0, 3.0]), 5.0)
    # (k a + a²) b + b²
    assert found.value == pytest.approx(np.array([[6, 9, 3], [9, 2, 2], [3, 2, 0]]), rel=1e-13, abs=1e-13)


# Fits


def test_fits_of_arrays() -> None:
    found = potto.fit(MODULE.total, {"xs": [1.0, 2.0, 3.0]}, given={"k": 2.0})
    assert found.converged
    assert found["xs"] == pytest.approx(np.zeros(3), abs=1e-3)
    assert set(found.doubts()) == {"xs[0]", "xs[1]", "xs[2]"}


def test_fits_of_arrays_to_targets() -> None:
    found = potto.fit(MODULE.scaled, {"xs": [1.0, 2.0, 3.0]}, given={"k": 2.0}, target=np.array([2.0, 8.0, 32.0]))
    assert found["xs"] == pytest.approx([1.0, 2.0, 4.0], rel=1e-6, abs=0)
    pair = potto.fit(MODULE.ends, {"xs": [1.0, 5.0], "k": 3.0}, target=(6.0, 4.0), bounds={"k": (0.0, 2.0)})
    assert pair["xs"][1] == pytest.approx(4.0, rel=1e-6, abs=0)
    assert pair["xs"][0] * pair["k"] == pytest.approx(6.0, rel=1e-6, abs=0)
    assert pair["k"] <= 2.0
    matrix = potto.fit(MODULE.turned, {"a": np.ones((2, 3))}, target=np.arange(6.0).reshape(3, 2))
    assert matrix["a"] == pytest.approx(np.arange(6.0).reshape(3, 2).T, rel=1e-6, abs=1e-6)
    many = potto.fit(MODULE.total, {"xs": [1.0, 2.0], "k": 0.5}, given={}, target=10.0)
    assert (many["k"] * many["xs"] ** 2).sum() == pytest.approx(10.0, rel=1e-6, abs=0)


def test_records_as_dicts_objects_and_tuples() -> None:
    module = potto.compile("""
record Camera(eye: (Real, Real, Real), focal: Real)
def share(c: Camera, depth) c.focal/(depth - c.eye.z)
""")

    @dataclass
    class Camera:
        eye: tuple[float, float, float]
        focal: float

    eye = (0.0, 0.0, -5.0)
    for camera in ((eye, 1.5), {"focal": 1.5, "eye": eye}, Camera(eye, 1.5)):
        found = potto.grad(module.share)(camera, 1.0)
        assert found.value == 0.25
        slopes = found.tangent
        assert isinstance(slopes, dict) == isinstance(camera, dict)  # in the form of what was given
        by_eye, by_focal = (slopes["eye"], slopes["focal"]) if isinstance(slopes, dict) else slopes
        assert (*by_eye, by_focal) == pytest.approx((0, 0, 1.5 / 36, 1 / 6), rel=1e-15)
    with pytest.raises(potto.PottoError, match="`c` is Camera, but what is given has no `focal`"):
        module.share({"eye": eye}, 1.0)
    with pytest.raises(potto.PottoError, match="has `zoom`, which it does not know"):
        module.share({"eye": eye, "focal": 1.0, "zoom": 2.0}, 1.0)


@pytest.mark.parametrize("pool", [None, ThreadPoolExecutor, ProcessPoolExecutor])
def test_a_batch_in_tiles_has_gradients_in_the_shape_of_the_array(pool: Any) -> None:
    """Of 6,000 members in a shape of two axes: each is what it is by itself, whoever evaluates its tile."""
    module = potto.compile("""
def covered(ts: [n] (Real, Real), p) integral [p, p + 1/8] sum i in 0..n-1 ([x > ts[i].0]*ts[i].1) d(x)
""")
    ts, places = np.array([[0.3, 1.0], [0.5, 2.0], [0.7, 0.5]]), np.linspace(0, 1, 6_000).reshape(60, 100)
    gradient = potto.grad(module.covered, "ts")
    with ExitStack() as stack:
        if pool is not None:
            stack.enter_context(potto.settings(executor=stack.enter_context(pool(2))))
        found = gradient(ts, places)
    assert found.value.shape == (60, 100) and found.tangent.shape == found.tangent_error.shape == (60, 100, 3, 2)
    over = np.clip(places[..., None] + 1 / 8 - np.maximum(ts[:, 0], places[..., None]), 0, None)
    moves = (ts[:, 0] > places[..., None]) & (ts[:, 0] < places[..., None] + 1 / 8)
    exact = np.stack((-ts[:, 1] * moves, over), axis=-1)
    assert np.abs(found.value - (over * ts[:, 1]).sum(axis=-1)).max() <= 1e-14
    assert np.abs(found.tangent - exact).max() <= 1e-14


def test_arrays_of_a_batch_in_tiles_keep_their_axes() -> None:
    f = potto.compile("def f(a) [a, a^2, integral [0, a] x d(x)]").f
    a = np.linspace(0.1, 2, 5_000)
    assert np.abs(f(a).value - np.stack((a, a**2, a**2 / 2), axis=-1)).max() <= 1e-14


DISCS = """
record Disc(at: (Real, Real), r: Real)
record Plain(x: Real, r: Real)
def area(ds: [n] Disc, t) sum d in ds (d.at.x*d.r^2*t)
def flat(ds: [n] Plain, t) sum i in 0..n-1 ((i + 1)*ds[i].x*ds[i].r^2*t)
def held(u: (Real, Real), t) u.x*t + u.y
k = deriv(held)(t=(3, 1), u=((1, 2), (0, 1)))
"""


def test_records_in_an_array_are_dicts_or_columns_and_so_are_slopes_by_them() -> None:
    module = potto.compile(DISCS)
    by_flat, by_area = potto.grad(module.flat), potto.grad(module.area)
    each = [{"x": 1.0, "r": 2.0}, {"r": 4.0, "x": 3.0}]
    assert module.flat(each, 0.5).value == 50
    assert by_flat(each, 0.5).tangent == [{"x": 2.0, "r": 2.0}, {"x": 16.0, "r": 24.0}]
    columns = {"r": np.array([2.0, 4.0]), "x": [1.0, 3.0]}
    assert module.flat(columns, 0.5).value == 50
    slopes = by_flat(columns, np.array([0.5, 1.0])).tangent
    assert {name: part.tolist() for name, part in slopes.items()} == {
        "x": [[2.0, 16.0], [4.0, 32.0]], "r": [[2.0, 24.0], [4.0, 48.0]]
    }  # fmt: skip
    nested = [{"at": (1.0, 5.0), "r": 2.0}, ((3.0, 6.0), 4.0)]
    assert by_area(nested, 0.5).tangent == [{"at": (2.0, 0.0), "r": 2.0}, ((8.0, 0.0), 12.0)]
    with pytest.raises(potto.PottoError, match="has no `r` and has `R`") as told:
        module.flat([{"x": 1.0, "R": 2.0}], 0.5)
    assert told.value.diagnostics[0].help == "did you mean `r`?"
    with pytest.raises(potto.PottoError, match="has 2 elements"):
        module.flat({"x": [1.0, 2.0], "r": [1.0]}, 0.5)


def test_none_in_a_list_is_told() -> None:
    module = potto.compile("def f(xs: [n] Real, k) k*(sum x in xs (x))\ndef g(a: [n, m] Real) a[0, 0]")
    with pytest.raises(potto.PottoError, match=r"`xs\[1\]` has no value: it is None"):
        module.f([1.0, None], 3.0)
    with pytest.raises(potto.PottoError, match=r"`a\[1, 0\]` has no value"):
        module.g([[1.0, 2.0], [None, 3.0]])
    assert np.isnan(module.f([1.0, np.nan], 3.0).value)


def test_fields_of_an_answer_are_answers() -> None:
    module = potto.compile("record Eye(at: (Real, Real), focal: Real)\ndef eye(t) Eye(at=(t, 2*t), focal=exp(t))")
    found = module.eye(1.0)
    assert found.focal.value == math.e and found.focal.error == found[1].error and found.at[1].value == 2
    assert module.eye(np.array([0.0, 1.0])).at[1].value.tolist() == [0, 2] and "focal" in dir(found)
    assert pickle.loads(pickle.dumps(found)).focal.value == math.e
    with pytest.raises(AttributeError, match="a record `Eye` has no attribute 'focus'"):
        found.focus  # noqa: B018
    assert not hasattr(found.focal, "at")


def test_an_array_with_names_is_one_of_records() -> None:
    """x r at 1, 2 and 3, 4, by names, whatever their order and kinds."""
    module = potto.compile("record Disc(x: Real, r: Real)\ndef f(ds: [n] Disc, k) sum d in ds (k*d.x*d.r)")
    discs = np.array([(2.0, 1), (4.0, 3)], dtype=[("r", "f4"), ("x", "i2")])
    assert module.f(discs, 2.0).value == module.f(discs.view(np.recarray), 2.0).value == 28
    assert module.f(discs[:0], 2.0).value == module.f([], 2.0).value == 0
    assert potto.deriv(module.f)(discs, (2.0, 1.0)).tangent == 14
    assert potto.deriv(module.f)((discs, discs), 2.0).tangent == 56
    with pytest.raises(potto.PottoError, match=r"`ds` is \[n\] Disc, but what is given has no `x` and has `y`"):
        module.f(np.zeros(2, dtype=[("r", "f8"), ("y", "f8")]), 2.0)
    with pytest.raises(potto.PottoError, match=r"`ds\[1\]` is Disc, but what is given has no `x`"):
        module.f([{"x": 1.0, "r": 2.0}, {"r": 2.0}], 2.0)


def test_a_table_is_taken_by_its_names() -> None:
    """Not by the order of its columns, which numpy would see."""

    class Column:
        def __init__(self, items: list[float]) -> None:
            self.items = items

        def to_numpy(self) -> np.ndarray:
            return np.array(self.items)

    class Table:
        columns = ("r", "x", "more")

        def __init__(self) -> None:
            self.held = {"r": [2.0, 4.0], "x": [1.0, 3.0], "more": [0.0, 0.0]}

        def __getitem__(self, name: str) -> Column:
            return Column(self.held[name])

        def to_numpy(self) -> np.ndarray:
            return np.array(list(self.held.values())).T

    module = potto.compile(DISCS)
    assert module.flat(Table(), 0.5).value == 50
    of_columns = potto.compile("record Columns(x: [n] Real, r: [n] Real)\ndef f(c: Columns) c.x[0]*c.r[1]")
    assert of_columns.f(Table()).value == 4 and potto.grad(of_columns.f)(Table()).tangent.r.tolist() == [0, 1]
    assert (module.k.value, module.k.tangent) == (5, 2)


SHAPES = """
record T(at: (Real, Real), grey: Real)
def made(k) [T(at=(integral [0, 1] k*x d(x), i), grey=k) for i in 0..2]
def weight(ts: [n] T, t) sum s in ts (s.grey*s.at.x*t + s.at.y)
"""


def test_an_answer_of_records_of_several_shapes_is_an_argument_again() -> None:
    """Each of three is k * k/2 * t, and i = 0, 1, 2 are added; 1e-15 is four roundings."""
    module = potto.compile(SHAPES)
    made = module.made(0.5)
    assert module.weight(made, 2.0).value == pytest.approx(3 * 0.5 * (0.5 / 2) * 2 + 3, rel=1e-15)
    assert module.weight(made[1:], 2.0).value == pytest.approx(2 * 0.5 * (0.5 / 2) * 2 + 3, rel=1e-15)
    with potto.settings(method="mc", samples=100):
        made = module.made(0.5)
    off = sum(0.5 * 2 * error[0][0] for error in made.error)  # by 1/2 of grey and t = 2, one like the other
    assert module.weight(made, 2.0).error == pytest.approx(off, rel=1e-9)


def test_answers_in_tuples_lists_and_records_keep_their_errors() -> None:
    """Of each sum the error is that of the one answer in it: floats have none, and roundings are 1e-15 of it."""
    module = potto.compile("""
record Part(a: Real, b: Real)
def made(k) Part(integral [0, 1] k*x d(x), 2)
def pair(k) (integral [0, 1] k*x d(x), 2)
def of_numbers(ts: [n] Real) sum s in ts (s)
def of_rows(ts: [n, m] Real) sum i in 0..n-1 (ts[i, 0])
def of_parts(ts: [n] Part) sum s in ts (s.a + s.b)
def of_part(s: Part) s.a + s.b
def of_pair(p: (Real, Real)) p.0 + p.1
""")
    with potto.settings(method="mc", samples=20):
        made, pair = module.made(0.5), module.pair(0.5)
    number, off = made[0], made[0].error
    assert off > 1e-3
    found = [
        module.of_numbers([number, 1.0]), module.of_rows([[number], [1.0]]), module.of_part(made),
        module.of_parts([(number, 0.0), (1.0, 1.0)]), module.of_parts([made]), module.of_pair(pair),
    ]  # fmt: skip
    assert [each.error for each in found] == pytest.approx([off] * 6, rel=1e-9)
