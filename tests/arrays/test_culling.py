"""Sums over primitives of a scene: what a pixel does not touch is not evaluated, and nothing else is left out."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from how_many import examples
from hypothesis import given, settings
from hypothesis import strategies as st
from polygons import Polygon, area, in_square

import potto
from potto.__main__ import main
from potto.runtime.integration.preparation import culling

MESH = """
def edge(a: (Real*, Real*), b: (Real*, Real*), x, y) (b.x - a.x)*(y - a.y) - (b.y - a.y)*(x - a.x)
def cover(t: ((Real*, Real*), (Real*, Real*), (Real*, Real*)), x, y)
    [edge(t.0, t.1, x, y) >= 0 and edge(t.1, t.2, x, y) >= 0 and edge(t.2, t.0, x, y) >= 0]
def pixel(mesh: [n] ((Real, Real), (Real, Real), (Real, Real)), grey: [n] Real, px, py, h)
    integral ([px, px + h], [py, py + h]) sum i in 0..n-1 (grey[i]*cover(mesh[i], x, y)) d(x, y)
def loss(mesh: [n] ((Real, Real), (Real, Real), (Real, Real)), grey: [n] Real, k)
    sum i in 0..k-1, j in 0..k-1 ((pixel(mesh, grey, i/k, j/k, 1/k)*k^2 - 0.5)^2)
"""


def exact_loss(mesh: list[Polygon], grey: list[Fraction], k: int) -> Fraction:
    h, total = Fraction(1, k), Fraction(0)
    for i in range(k):
        for j in range(k):
            value = sum(g * abs(area(in_square(t, i * h, j * h, h))) for t, g in zip(mesh, grey, strict=True))
            total += (value * k**2 - Fraction(1, 2)) ** 2
    return total


def some_mesh(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles that turn to the left, some of them beyond the edge of the picture, and how grey they are."""
    rng = np.random.default_rng(seed)
    centres = rng.uniform(-0.1, 1.1, (count, 1, 2))
    angles = rng.uniform(0, 2, (count, 1)) + np.array([0, 2.1, 4.2])
    radii = rng.uniform(0.05, 0.3, (count, 1, 1))
    return centres + radii * np.stack([np.cos(angles), np.sin(angles)], axis=-1), rng.uniform(0.2, 1, count)


def test_a_mesh_against_clipping_and_its_gradient_against_exact_differences() -> None:
    """1e-10 is what is promised; the differences are exact but for their step, of which the square counts."""
    module, k, step = potto.compile(MESH), 6, Fraction(1, 10**7)
    mesh, grey = some_mesh(16, 3)
    exact = [[(Fraction(x), Fraction(y)) for x, y in t] for t in mesh.tolist()]
    shades = [Fraction(g) for g in grey.tolist()]
    found = potto.grad(module.loss, ["mesh", "grey"])(mesh, grey, float(k))
    assert found.value == pytest.approx(float(exact_loss(exact, shades, k)), rel=1e-10)
    assert found.stats["integrals culled"] > 300
    for number in (0, 5, 11):
        for corner in range(3):
            for axis in range(2):
                sides = []
                for sign in (1, -1):
                    moved = [list(t) for t in exact]
                    point = list(moved[number][corner])
                    point[axis] += sign * step
                    moved[number][corner] = (point[0], point[1])
                    sides.append(exact_loss(moved, shades, k))
                expected = float((sides[0] - sides[1]) / (2 * step))
                assert found["mesh"][number, corner, axis] == pytest.approx(expected, rel=1e-9, abs=1e-9)
        brighter = [g + step * (i == number) for i, g in enumerate(shades)]
        expected = float((exact_loss(exact, brighter, k) - exact_loss(exact, shades, k)) / step)
        assert found["grey"][number] == pytest.approx(expected, rel=1e-6, abs=1e-6)  # a one-sided difference


SCENES = {
    "stripes": "integral [p, p + 0.1] a[i]*[b[i] < x and x < b[i] + 0.2]*(1 + x) d(x)",
    "discs": "integral ([p, p + 0.2], [0, 1]) [(x - a[i])^2 + (y - b[i])^2 < 0.0025] d(x, y)",
    "behind a call": "2*part(a[i], b[i], p)",
    "steps that meet": "integral [p, p + 0.1] [x > 0.1*i]*[x < 0.1*i + 0.1]*b[i] d(x)",
    "the other side": "integral [p, p + 0.1] (if [x < a[i]/2 + 0.5] then 0 else if [x > b[i] + 1] then 0 else x) d(x)",
    "a density": "integral (x ~ uniform(p, p + 0.3)) [x < a[i]]*[x > a[i] - 0.1] d(x)",
}
HEAD = "def part(a, b, p) integral [p, p + 0.1] [a < x and x < a + 0.1]*b d(x)\n"


