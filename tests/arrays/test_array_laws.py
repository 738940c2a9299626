"""Programs with arrays are the same programs written out; forward and reverse agree; shapes do not matter."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import potto

numbers = st.floats(-4, 4, allow_nan=False).map(lambda x: round(x, 3))
columns = st.lists(numbers, min_size=1, max_size=6)

# What is done with an element x at place i.
BODIES = [
    "x", "x^2", "sin(x)", "x*t", "[x < t]", "exp(-x^2)*t", "max(x, t)", "(if i > 1 then x else t)", "[x + t < 1]*x"
]  # fmt: skip
REDUCED = ["sum", "product", "min", "max"]


def array_program(reduction: str, body: str, integrated: bool) -> str:
    inner = f"{reduction} i in 0..n-1 (let x = xs[i] in {body})"
    if integrated:
        inner = f"integral [0, 1] ({inner})*u d(u)"
    return f"def f(xs: [n] Real, t) {inner}"


def written_out(reduction: str, body: str, count: int, integrated: bool) -> str:
    terms = [f"(let i = {i}; x = x{i} in {body})" if "i" in body.replace("sin", "").replace("if", "") else
             f"(let x = x{i} in {body})" for i in range(count)]  # fmt: skip
    joined = {"sum": " + ", "product": "*"}.get(reduction)
    inner = f"({joined.join(terms)})" if joined else terms[0] if count == 1 else f"{reduction}({', '.join(terms)})"
    if integrated:
        inner = f"integral [0, 1] {inner}*u d(u)"
    return f"def f({', '.join(f'x{i}' for i in range(count))}, t) {inner}"


@pytest.mark.parametrize("reduction", REDUCED)
@given(xs=columns, t=numbers, body=st.sampled_from(BODIES), integrated=st.booleans())
def test_an_array_program_is_the_same_program_written_out(
    reduction: str, xs: list[float], t: float, body: str, integrated: bool
) -> None:
    whole = potto.compile(array_program(reduction, body, integrated)).f
    apart = potto.compile(written_out(reduction, body, len(xs), integrated)).f
    found, expected = whole(xs, t), apart(*xs, t)
    assert float(found.value) == pytest.approx(float(expected.value), rel=1e-12, abs=1e-13)
    by_both = potto.grad(whole, ["xs", "t"])(xs, t)
    names = [f"x{i}" for i in range(len(xs))]
    slopes = potto.grad(apart, [*names, "t"])(*xs, t)
    assert by_both["xs"] == pytest.approx([slopes[name] for name in names], rel=1e-11, abs=1e-12)
    assert by_both["t"] == pytest.approx(slopes["t"], rel=1e-11, abs=1e-12)


@given(xs=st.lists(numbers, min_size=12, max_size=20), ts=st.lists(numbers, min_size=1, max_size=3))
def test_forward_is_reverse(xs: list[float], ts: list[float]) -> None:
    """By many elements a tape is swept back; the derivative along a direction is carried forward."""
    f = potto.compile(
        "def f(xs: [n] Real, ts: [m] Real) sum j in 0..m-1 (integral [0, 1] sum x in xs (sin(x*u)*[u < ts[j]]) d(u))"
    ).f
    gradient = potto.grad(f, "xs")(xs, ts).tangent
    for place in (0, len(xs) - 1):
        direction = [float(i == place) for i in range(len(xs))]
        along = potto.deriv(f)((xs, direction), (ts, [0.0] * len(ts))).tangent
        assert gradient[place] == pytest.approx(along, rel=1e-11, abs=1e-12)


@given(shape=st.tuples(st.integers(0, 4), st.integers(1, 3), st.integers(1, 2)), seed=st.integers(0, 99))
def test_random_shapes(shape: tuple[int, int, int], seed: int) -> None:
    module = potto.compile("""
