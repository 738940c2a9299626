"""Surfaces over an image: where they are by symbols, as lines, and in a figure."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from command_runs import Potto

from potto.applications.contours import zero_lines
from potto.checking.outlines import outlines
from potto.evaluating.world import World

PROGRAM = r"""
h = 1/8
def cut(x, y, r) [x^2 + y^2 < r^2]
def disc(x, y, r) integral ([x - h, x + h], [y - h, y + h]) cut(u, v, r) d(u, v)
def offset(x, y, c) integral [0, 1] [x + s/4 < c] d(s)
def bracket(x, y) [2*x > y]
def elsewhere(x, y, c) x*y*(integral [0, 1] [s < c] d(s))
def summed(x, y) sum i in 1..3 (integral [x, x + h] [u < i/4] d(u))
def shaded(x, y, s) integral ([x, x + h], [y, y + h]) [s(u) < v] d(u, v)
"""
SIDE = np.linspace(-1.0, 1.0, 201)


def lines_of(f) -> np.ndarray:
    return zero_lines(f(*np.meshgrid(SIDE, SIDE)), SIDE, SIDE)


def lengths(lines: np.ndarray) -> np.ndarray:
    return np.hypot(*(lines[:, 1] - lines[:, 0]).T)


def test_a_circle_is_a_circle() -> None:
    """The ends lie on it up to the square of a cell, h^2/(8 r); the lines are as long as it is round."""
    lines = lines_of(lambda x, y: x**2 + y**2 - 0.49)
    assert np.abs(np.hypot(lines[..., 0], lines[..., 1]) - 0.7).max() < 0.01**2 / (8 * 0.7) * 1.01
    assert lengths(lines).sum() == pytest.approx(2 * np.pi * 0.7, rel=1e-4)


@pytest.mark.parametrize(("a", "b", "c"), [(1, 0, 0.003), (0, 1, -0.5021), (1, 1, 0.1003), (-2, 1, 0.0401)])
def test_a_line_is_straight_in_each_direction(a: float, b: float, c: float) -> None:
    for sign in (1, -1):
        lines = lines_of(lambda x, y, s=sign: s * (a * x + b * y - c))
        assert np.abs(a * lines[..., 0] + b * lines[..., 1] - c).max() < 1e-12
        ends = lines.reshape(-1, 2)
        span = np.hypot(*(ends.max(axis=0) - ends.min(axis=0)))
        assert lengths(lines).sum() == pytest.approx(span, rel=1e-9)


def test_lines_that_cross() -> None:
    """x y = 0 near the middle of a cell: both of its lines are there, whichever way the saddle is turned."""
    for sign in (1, -1):
        lines = lines_of(lambda x, y, s=sign: s * (x - 0.005) * (y - 0.005))
        assert lengths(lines).sum() == pytest.approx(4.0, rel=0.01)


def test_places_without_a_value_and_without_a_zero() -> None:
    assert lines_of(lambda x, y: x**2 + 1).shape == (0, 2, 2)
    lines = lines_of(lambda x, y: np.where(x > 0, np.nan, y - 0.003))
    assert lines[..., 0].max() <= 0 and lengths(lines).sum() == pytest.approx(1.0)


@pytest.mark.parametrize(("name", "wanted"), [
    ("disc", 1), ("offset", 1), ("bracket", 1), ("elsewhere", 0), ("summed", 0), ("shaded", 0),
])  # fmt: skip
def test_what_is_seen_of_surfaces(tmp_path: Path, name: str, wanted: int) -> None:
    """Of `disc` the circle, of `offset` the line x + 1/8 = c; nothing of what the axes do not move."""
    (tmp_path / "s.po").write_text(PROGRAM)
    world = World([tmp_path])
    file = world.key(tmp_path / "s.po")
    tree, _ = world.typed(file, name)
    texts = outlines(world.db, file, tree, ("x", "y"))
    assert len(texts) == wanted
    zeros = {"disc": ((0.3, 0.4, 0.5), (0.0, 1.0, 1.0)), "offset": ((0.5, 0.625), (0.0, 0.125)),
             "bracket": ((0.25, 0.5), (1.0, 2.0))}  # fmt: skip
    for place in zeros.get(name, ()):
        (text,) = texts
        assert world.evaluate(file, f"({text})({', '.join(map(str, place))})").estimate.value == pytest.approx(0)


def test_a_figure_with_the_surface(potto: Potto, tmp_path: Path) -> None:
    words = ["disc", "r=0.7", "--size", "16", "--scale"]
    assert potto("render", "s.po", *words, "--surfaces", "-o", "d.svg", s=PROGRAM).status == 0
    drawn = re.search(r'<path d="(M[^"]*)" fill="none" stroke="#2ca02c"', (tmp_path / "d.svg").read_text())
    assert drawn is not None
    ends = np.array([[float(n) for n in pair.split()] for pair in re.findall(r"[ML]([^ML]*)", drawn[1])])
    assert np.abs(np.hypot((ends[:, 0] - 64) / 320, (350 - ends[:, 1]) / 320) - 0.7).max() < 1e-3
    potto("render", "s.po", *words, "-o", "d.svg")
    assert "#2ca02c" not in (tmp_path / "d.svg").read_text()


def test_surfaces_that_cannot_be_drawn(potto: Potto) -> None:
    ran = potto("render", "s.po", "summed", "--size", "4", "--scale", "--surfaces", "-o", "s.svg", s=PROGRAM)
    assert ran.status == 0 and "no surface can be drawn" in ran.err
    ran = potto("render", "s.po", "summed", "--size", "4", "--surfaces")
    assert ran.status == 2 and "add --scale" in ran.err
