"""The paper's second figure: every pixel of its six images against closed forms, fits, and shaders that are swapped.

The shaders vary along x + y + c only. With F the antiderivative of the antiderivative of what is lit there, the mean
over a square of side h at (x, y) is a second difference of F: (F(s + 2h) - 2 F(s + h) + F(s))/h^2 with s = x + y + c.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from worlds_references import EXAMPLES, program

import potto

SIDE, C = 512, -0.8
IMAGE, FIT = program("paper/image"), program("paper/fit")
R = mp.sqrt(2)


def _const(u: Any) -> tuple[Any, Any]:
    return u, u * u / 2


def _lin(u: Any) -> tuple[Any, Any]:
    """Of 1/(sqrt(2) u + 2): log(1 + u/sqrt(2))/sqrt(2), and once more."""
    w = 1 + u / R
    return mp.log(w) / R, w * mp.log(w) - u / R


def _quad(u: Any) -> tuple[Any, Any]:
    """Of 1/(sqrt(2) u + 2)^2: u/(2 (sqrt(2) u + 2)), and once more."""
    return u / (2 * (R * u + 2)), u / (2 * R) - mp.log(1 + u / R) / 2


TWICE: dict[str, Callable[[Any], tuple[Any, Any]]] = {"const_shader": _const, "lin_shader": _lin, "quad_shader": _quad}


def exact(kind: str, side: int, c: float) -> tuple[Any, Any]:
    """Value and derivative by c of all pixels, (side, side) each: as many numbers as there are diagonals."""
    with mp.workdps(40):
        h = mp.mpf(1) / side
        ends = [mp.mpf(c) + k * h for k in range(2 * side + 1)]
        twice = [TWICE[kind](u) if u > 0 else (mp.mpf(0), mp.mpf(0)) for u in ends]
        value, slope = (
            [float((c - 2 * b + a) / h**2) for a, b, c in zip(part, part[1:], part[2:])]
            for part in ([f for _, f in twice], [f for f, _ in twice])
        )
    diagonal = np.add.outer(np.arange(side), np.arange(side))
    return np.array(value)[diagonal], np.array(slope)[diagonal]


def seen(kind: str, side: int, c: float) -> potto.Estimate:
    module = potto.Workspace(EXAMPLES / "paper").compile(
        (EXAMPLES / "paper" / "image.po").read_text(encoding="utf-8").replace("h = 1 / 256", f"h = 1 / {side}")
    )
    places = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(places, places)
    return potto.deriv(module.pixel)(x, y, dc=(c, 1.0), dshader=potto.deriv(getattr(module, kind)))


@pytest.mark.parametrize("c", [C, -1.0], ids=["anywhere", "through corners"])
@pytest.mark.parametrize("kind", list(TWICE))
def test_every_pixel_and_every_derivative(kind: str, c: float) -> None:
    """At c = -1 the border of the light runs through the corners of pixels."""
    found, (value, slope) = seen(kind, SIDE, c), exact(kind, SIDE, c)
    assert np.all(found.converged)
    assert np.abs(np.asarray(found.value) - value).max() < 1e-11
    assert np.abs(np.asarray(found.tangent) - slope).max() < 1e-8


NEW = """
def first(x, y) \\c . 1 / (1.75 * (x + y + c) + 2.25)^3
def second(x, y) \\c . exp(-x * y) * (c + 2.25)
"""


def test_a_swap_of_shaders_leaves_the_renderer_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another shader costs its own kernels: where all of a pixel is lit, where the border runs through it, with its
    rounding and without, and the name's. One that has been there costs none."""
    monkeypatch.setenv("POTTO_CACHE", "off")
    text = (EXAMPLES / "paper" / "image.po").read_text(encoding="utf-8").replace("h = 1 / 256", "h = 1 / 64")
    module = potto.Workspace(EXAMPLES / "paper").compile(text + NEW)
    places = (np.arange(64) + 0.5) / 64
    x, y = np.meshgrid(places, places)

    def swap(kind: str) -> tuple[int, float]:
        shader, begin = potto.deriv(getattr(module, kind)), time.process_time()
        found = potto.deriv(module.pixel)(x, y, dc=(C, 1.0), dshader=shader)
        return int(found.stats["kernels compiled"]), time.process_time() - begin

    with potto.settings(backend="numpy"):
        swap("lin_shader")
        for kind in ("first", "second"):
            new, again = swap(kind), swap(kind)
            assert 1 <= new[0] <= 4 and again[0] == 0
            assert new[1] - again[1] < 0.04  # of the processor, twice what it takes
        assert swap("lin_shader")[0] == swap("first")[0] == 0


@pytest.mark.parametrize(("kind", "m"), [("const_shader", 0.6), ("lin_shader", 0.6), ("quad_shader", 0.3)])
def test_c_by_the_light_of_one_pixel(kind: str, m: float) -> None:
    """With m = 2 + c the renderer sees F(m)."""
    target = float(TWICE[kind](mp.mpf(m))[1])
    found = potto.fit(FIT.light, {"c": -1.8}, given={"shader": getattr(IMAGE, kind)}, target=target)
    assert found.converged and abs(found["c"] - (m - 2)) < 1e-6


def test_c_by_a_whole_image() -> None:
    assert np.abs(np.asarray(FIT.eval("target")) - exact("lin_shader", 12, -1.15)[0]).max() < 1e-13
    found = potto.fit(FIT.miss, {"c": -0.9})
    assert found.converged and abs(found["c"] + 1.15) < 1e-6


def test_no_pixel_takes_much_longer_than_the_others() -> None:
    """Dark, lit, crossed by the border, crossed from corner to corner, where both sides are looked at by themselves:
    by the evaluations of each, which no other program on the machine changes."""
    function, shader = potto.deriv(IMAGE.pixel), potto.deriv(IMAGE.quad_shader)
    inside = [(0.3, 0.2), (0.8, 0.7), (0.9, 0.1), (0.001, 0.9)]
    crossed = [(0.5003, 0.3), (0.001, 0.799), (0.6001, 0.2), (0.3, 0.5008)]
    through_corners = [(0.5, 0.3), (0.4, 0.4)]
    spent = [function(x, y, dc=(C, 1.0), dshader=shader).evals for x, y in (*inside, *crossed, *through_corners)]
    assert 0 < max(spent) < 20 * np.median(spent)
