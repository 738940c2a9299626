"""Points on the unit sphere, for tests of bodies in space."""

from __future__ import annotations

import math


def directions(n: int) -> list[tuple[float, float, float]]:
    """Points all over the unit sphere, none of them along an axis."""
    heights = (1 - 2 * (k + 0.37) / n for k in range(n))
    around = (2.399963 * k + 0.2 for k in range(n))
    return [(math.sqrt(1 - z * z) * math.cos(a), math.sqrt(1 - z * z) * math.sin(a), z)
            for z, a in zip(heights, around, strict=True)]  # fmt: skip
