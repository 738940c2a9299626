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
