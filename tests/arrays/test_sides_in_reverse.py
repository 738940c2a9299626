"""Where something has two derivatives, those by many parameters are the ones by few: of the whole, to either side."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import potto
from potto.python import derived_calls, sided

N = 9
PROGRAM = potto.compile("""
def kinks(p: [n] (Real, Real), q, r: [n] Real)
    (sum i in 0..n-1 (abs(p[i].0 - q)*p[i].1 + max(r[i], p[i].0)^2))^2 + abs(q)
def square(t) integral [0, 1] [x < t]*2*x d(x)
def both(p: [n] Real, c) (sum i in 0..n-1 (square(p[i]*c)), abs(p[0] - c), (sum i in 0..n-1 (p[i]))*c)
def jumps(p: [n] Real, c) (if p[0] < c then 1 else 2 + (p[0] - c)*p[1])*(sum i in 0..n-1 (p[i]^2))
def cubes(p: [n] Real) sum i in 0..n-1 (abs(p[i] - 1)^3 + p[i])
def folded(p: [n] Real) fold s = 0.25 for i in 0..n - 1 (abs(s - p[i]) + 0.1*p[i])
def moved(p: [n] Real) integral [0, 1] (integral [0, 1] [x + y < (sum i in 0..n-1 (p[i]))/n]*(1 + y) d(y)) d(x)
""")
PAIRS = [(0.5 if i == 3 else 0.1 + i / 50, 0.9 - i / 60) for i in range(N)]
THIRD = np.array([first if i == 7 else 0.3 for i, (first, _) in enumerate(PAIRS)])
NEAR = np.where(np.isin(np.arange(N), [0, 7]), 1.0, np.linspace(0.2, 0.9, N))


def _met() -> np.ndarray[Any, Any]:
    """Numbers of which two are those that the fold has come to."""
    found, state = np.full(N, 0.7), 0.25
    for i in range(N):
        found[i] = state if i in (3, 8) else found[i]
        state = abs(state - found[i]) + 0.1 * found[i]
    return found


def _flat(x: Any) -> Iterator[float]:
    if isinstance(x, tuple | list):
        for item in x:
            yield from _flat(item)
    else:
        yield from np.ravel(x)


@pytest.mark.parametrize("call", [
    lambda: potto.grad(PROGRAM.kinks, ["p", "q", "r"])(PAIRS, 0.5, THIRD),
    lambda: potto.grad(PROGRAM.kinks, ["q", "r"])(PAIRS, np.array([0.5, 0.1, 0.0]), THIRD),
    lambda: potto.grad(PROGRAM.both, ["p", "c"])(NEAR, np.array([0.3, 1.0, 0.6])),
    lambda: potto.vjp(PROGRAM.both, (1.0, -2.0, 0.5), ["p", "c"])(NEAR, 1.0),
    lambda: potto.grad(PROGRAM.jumps, ["p", "c"])(NEAR, 1.0),
    lambda: potto.grad(PROGRAM.cubes)(NEAR),
    lambda: potto.grad(PROGRAM.folded)(_met()),
    lambda: potto.hvp(PROGRAM.moved, {"p": np.ones(N)})(np.ones(N)),
])  # fmt: skip
def test_derivatives_on_both_sides_are_the_same_in_reverse_and_forward(
    call: Callable[[], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """To 1e-13 of the largest: sums are added up in another order."""
    monkeypatch.setattr(sided, "BLOCK", 4)
    monkeypatch.setattr(derived_calls, "MANY", 1)
    back = call()
    monkeypatch.setattr(derived_calls, "MANY", 1 << 30)
    forward = call()

    def same(a: Any, b: Any) -> None:
        one, other = np.array(list(_flat(a))), np.array(list(_flat(b)))
        known = ~np.isnan(one)  # of a product with a cotangent, parameters that move nothing of this kind
        assert known.any() and one[known] == pytest.approx(other[known], abs=1e-13 * np.nanmax(np.abs(other)))

    same(back.tangent, forward.tangent)
    assert [str(note.surface) for note in back.notes] == [str(note.surface) for note in forward.notes]
    for one, other in zip(back.notes, forward.notes, strict=True):
        same(one.backward, other.backward)
        same(one.forward, other.forward)


def test_many_parameters_at_kinks_and_bounds_have_the_derivatives_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(derived_calls, "MANY", 1)
    assert not potto.grad(PROGRAM.cubes)(NEAR).notes  # -3 and 3 times 0
    found = potto.grad(PROGRAM.both, ["p", "c"])(NEAR, 1.0)
    (note,) = found.notes
    assert note.surface == "x = t"
    backward, forward = (np.asarray(side).reshape(3, N + 1) for side in (note.backward, note.forward))
    at_one = np.isin(np.arange(N), [0, 7])
    assert np.allclose(backward[0, :N], 2 * NEAR, atol=1e-13)  # closed form, to rounding
    assert np.allclose(forward[0, :N], np.where(at_one, 0, 2 * NEAR), atol=1e-13)
    assert (backward[1, 0], forward[1, 0], backward[1, N], forward[1, N]) == (-1, 1, -1, 1)
    assert np.all(backward[2, :N] == 1) and np.all(forward[2, :N] == 1)


def test_notes_on_second_derivatives_are_of_the_product_and_name_what_the_program_names() -> None:
    """At s = 1 the second derivative of the area below x + y = s, weighted by 1 + y, is 1 + s, and -s beyond."""
    for count in (3, 16):
        ones = np.ones(count)
        found = potto.hvp(PROGRAM.moved, {"p": ones})(ones)
        (note,) = found.notes
        assert note.backward == pytest.approx(np.full(count, 2 / count), rel=1e-12)  # to rounding
        assert note.forward == pytest.approx(np.full(count, -1 / count), rel=1e-12)
        assert np.array_equal(found.tangent, note.backward) or np.array_equal(found.tangent, note.forward)
        assert "sum i in" in str(note.surface) and "dp.0[i]" in str(note.surface)
    ones = np.ones(3)
    (note,) = potto.hessian(PROGRAM.moved)(ones).notes
    assert np.shape(note.backward) == (3, 3) and note.backward == pytest.approx(np.full((3, 3), 2 / 9), rel=1e-12)


MESH = """
def edge(ax, ay, bx, by, x, y) (bx - ax)*(y - ay) - (by - ay)*(x - ax)
def covered(a: (Real, Real), b: (Real, Real), c: (Real, Real), grey)
    integral ([0, 1/2], [0, 1/2]) [edge(a.0, a.1, b.0, b.1, x, y) >= 0 and edge(b.0, b.1, c.0, c.1, x, y) >= 0
        and edge(c.0, c.1, a.0, a.1, x, y) >= 0]*grey^2 d(x, y)
