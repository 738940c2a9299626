"""The paper's renderer, equation (1), fitted by its c: to the light of one pixel, and to a whole image.

With m = 2 + c between 0 and 1, the light of one pixel is the integral of (m - v) s(v) over v in [0, m], by hand below.
A pixel at (px, py) of the plane sees c + px + py.
"""

from __future__ import annotations

from collections.abc import Callable
from math import log, sqrt

import numpy as np
import pytest

import potto

SOURCE = """
def renderer(c, shader)
    integral ([0, 1], [0, 1]) ((shader (x, y)) c) * [x + y + c >= 0] d(x, y)
constant  = \\(x, y) . c . 1
linear    = \\(x, y) . c . 1/(sqrt(2)*(x + y + c) + 2)
quadratic = \\(x, y) . c . 1/(sqrt(2)*(x + y + c) + 2)^2
def by_constant(c, o) renderer(c + o, constant)
def by_linear(c, o) renderer(c + o, linear)
def by_quadratic(c, o) renderer(c + o, quadratic)
"""
R = sqrt(2)


def by_constant(m: float) -> float:
    return m * m / 2


def by_linear(m: float) -> float:
    return (m + R) / R * log(1 + m / R) - m / R


def by_quadratic(m: float) -> float:
    return (m + R) / R * (1 / 2 - 1 / (R * m + 2)) - log(1 + m / R) / 2


LIGHTS = [by_constant, by_linear, by_quadratic]


@pytest.mark.parametrize("light", LIGHTS)
def test_c_by_the_light_of_one_pixel(light: Callable[[float], float]) -> None:
    m = potto.compile(SOURCE)
    found = potto.fit(getattr(m, light.__name__), {"c": -1.8}, given={"o": 0}, target=light(0.6))
    assert found.converged, found.reason
    assert found["c"] == pytest.approx(-1.4, abs=1e-6)


@pytest.mark.parametrize("light", LIGHTS)
def test_c_by_an_image_with_pixels_that_stay_dark(light: Callable[[float], float]) -> None:
    m = potto.compile(SOURCE)
    offsets = np.linspace(-1, 0.3, 14)
    target = np.array([light(max(0.0, 0.6 + o)) for o in offsets])
    found = potto.fit(getattr(m, light.__name__), {"c": -1.8}, given={"o": offsets}, target=target)
    assert found.converged, found.reason
    assert found["c"] == pytest.approx(-1.4, abs=1e-6)