@pytest.mark.parametrize("name", SCENES)
@settings(max_examples=examples(4, 200))  # one is 600 pairs three times with all of them, a second for the discs
@given(seed=st.integers(0, 10_000))
def test_what_is_left_out_is_nothing(name: str, seed: int) -> None:
    """The same sums with every pair evaluated: values, derivatives by elements and by the place of the pixel."""
    module = potto.compile(f"{HEAD}def f(a: [n] Real, b: [n] Real, p) sum i in 0..n-1 ({SCENES[name]})\n"
                           "def g(a: [n] Real, b: [n] Real) sum k in 0..9 (f(a, b, 0.1*k)*(1 + k))")  # fmt: skip
    rng = np.random.default_rng(seed)
    a, b = (np.round(rng.uniform(0, 1, 60), 1 + seed % 3) for _ in range(2))  # some of them coincide with pixels' edges
    places = np.linspace(0, 0.9, 10)
    answers = []
    kept = culling.FEW
    try:
        for few in (kept, 10**9):
            culling.FEW = few
            slopes = potto.grad(module.f, "p")(a, b, places), potto.grad(module.g)(a, b)
            answers.append((module.f(a, b, places), *slopes))
    finally:
        culling.FEW = kept
    (value, slope, whole), (value_0, slope_0, whole_0) = answers
    assert value.stats.get("integrals culled", 0) > 100
    assert value.value == pytest.approx(value_0.value, rel=1e-12, abs=1e-14)
    assert whole.value == pytest.approx(whole_0.value, rel=1e-12)
    smooth = not (slope.notes or slope_0.notes or whole.notes or whole_0.notes)  # where two surfaces meet there are two
    if smooth:
        assert slope.tangent == pytest.approx(slope_0.tangent, rel=1e-9, abs=1e-11)
        assert whole.tangent == pytest.approx(whole_0.tangent, rel=1e-9, abs=1e-11)


def test_errors_hold_and_members_are_told_apart() -> None:
    module = potto.compile("""
def f(a: [n] Real, p) sum x in a (integral [p, p + 0.1] [x < s]*[s < x + 0.05]*exp(s) d(s))
""")
    a, p = np.linspace(0, 0.95, 200), np.linspace(0, 0.9, 10)
    found = module.f(a, p)
    lo, hi = np.maximum(a[:, None], p), np.minimum(a[:, None] + 0.05, p + 0.1)
    exact = np.where(lo < hi, np.exp(hi) - np.exp(lo), 0).sum(axis=0)
    assert np.all(np.abs(found.value - exact) <= found.error + 1e-15)
    assert np.all(found.error < 1e-12)
    assert found.converged


def test_the_statistics_say_how_many_were_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a thousand strips, each a thousandth wide, a square of a hundredth meets those that are as near as that."""
    program = tmp_path / "strips.po"
    program.write_text(
        "def strip(i, x) [x > i/1000 and x < (i + 1)/1000]\n"
        "def seen(a) integral ([a, a + 0.01], [0, 0.01]) sum i in 0..999 (strip(i, x)*y) d(x, y)\n"
    )
    assert main(["eval", str(program), "seen(0.3005)", "--stats"]) == 0
    out, told = capsys.readouterr()
    assert float(out) == pytest.approx(0.01 * 0.01**2 / 2, rel=1e-12)  # they cover all of it
    left = int(told.split("integrals culled: ")[1].split()[0].replace(",", ""))
    assert 985 <= left <= 989  # eleven strips meet it; enclosures may keep a neighbour at either side


@pytest.mark.parametrize("t", [0.7, np.array([0.7, 0.2])], ids=["a number", "a batch"])
def test_sums_of_what_is_left_cover_what_they_round_off(t: object) -> None:
    """Of 300,000 summands a third are equal, so that rounding goes the same way at each; the others are nothing."""
    f = potto.compile("""
def f(xs: [n] Real, ys: [n] Real, t) sum i in 0..n-1 (integral [0, 1] xs[i]*[x + ys[i] < t] d(x))
""").f
    count = 100_000
    answer = potto.grad(f, "t")(np.full(3 * count, 0.1), np.repeat([0.0, 5.0], [count, 2 * count]), t)
    slope = count * Fraction(0.1)
    for value, error, at in zip(*map(np.ravel, (answer.value, answer.error, t)), strict=True):
        assert abs(Fraction(float(value)) - slope * Fraction(float(at))) <= Fraction(float(error)) < 1e-14 * slope
    for tangent, error in zip(*map(np.ravel, (answer.tangent, answer.tangent_error)), strict=True):
        assert abs(Fraction(float(tangent)) - slope) <= Fraction(float(error)) < 1e-14 * slope
