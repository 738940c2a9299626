"""Conditions on what is made of arrays: sums of powers, columns of tables, second derivatives through look-ups."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

import potto

Numbers = Sequence[mp.mpf]


@pytest.mark.parametrize(
    ("summed", "written"),
    [
        ("sum i in 0..2 (x^i)", "1 + x + x^2"),
        ("sum i in 0..2 (a[i]*(x - 1/2)^i)", "1 + 4*(x - 1/2) + 9*(x - 1/2)^2"),
        ("sum i in 0..2 (exp(x)^i)", "1 + exp(x) + exp(x)^2"),
        ("product i in 0..2 (x^i + 2)", "3*(x + 2)*(x^2 + 2)"),
    ],
)
def test_a_zeroth_power_is_a_number(summed: str, written: str) -> None:
    """The term of degree 0 counts beside the other numbers of a condition; it took their place."""
    module = potto.compile(f"""
a = [1, 4, 9]
def f(t) integral [-1, 3] [({summed}) < t]*(x + 2) d(x)
def g(t) integral [-1, 3] [{written} < t]*(x + 2) d(x)
""")
    for t in (2.0, 6.3, 20.0):
        found, expected = potto.grad(module.f)(t), potto.grad(module.g)(t)
        assert found.value == pytest.approx(expected.value, rel=1e-12, abs=1e-12)
        assert found.tangent == pytest.approx(expected.tangent, rel=1e-12, abs=1e-12)
    found = potto.grad(potto.compile("def f(t) integral [0, 3] [(sum i in 0..2 (x^i)) < t]*x d(x)").f)(7.0)
    assert found.value == pytest.approx(2.0, rel=1e-14)  # 1 + x + x^2 is 7 at x = 2, where its slope is 5
    assert found.tangent == pytest.approx(2 / 5, rel=1e-14)


def test_columns_of_data_in_conditions(tmp_path: Path) -> None:
    """A column is read beside the integral, by whatever name: that of the table, of a record in it, or its own."""
    (tmp_path / "t.csv").write_text("x,y\n1,1\n2,4\n3,9\n")
    (tmp_path / "n.json").write_text('{"a": {"x": [1, 2, 3], "y": [1, 4, 9]}}')
    (tmp_path / "m.po").write_text("""
record Table(x: [3] Real, y: [3] Real)
t = load("t.csv")
n = load("n.json")
r = Table(x=[1, 2, 3], y=[1, 4, 9])
def of_table(s) integral [1, 3] [interp(t.x, t.y, x) < s] d(x)
def within(s) integral [1, 3] [interp(n.a.x, n.a.y, x) < s] d(x)
def of_record(s) integral [1, 3] [interp(r.x, r.y, x) < s] d(x)
""")
    module = potto.load(tmp_path / "m.po")
    for f in (module.of_table, module.within, module.of_record):
        found = potto.grad(f)(6.5)  # from 4 to 9 between 2 and 3
        assert found.value == pytest.approx(1.5, rel=1e-14)
        assert found.tangent == pytest.approx(0.2, rel=1e-14)


def below(t: mp.mpf, xs: Numbers, ys: Numbers, power: int) -> mp.mpf:
    """The integral of x^power over where a piecewise linear function is less than t."""
    total = mp.mpf(0)
    for a, b, p, q in zip(xs, xs[1:], ys, ys[1:], strict=False):
        root = a + (t - p) * (b - a) / (q - p)
        low, high = (a if p < t else root), (b if q < t else root)
        if p < t or q < t:
            total += (high ** (power + 1) - low ** (power + 1)) / (power + 1)
    return total


def curvatures(f: Callable[[Numbers], mp.mpf], at: Sequence[float]) -> np.ndarray:
    """All second derivatives by differences with sixty digits, twenty of which the step leaves."""
    with mp.workdps(60):
        here, h, n = [mp.mpf(x) for x in at], mp.mpf(10) ** -20, len(at)

        def beside(i: int, j: int, up: int, side: int) -> mp.mpf:
            moved = list(here)
            moved[i] += up * h
            moved[j] += side * h
            return f(moved)

        corners = ((1, 1, 1), (-1, 1, -1), (-1, -1, 1), (1, -1, -1))

        def mixed(i: int, j: int) -> float:
            return float(sum(s * beside(i, j, a, b) for s, a, b in corners) / (4 * h * h))

        return np.array([[mixed(i, j) for j in range(n)] for i in range(n)])


@pytest.mark.parametrize("ys", [[0.0, 0.5, 0.6, 1.0], [0.1, 0.8, 0.3, 0.9]], ids=["rising", "up and down"])
def test_second_derivatives_through_a_table(ys: list[float]) -> None:
    """By the threshold, all places and all values at once: places move together with the bounds, the cells with them.
    Of those that are 0 rounding leaves what their parts, of up to 60, cancel to: 1e-10 is far above that."""
    module = potto.compile("""
