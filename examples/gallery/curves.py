"""A value and its derivative over a parameter, as SVG that is readable on light and on dark paper; needs no library."""

from __future__ import annotations

import html
import math
from typing import Any

import numpy as np

WIDTH, HEIGHT, PANEL = 480.0, 320.0, 110.0
LEFT, RIGHT, TOP, GAP = 62.0, 14.0, 26.0, 34.0
STYLE = (
    "text{font:12px system-ui,sans-serif;fill:#333}.axis{stroke:#999;fill:none}.grid{stroke:#8884;fill:none}"
    ".value{stroke:#1b6ca8;fill:none;stroke-width:2}.slope{stroke:#c0392b;fill:none;stroke-width:2}"
    ".paper{fill:#fff}"
    "@media(prefers-color-scheme:dark){text{fill:#ddd}.axis{stroke:#777}.paper{fill:#16181d}"
    ".value{stroke:#6fb7ee}.slope{stroke:#ff8a7a}}"
)


def ticks(low: float, high: float, most: int = 5) -> list[float]:
    """Round numbers from low to high, at most so many and one."""
    raw = (high - low) / most
    size = 10.0 ** math.floor(math.log10(raw))
    step = next(size * m for m in (1, 2, 5, 10) if size * m >= raw * (1 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


def _ends(numbers: Any) -> tuple[float, float]:
    low, high = float(np.min(numbers)), float(np.max(numbers))
    size = max(abs(low), abs(high))
    slack = 0.06 * (high - low) if high - low > 1e-9 * size else 0.5 * size or 0.5  # what rounding leaves is no shape
    return low - slack, high + slack


def _panel(top: float, places: Any, numbers: Any, name: str, style: str) -> str:
    (x0, x1), (y0, y1) = (float(places[0]), float(places[-1])), _ends(numbers)

    def across(x: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (x - x0) / (x1 - x0)

    def up(y: float) -> float:
        return top + PANEL * (y1 - y) / (y1 - y0)

    parts = [f'<text x="{LEFT}" y="{top - 8}" font-weight="600">{name}</text>']
    for tick in ticks(y0, y1):
        parts.append(f'<path class="grid" d="M{LEFT} {up(tick):.1f}H{WIDTH - RIGHT}"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{up(tick) + 4:.1f}" text-anchor="end">{tick:.5g}</text>')
    for tick in ticks(x0, x1, 7):
        parts.append(f'<path class="grid" d="M{across(tick):.1f} {top}v{PANEL}"/>')
        if style == "slope":
            where = f'x="{across(tick):.1f}" y="{top + PANEL + 15:.1f}"'
            parts.append(f'<text {where} text-anchor="middle">{tick:.5g}</text>')
    parts.append(f'<rect class="axis" x="{LEFT}" y="{top}" width="{WIDTH - LEFT - RIGHT}" height="{PANEL}"/>')
    points = " ".join(f"{across(float(x)):.1f},{up(float(y)):.1f}" for x, y in zip(places, numbers))
    return "".join([*parts, f'<polyline class="{style}" points="{points}"/>'])


def plot(places: Any, values: Any, slopes: Any, over: str) -> str:
    """Two panels, one above the other, over the same axis."""
    lower = TOP + PANEL + GAP
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" width="{WIDTH:g}">'
        f'<style>{STYLE}</style><rect class="paper" width="{WIDTH:g}" height="{HEIGHT:g}" rx="6"/>'
        + _panel(TOP, places, values, "value", "value")
        + _panel(lower, places, slopes, "derivative", "slope")
        + f'<text x="{(LEFT + WIDTH - RIGHT) / 2:g}" y="{HEIGHT - 6:g}" text-anchor="middle">{html.escape(over)}</text>'
        + "</svg>\n"
    )
