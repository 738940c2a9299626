"""A soft shadow in four dimensions."""

from __future__ import annotations

from itertools import product
from typing import Any

import mpmath as mp


def half_shadow(lx: Any, x: float, y: float, h: float) -> Any:
    """With a level edge the border is a hyperplane in four dimensions: a box that is cut by one, corner by corner.

    The mean over the square of side h around (x, y), all of it seen by a square lamp of width 0.4 around (lx, 0.4, 3).
    The edge is cast to 1.5 a - 0.5 l, its direction stays; p is lit where it is on the other side of it.
    """
    (ax, ay), (ex, ey) = (mp.mpf("0.4"), mp.mpf(0)), (mp.mpf("0.2"), mp.mpf(1))  # a, and the direction of the edge
    half, wide = mp.mpf(h) / 2, mp.mpf("0.4") / 2

    def lit(x: Any, y: Any, lx: Any, ly: Any) -> Any:
        return ey * (x - 3 * ax / 2 + lx / 2) - ex * (y - 3 * ay / 2 + ly / 2)

    ends = (
        (x - half, x + half),
        (y - half, y + half),
        (lx - wide, lx + wide),
        (mp.mpf("0.4") - wide, mp.mpf("0.4") + wide),
    )
    total = mp.mpf(0)
    for corner in product((0, 1), repeat=4):
        value = lit(*(ends[i][c] for i, c in enumerate(corner)))
        total += (-1) ** sum(corner) * max(value, mp.mpf(0)) ** 4
    return total / (24 * mp.fprod((ey, -ex, ey / 2, -ex / 2))) / mp.mpf(h) ** 2 / mp.mpf("0.4") ** 2