def mesh(p: [n] ((Real, Real), (Real, Real), (Real, Real)), grey: [n] Real)
    sum i in 0..n - 1 (covered(p[i].0, p[i].1, p[i].2, grey[i]))
"""


def test_edges_on_those_of_a_pixel_are_looked_at_by_what_moves_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """A triangle over half of a pixel, n times, each with its own seven numbers: each takes no more evaluations than
    one by itself, by the numbers of others too; forward three times, as the whole is looked at from both sides."""
    module = potto.compile(MESH)
    triangle, counts = ((0.0, 0.0), (0.5, 0.0), (0.5, 0.5)), {}
    for n in (1, 4):
        found = potto.grad(module.mesh, ["p", "grey"])([triangle] * n, np.full(n, 0.5))
        counts[n] = found.evals
        assert found.value == pytest.approx(n / 32, abs=1e-15)  # half of a quarter, times a quarter: to rounding
        assert np.asarray(found.tangent[1]) == pytest.approx(np.full(n, 0.125), abs=1e-15)
    assert counts[4] <= 3 * 4 * counts[1]
    monkeypatch.setattr(derived_calls, "MANY", 1)
    monkeypatch.setattr(sided, "MOST", 0)
    taped = potto.grad(module.mesh, ["p", "grey"])([triangle] * 4, np.full(4, 0.5)).evals
    assert taped <= 4 * counts[1]
