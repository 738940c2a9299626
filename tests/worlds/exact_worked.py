"""What the curves of the small programs are by closed forms."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mpmath as mp

EDGES, COUNTS = (-3, -1, 0, mp.mpf("0.5"), 1, 2, 4), (4, 13, 18, 22, 32, 11)


def quarter_in_the_square(r: Any) -> Any:
    """Of a quarter of a disc at a corner of the unit square what lies in it: two triangles and a sector, once it leaves
    the square through two of its sides."""
    if r <= 1:
        return mp.pi * r**2 / 4
    return mp.sqrt(r**2 - 1) + r**2 / 2 * (mp.pi / 2 - 2 * mp.acos(1 / r)) if r**2 < 2 else mp.mpf(1)


def above_the_ray(a: Any) -> Any:
    """Of the unit square: all but a triangle, or just one."""
    return 1 - mp.tan(a) / 2 if a < mp.pi / 4 else mp.cot(a) / 2


def mean_beyond(q: Any) -> Any:
    """The mean of a standard normal variable where it is beyond q: the inverse of Mills' ratio."""
    return mp.npdf(q) / mp.ncdf(-q)


def misfit(m: Any) -> Any:
    """Pearson's sum for a normal density of the width 1.2."""
    ends = [mp.ncdf((edge - m) / mp.mpf(1.2)) for edge in EDGES]
    expected = [sum(COUNTS) * (b - a) for a, b in pairwise(ends)]
    return sum((count - e) ** 2 / e for count, e in zip(COUNTS, expected, strict=True))
