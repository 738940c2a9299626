"""Arrays of a few members are as cheap as their numbers, and arrays of very many are what small ones are.

Evaluations are counted; nothing is timed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import potto
from potto.runtime.answers import allowances

M = potto.compile("""
def plane(c) integral ([0, 1], [0, 1]) [x + y + c >= 0]/(sqrt(2)*(x + y + c) + 2)^2 d(x, y)
def jump(c) integral [0, 1] [x < c]*exp(x*c) d(x)
def disc(c) integral ([-1, 1], [-1, 1]) [x^2 + y^2 < c] d(x, y)
def pair(c) integral [0, 1] ([x < c], x*c) d(x)
def nested(c) integral [0, 1] (integral [0, x + c] exp(y) d(y)) d(x)
""")
AT = {"plane": -0.7, "jump": 0.3, "disc": 0.5, "pair": 0.3, "nested": 0.4}


@pytest.mark.parametrize("name", list(AT))
@pytest.mark.parametrize("count", [1, 2, 5, 10])
def test_a_few_members_cost_what_their_numbers_do(name: str, count: int) -> None:
    f = getattr(M, name)
    c = AT[name] + np.linspace(0.0, 0.1, count)
    for call in (f, potto.grad(f, ["c"])):
        with potto.settings(backend="numpy"):  # machine code may be ready in between, and rounds otherwise
            together, single = call(c=c), [call(c=float(x)) for x in c]
        assert together.evals <= sum(one.evals for one in single)
        values = np.array([one.value for one in single]).T
        assert (np.array(together.value) == values).all()  # the same way, the same digits
        assert np.shape(together.value) == values.shape
    dual = potto.deriv(f)((c, np.ones(count)))
    assert dual.evals <= sum(potto.deriv(f)((float(x), 1.0)).evals for x in c)


@pytest.mark.parametrize("count", [2, 5, 10])
def test_a_sum_of_few_integrals_costs_no_more_than_they_do(count: int) -> None:
    """Discs of areas pi c k/n for k = 1 ... n add up to pi c (n + 1)/2, with bounds that cover but for rounding."""
    disc = f"integral ([-1, 1], [-1, 1]) [x^2 + y^2 < c*k/{count}] d(x, y)"
    m = potto.compile(f"def f(c) sum k in 1..{count} ({disc})\ndef one(c, k) {disc}")
    found = potto.deriv(m.f)((0.5, 1.0))
    single = [potto.deriv(m.one)((0.5, 1.0), (float(k), 0.0)) for k in range(1, count + 1)]
    assert found.evals <= sum(one.evals for one in single)
    assert abs(found.value - math.pi * 0.25 * (count + 1)) <= found.error + 4e-16 * found.value
    assert abs(found.tangent - math.pi * 0.5 * (count + 1)) <= found.tangent_error + 4e-16 * found.tangent
    assert found.error <= 1e-11 * found.value and found.converged


def test_an_array_of_one_in_any_shape() -> None:
    one = potto.grad(M.plane, ["c"])(c=-0.7)
    for shape in ((1,), (1, 1), (1, 1, 1)):
        found = potto.grad(M.plane, ["c"])(c=np.full(shape, -0.7))
        assert found.value.shape == found.tangent.shape == found.error.shape == found.member_converged.shape == shape
        assert found.value.flat[0] == one.value and found.tangent.flat[0] == one.tangent and found.evals == one.evals


POINTS = potto.compile("""
def f(x, y, c) [x + y + c >= 0]/(sqrt(2)*(x + y + c) + 2)^2*exp(x*y - c)*(1 + x*x + y*y*c)
def g(x, y, c) if x < y then (sin(x*c), 1) else (x - y, y*c)
def h(x, y, c) (max(x, y), c)
def k(x, y, c) exp(-abs(x - c))*erf(y)
def other(x, c) x^2 - c
def through(x, y, c) other(x, c)*other(y, x)
""")


@pytest.mark.parametrize("name", ["f", "g", "h", "k", "through"])
@pytest.mark.parametrize("shape", [(50_000,), (200, 300), (3, 40_000), (20_001, 3)])
def test_many_points_are_what_few_are(name: str, shape: tuple[int, ...]) -> None:
    """Kernels take them in parts, which nobody sees: values, errors and derivatives to the last digit."""
    f = potto.grad(getattr(POINTS, name), ["c"])
    random = np.random.default_rng(5)
    x, y = random.normal(size=shape), random.normal(size=shape)
    with potto.settings(backend="numpy"):  # machine code, which takes over at some time, has an exp of its own
        whole = f(x=x, y=y, c=0.7)

    def numbers(found: Any) -> list[Any]:
        parts = [found.value, found.error, found.tangent, found.tangent_error]
        return [item for part in parts for item in (part if isinstance(part, tuple) else (part,))]

    flat = [np.asarray(item).reshape(-1) for item in numbers(whole)]
    size = x.size
    for start in (0, 16_000, size - 1000):
        part = slice(start, start + 1000)
        with potto.settings(backend="numpy"):
            few = f(x=x.reshape(-1)[part], y=y.reshape(-1)[part], c=0.7)
        for a, b in zip(flat, numbers(few), strict=True):
            assert np.array_equal(a[part], b)


def test_one_number_beside_many() -> None:
    """Arrays of unlike shapes, a row and a column: parts of the first axis."""
    f = potto.compile("def f(x, y) x*exp(y) + [x > y]").f
    x, y = np.linspace(0, 1, 400)[:, None], np.linspace(0, 1, 300)[None]
    assert np.abs(f(x, y).value - (x * np.exp(y) + (x > y))).max() <= 1e-15


def test_integrals_of_many_nodes() -> None:
    """A sharp peak at 60 places takes more nodes at once than kernels do; its answer is a product of erfs."""
    f = potto.compile("def f(t) integral ([0, 1], [0, 1]) exp(-(200*(x - t))^2 - (300*(y - t))^2) d(x, y)").f
    t = np.linspace(0.2, 0.8, 60)
    with potto.settings(rtol=1e-8):
        answer = f(t)
    erf = np.vectorize(math.erf)
    exact = math.pi / 4 / 200 / 300 * (erf(200 * t) + erf(200 * (1 - t))) * (erf(300 * t) + erf(300 * (1 - t)))
    assert (np.abs(answer.value - exact) <= answer.error + 1e-19).all() and answer.converged


def test_what_cancels_is_asked_of_members_that_are_not_accurate(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 400 pixels a few meet the end of a disc, where the derivative is what is left of much larger numbers."""
    text = "def f(px, py, r) integral ([px, px + 1/20], [py, py + 1/20]) [(x - 1/2)^2 + (y - 1/2)^2 < r] d(x, y)"
    looked: list[int] = []
    own = allowances.allowance
    monkeypatch.setattr(
        allowances, "allowance", lambda term, sums, rtol: looked.append(sums.v.size) or own(term, sums, rtol)
    )
    x, y = (side.ravel() for side in np.meshgrid(np.arange(20) / 20, np.arange(20) / 20))
    found = potto.grad(potto.compile(text).f, "r")(x, y, 0.1)
    assert found.converged and sum(looked) <= 40
    assert found.value.sum() == pytest.approx(0.1 * math.pi, rel=1e-12)
    assert found.tangent.sum() == pytest.approx(math.pi, rel=1e-12)