def total(a: [n, m, k] Real) sum i in 0..n-1, j in 0..m-1, l in 0..k-1 (a[i, j, l]*(1 + i + 2*j + 3*l))
def again(a: [n, m, k] Real) [[[2*x for x in row] for row in plane] for plane in a]
""")
    a = np.random.default_rng(seed).uniform(-1, 1, shape)
    i, j, k = np.indices(shape)
    assert module.again(a).value.reshape(shape).tolist() == (2 * a).tolist()
    if shape[0]:
        assert module.total(a).value == pytest.approx((a * (1 + i + 2 * j + 3 * k)).sum(), abs=1e-14)
        assert potto.grad(module.total)(a).tangent == pytest.approx(1.0 + i + 2 * j + 3 * k, rel=1e-15)


# Where an index may stand: over an array of n elements that are 10, 11, …, at place k.
INDICES = {
    "f(xs, k)": "def f(xs: [n] Real, k) xs[k]",
    "f(xs, k) of rows": "def f(xs: [n] Real, k) [xs, xs][1, k]",
    "f(xs, k) of columns": "def f(xs: [n] Real, k) [[x, 2*x] for x in xs][k, 0]",
    "f(xs, k) of what is made": "def f(xs: [n] Real, k) [x + 0 for x in xs][k]",
    "f(xs, k) in a loop": "def f(xs: [n] Real, k) sum i in k..k (xs[i])",
    "f(xs, k) in a fold": "def f(xs: [n] Real, k) fold s = 0 for i in 1..2 (s/2 + xs[k]*2/3)",
    "f(xs, k) beside a variable": "def f(xs: [n] Real, k) integral [0, 1] xs[k]*2*x d(x)",
    "f(xs, k) of what varies": "def f(xs: [n] Real, k) integral [0, 1] [y*2*x for y in xs][k] d(x)",
    "f(xs, k) in a condition": "def f(xs: [n] Real, k) integral [0, 20] [x < xs[k]] d(x)",
    "f(xs, k) of records": "record P(x: Real)\ndef f(xs: [n] Real, k) [P(x=y) for y in xs][k].x",
}


@pytest.mark.parametrize("where", INDICES)
def test_every_index_at_every_bound(where: str) -> None:
    """Each is the element, or an error that says which index and how many elements there are."""
    f = potto.compile(INDICES[where]).f
    for size in (1, 3):
        xs = [10.0 + place for place in range(size)]
        for k in range(-2, size + 2):
            if 0 <= k < size:
                assert f(xs, k).value == pytest.approx(xs[k], rel=1e-12)
                assert potto.deriv(f)((xs, [float(place == k) for place in range(size)]), k).tangent == pytest.approx(1)
                continue
            with pytest.raises(potto.PottoError) as told:
                f(xs, k)
            said = told.value.diagnostics[0]
            elements = f"{size} element" + "s" * (size > 1)
            assert (said.code, said.message) == ("P0511", f"the index {k} is out of range: the array has {elements}")
    with pytest.raises(potto.PottoError) as told:
        f([10.0, 11.0], 0.5)
    assert told.value.diagnostics[0].code in ("P0512", "P0507")  # of an index, or of the bound of a loop


def test_what_is_read_several_times_counts_as_often() -> None:
    """Slopes of rows that are read in one go, some of them more than once, add up: by hand, exactly."""
    module = potto.compile("""
def apart(m: [h, w] Real, ks: [n] Real) sum k in ks, j in 0..1 (m[k, j]^2*(1 + j))
def rows(m: [h, w] Real, ks: [n] Real, t) sum k in ks (dot(m[k], m[0])*t)
""")
    m, ks, ts = np.arange(1.0, 17.0).reshape(8, 2), [0, 1, 1, 3, 3, 3, 7], np.array([1.0, 2.0])
    by_elements, by_rows = np.zeros_like(m), np.zeros_like(m)
    for k in ks:
        by_elements[k] += 2 * m[k] * [1, 2]
        by_rows[k] += m[0]
        by_rows[0] += m[k]
    assert np.array_equal(potto.grad(module.apart, "m")(m, ks).tangent, by_elements)
    assert np.array_equal(potto.grad(module.rows, "m")(m, ks, ts).tangent, ts[:, None, None] * by_rows)


# What is wrong with an element x, a place i, a variable u of integration and a number t.
WRONG = [
    "if x*u < t then 1 else 0", "floor(x + u)", "q*x", "sin(x, t)", "if [u < x] then 1 else sin", "delta(u - x)^2",
    "sum k in 1..u (k)", "[1, 2][u]", "[1, 2] + (x, x)", "x(t)", "(t, x).z", "[x < u] + sign(u)", "t = x", "x^",
    "let y = x",
]  # fmt: skip


@pytest.mark.parametrize("body", WRONG)
def test_what_is_wrong_is_wrong_in_the_program_written_out(body: str) -> None:
    """With the same codes, whatever the loop is."""

    def codes(text: str) -> set[str]:
        try:
            potto.compile(text)
        except potto.PottoError as error:
            return {said.code for said in error.diagnostics if said.severity == "error"}
        return set()

    apart = codes(f"def f(x: Real, t) integral [0, 1] ({body}) d(u)")
    assert apart
    for loop in ("sum x in xs ({})", "sum i in 0..n-1 (let x = xs[i] in {})", "fold s = 0 for x in xs (s + ({}))"):
        whole = codes(f"def f(xs: [n] Real, t) integral [0, 1] ({loop.format(body)}) d(u)")
        assert whole == apart, loop
