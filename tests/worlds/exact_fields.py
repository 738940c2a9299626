"""Fields: closed forms, sections, clipped polygons, for numbers of mpmath."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp
import polygons


def two_bands(e: Any, v: Any, w: Any) -> Any:
    below = mp.acos(((v * v + w * w) - e * e) / (2 * v * w)) / mp.pi
    return 1 + below if e > 0 else 1 - below


def balls(apart: Any, level: Any, weight: Callable[[Any], Any]) -> tuple[float, float]:
    """By sections: y^2 < log(g(x)/level); by the distance, the sections' ends move."""

    def g(x: Any) -> Any:
        return mp.exp(-((x + apart) ** 2)) + mp.exp(-((x - apart) ** 2))

    def rate(x: Any) -> Any:
        return 2 * ((x - apart) * mp.exp(-((x - apart) ** 2)) - (x + apart) * mp.exp(-((x + apart) ** 2))) / g(x)

    end = mp.findroot(lambda x: g(x) - level, apart + mp.sqrt(-mp.log(level)))
    places = [0, apart, end]
    value = 4 * mp.quad(lambda x: weight(x) * mp.sqrt(abs(mp.log(g(x) / level))), places)
    slope = 2 * mp.quad(lambda x: weight(x) * rate(x) / mp.sqrt(abs(mp.log(g(x) / level))), places)
    return float(value), float(slope)


def gained(w: list[Any], weight: Any) -> Any:
    """The plate by sections: (y - 1/2)^2 < log(2 g(x))/4, along which the stress has an arc tangent."""

    def section(x: Any) -> Any:
        g = sum(wi * mp.exp(-4 * (x - mp.mpf(i) / 2) ** 2) for i, wi in enumerate(w))
        half, root = mp.sqrt(mp.log(2 * g)) / 2, mp.sqrt(1 + 4 * (x - mp.mpf(1) / 2) ** 2)
        low, high = mp.mpf(1) / 2 - half, mp.mpf(1) / 2 + half
        return (mp.atan(2 * high / root) - mp.atan(2 * low / root)) / (2 * root) - weight * (high - low)

    return mp.quad(section, [0, mp.mpf(1) / 2, 1])


def bright(t: Any) -> Any:
    """Sections of the cell: from x = t on, y > (t - 1 + x)/(2 x - 1), and the same in the other corner."""
    return 2 * mp.quad(lambda x: 1 - (t - 1 + x) / (2 * x - 1), [t, 1])


WAVES = [(1.0, 2.3, 0.4), (-2.9, 1.1, 1.7), (2.1, -3.7, 4.2), (4.3, 3.1, 2.9)]


def cell_area(sites: list[tuple[Any, Any]], own: int) -> Any:
    """The area of a cell: the square, cut with one half plane after another."""
    corners = [(mp.mpf(x), mp.mpf(y)) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    px, py = sites[own]
    for number, (qx, qy) in enumerate(sites):
        if number == own:
            continue

        def side(c: tuple[Any, Any], qx: Any = qx, qy: Any = qy) -> Any:
            return (c[0] - qx) ** 2 + (c[1] - qy) ** 2 - (c[0] - px) ** 2 - (c[1] - py) ** 2

        corners = polygons.clipped(corners, side)
    return polygons.area(corners)


SITES = [(0.2, 0.3), (0.7, 0.2), (0.5, 0.6), (0.15, 0.8), (0.85, 0.75)]


ARROW = [(0.1, 0.1), (0.9, 0.5), (0.2, 0.9), (0.4, 0.45)]