def f(t, xs: [n] Real, ys: [n] Real) integral [xs[0], xs[n - 1]] [interp(xs, ys, x) < t]*x^2 d(x)
""")
    xs = [0.1, 0.3, 0.7, 1.0]
    found = potto.hessian(module.f, ["t", "xs", "ys"])(0.55, xs, ys)
    exact = curvatures(lambda v: below(v[0], v[1:5], v[5:], 2), [0.55, *xs, *ys])
    assert found.value == pytest.approx(exact, rel=1e-11, abs=1e-10)
    assert np.all(np.abs(np.asarray(found.value) - exact) <= np.asarray(found.error) + 1e-13)


def under_a_slope(t: mp.mpf, xs: Numbers, ys: Numbers) -> mp.mpf:
    """The area of where a piecewise linear function of x, of positive values, is less than t*y: of 1 - (function)/t
    where that is positive, and y at most 1."""
    total = mp.mpf(0)
    for a, b, p, q in zip(xs, xs[1:], ys, ys[1:], strict=False):
        share, low = 1 - p / t, 1 - q / t
        if share < 0 or low < 0:  # only the part where it is positive, if there is any
            total += (b - a) * max(share, low, 0) ** 2 / (2 * abs(share - low))
        else:
            total += (b - a) * (share + low) / 2
    return total


@pytest.mark.parametrize("ys", [[0.2, 0.5, 0.6, 1.0], [0.1, 0.8, 0.3, 0.9]], ids=["rising", "up and down"])
def test_second_derivatives_of_an_area_over_a_table(ys: list[float]) -> None:
    """The conditions of the derivatives walk through the table from cell to cell, as those of the value do: by all
    places and values that is some hundred evaluations."""
    module = potto.compile("""
def f(t, xs: [n] Real, ys: [n] Real) integral ([0, 1], [xs[0], xs[n - 1]]) [interp(xs, ys, x) < t*y] d(y, x)
""")
    xs = [0.1, 0.3, 0.7, 1.0]
    found = potto.hessian(module.f, ["t", "xs", "ys"])(0.85, xs, ys)
    exact = curvatures(lambda v: under_a_slope(v[0], v[1:5], v[5:]), [0.85, *xs, *ys])
    assert found.value == pytest.approx(exact, rel=1e-11, abs=1e-12)
    assert np.all(np.abs(np.asarray(found.value) - exact) <= np.asarray(found.error) + 1e-14)
    assert found.converged
    assert found.evals < 5_000


def test_second_derivatives_through_a_picture() -> None:
    """Between four pixels it is s*x*y: of the square 1 - A is (1 - q + q log q)/4 + (1 - q)/4 + 1/16, with q = t/s."""
    module = potto.compile("""
