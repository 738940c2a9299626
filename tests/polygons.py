"""Convex polygons by their corners, in fractions or in numbers of mpmath: the references for flat regions of the plane.

Owns `clipped`, `in_square`, `area` and `moment`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

Point = tuple[Any, Any]
Polygon = list[Point]


def clipped(polygon: Polygon, margin: Callable[[Point], Any]) -> Polygon:
    """What of a polygon has a margin, affine in the place, that is not negative (Sutherland and Hodgman 1974)."""
    out: Polygon = []
    margins = [margin(point) for point in polygon]
    for i, (here, m) in enumerate(zip(polygon, margins, strict=True)):
        there, n = polygon[i - 1], margins[i - 1]
        if m * n < 0:
            share = n / (n - m)
            out.append((there[0] + share * (here[0] - there[0]), there[1] + share * (here[1] - there[1])))
        if m >= 0:
            out.append(here)
    return out


def in_square(polygon: Polygon, x: Any, y: Any, h: Any) -> Polygon:
    """What of a polygon is in [x, x + h] x [y, y + h]."""
    for axis, low in ((0, x), (1, y)):
        high = low + h
        polygon = clipped(polygon, lambda p, axis=axis, low=low: p[axis] - low)  # type: ignore[misc]
        polygon = clipped(polygon, lambda p, axis=axis, high=high: high - p[axis])  # type: ignore[misc]
    return polygon


def area(polygon: Polygon) -> Any:
    """The area of a polygon, which need not be convex: positive where its corners run to the left."""
    double = sum(p[0] * q[1] - q[0] * p[1] for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True))
    return double / 2 if polygon else 0


def moment(polygon: Polygon, a: Any, b: Any, c: Any) -> Any:
    """The integral of a*x + b*y + c over a polygon, by triangles."""
    found = 0 * c
    for (x1, y1), (x2, y2) in itertools.pairwise(polygon[1:]):
        x0, y0 = polygon[0]
        size = abs((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) / 2
        found += size * (a * (x0 + x1 + x2) / 3 + b * (y0 + y1 + y2) / 3 + c)
    return found
