"""Equation (1) of the paper, its four files as printed, against closed forms by 40-digit arithmetic.

With z = x + y + c and G'' = s, G(0) = G'(0) = 0, the integral over the unit square is G(c + 2) - 2 G(c + 1) + G(c),
where G counts for positive arguments only.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath as mp
import pytest

import potto

PAPER = Path(__file__).parents[2] / "examples" / "paper"
PLACES = [-2.5, -2.0, -1.999, -1.9, -1.7, -1.3, -1.1, -1.0001, -1.0, -0.999, -0.9, -0.7, -0.5, -0.3, -0.1, -0.01,
          0.0, 0.3, 1.1, 2.0]  # fmt: skip


def antiderivatives(shader: str) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    """G and G' of a shader."""
    r = mp.sqrt(2)
    if shader == "dconst_shader":
        return lambda z: z * z / 2, lambda z: z
    if shader == "dlin_shader":
        return lambda z: ((r * z + 2) * mp.log(1 + z / r) - r * z) / 2, lambda z: mp.log(1 + z / r) / r
    return lambda z: z / (2 * r) - mp.log(1 + z / r) / 2, lambda z: 1 / (2 * r) - 1 / (r * (r * z + 2))


def second_difference(f: Callable[[Any], Any], c: Any) -> Any:
    return sum(k * f(c + n) for k, n in ((1, 2), (-2, 1), (1, 0)) if c + n > 0)


@pytest.mark.parametrize("c", PLACES)
@pytest.mark.parametrize("shader", ["dconst_shader", "dlin_shader", "dquad_shader"])
def test_value_and_derivative(shader: str, c: float) -> None:
    ws = potto.Workspace(PAPER)
    r = ws.module("renderer").drenderer(dc=(c, 1.0), dshader=getattr(ws.module("color_shaders"), shader))
    with mp.workdps(40):
        primitive, slope = antiderivatives(shader)
        value, tangent = second_difference(primitive, mp.mpf(c)), second_difference(slope, mp.mpf(c))
        for got, exact, error in ((r.value, value, r.error), (r.tangent, tangent, r.tangent_error)):
            off = float(abs(mp.mpf(got) - exact))
            # 1e-12 relative is what is promised; the second term is one rounding of the answer itself
            assert off <= 1e-12 * abs(exact) and off <= 1e-13
            assert off <= error + 2.0**-52 * abs(exact)
    sides = 2 if c in (-1.0, 0.0) else 1  # on which the half plane runs into a corner of the pixel, or does not
    assert r.evals <= 200 * sides and r.converged