def f(t, s) integral ([0, 1], [0, 1]) [s*image([[0, 0], [0, 1]], u, v) < t] d(u, v)
""")
    t = 0.3
    slope, bend = (1 - np.log(t)) / 4, -1 / (4 * t)
    found = potto.hessian(module.f, ["t", "s"])(t, 1.0)
    mixed = -slope - t * bend
    assert found.value == pytest.approx(np.array([[bend, mixed], [mixed, 2 * t * slope + t * t * bend]]), rel=1e-9)
    assert found.converged


def cell_below(level: mp.mpf, corners: Numbers, wide: mp.mpf, high: mp.mpf) -> mp.mpf:
    """The area of where a bilinear function on a rectangle is less than a level. corners: at (0, 0), (1, 0), (0, 1),
    (1, 1) of it; across it is a + b*u + v*(c + d*u), so that for each u it is an interval of v from 0 or to 1."""
    p, q, r, s = corners
    a, b, c, d = p - level, q - p, r - p, (s - r) - (q - p)

    def primitive(u: mp.mpf) -> mp.mpf:  # of -(a + b*u)/(c + d*u), where the function has the level
        return -(b * u / d + (a * d - b * c) / d**2 * mp.log(abs(c + d * u))) if d else -(a * u + b * u * u / 2) / c

    ends = [-a / b if b else mp.inf, -(a + c) / (b + d) if b + d else mp.inf, -c / d if d else mp.inf]
    inside = sorted({mp.mpf(0), mp.mpf(1), *(u for u in ends if 0 < u < 1)})
    total = mp.mpf(0)
    for left, right in pairwise(inside):
        u = (left + right) / 2
        bottom, top = a + b * u < 0, a + b * u + c + d * u < 0
        if bottom and top:
            total += right - left
        elif bottom or top:
            crossed = primitive(right) - primitive(left)
            total += crossed if bottom else right - left - crossed
    return total * wide * high


def picture_below(level: mp.mpf, rows: Sequence[Numbers]) -> mp.mpf:
    """The area of the unit square where a picture is less than a level: bilinear between the centres of its pixels, and
    beyond them as at the edge."""

    def cells(count: int) -> list[tuple[int, int, mp.mpf]]:
        half = mp.mpf(1) / (2 * count)
        return [(0, 0, half), *((i, i + 1, 2 * half) for i in range(count - 1)), (count - 1, count - 1, half)]

    return mp.fsum(
        cell_below(level, [rows[i][k], rows[i][m], rows[j][k], rows[j][m]], wide, high)
        for i, j, high in cells(len(rows))
        for k, m, wide in cells(len(rows[0]))
    )


@pytest.mark.parametrize("level", [0.25, 0.4, 0.62])
def test_second_derivatives_by_all_pixels(level: float) -> None:
    """Beyond the centres of the outer pixels both ends of a cell are one pixel: it is not read as two that move apart.
    Errors of all 36 are known, none above 1e-9, in a few thousand evaluations for each."""
    module = potto.compile("""
def f(t, p: [n, m] Real) integral ([0, 1], [0, 1]) [image(p, u, v) < t] d(u, v)
""")
    picture = [[0.1, 0.5, 0.3], [0.7, 0.2, 0.9]]
    found = potto.hessian(module.f, "p")(level, picture)
    exact = curvatures(lambda v: picture_below(mp.mpf(level), [v[:3], v[3:]]), [x for row in picture for x in row])
    assert np.all(np.abs(np.asarray(found.value) - exact) <= np.asarray(found.error) + 1e-14)
    assert np.max(found.error) <= 1e-9
    assert found.evals < 100_000


def test_what_cancels_is_said_to() -> None:
    """The level's second derivative is made of parts that cancel. Nothing diverges, nothing is rough."""
    module = potto.compile("""
def f(t, p: [n, m] Real) integral ([0, 1], [0, 1]) [image(p, u, v) < t] d(u, v)
""")
    rows = [[0.1, 0.5, 0.3], [0.7, 0.2, 0.9]]
    found = potto.hessian(module.f, "t")(0.4, rows)
    picture = [[mp.mpf(x) for x in row] for row in rows]
    exact = curvatures(lambda v: picture_below(v[0], picture), [0.4])[0, 0]
    assert abs(found.value - exact) <= found.error <= 1e-9
    assert [why.message[:17] for why in found.shortfalls] in ([], ["its parts cancel:"])


def test_a_second_derivative_at_a_place_of_the_table_does_not_exist() -> None:
    """There the first one jumps: from 0.6 to 4."""
    module = potto.compile("""
def f(t) integral [0, 1] [interp([0, 0.3, 0.7, 1], [0, 0.5, 0.6, 1], x) < t] d(x)
""")
    with pytest.raises(potto.PottoError, match="P0505"):
        potto.hessian(module.f)(0.5)
