"""Images with axes and a colour bar as SVG: what does without a library for figures.

Owns `images_svg`. The pixels are a PNG inside; all else is text and lines, so that it can be read at every size.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from typing import TYPE_CHECKING

from potto.runtime.answers.printing import format_digits

if TYPE_CHECKING:
    from potto.applications.pictures import Image

LEFT, TOP, BOTTOM, BAR, LABELS = 64, 30, 64, 16, 76
SIDE = 320  # of the longer side of an image
OUTLINE = "#2ca02c"  # of surfaces: neither a gray nor of a diverging map
SHADES = 64  # of a colour bar


def images_svg(images: Sequence[Image]) -> str:
    """Images beside each other, each in its frame: the label above, the axes, the bar at the right, a caption below."""
    found: list[str] = []
    left = tallest = 0.0
    for image in images:
        text, wide, tall = _panel(image)
        found.append(f'<g transform="translate({left:.0f} 0)">\n{text}\n</g>')
        left, tallest = left + wide, max(tallest, tall)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{left:.0f}" height="{tallest:.0f}" '
    ground = f'<rect width="{left:.0f}" height="{tallest:.0f}" fill="white"/>'
    return "\n".join([head + 'font-family="sans-serif" font-size="12">', ground, *found, "</svg>", ""])


def _panel(image: Image) -> tuple[str, float, float]:
    """One image with all around it, and how wide and how high that is."""
    across, down = image.size
    scale = SIDE / max(across, down, 1)
    wide, tall = across * scale, down * scale
    data = base64.b64encode(image.png()).decode()
    x0, x1, y0, y1 = image.box
    out = [
        f'<image x="{LEFT}" y="{TOP}" width="{wide:.1f}" height="{tall:.1f}" preserveAspectRatio="none" '
        f'style="image-rendering:pixelated" href="data:image/png;base64,{data}"/>',
        f'<rect x="{LEFT}" y="{TOP}" width="{wide:.1f}" height="{tall:.1f}" fill="none" stroke="#999"/>',
        _text(LEFT, TOP - 10, image.label, "start", 'font-weight="bold"'),
        _text(LEFT + wide / 2, TOP + tall + 34, image.names[0], "middle", 'font-style="italic"'),
        _text(14, TOP + tall / 2, image.names[1], "middle", 'font-style="italic"'),
        _text(LEFT, TOP + tall + 54, image.caption, "start", 'font-size="11" fill="#555"'),
    ]
    for share in (0.0, 0.5, 1.0):
        out.append(_text(LEFT + share * wide, TOP + tall + 17, format_digits(x0 + share * (x1 - x0), 4), "middle"))
        out.append(_text(LEFT - 6, TOP + (1 - share) * tall + 4, format_digits(y0 + share * (y1 - y0), 4), "end"))
    if image.outlines:
        right, up = wide / (x1 - x0), tall / (y1 - y0)
        lines = (f"M{LEFT + (a - x0) * right:.1f} {TOP + (y1 - b) * up:.1f}L{LEFT + (c - x0) * right:.1f} "
                 f"{TOP + (y1 - d) * up:.1f}" for (a, b), (c, d) in image.outlines)  # fmt: skip
        out.append(f'<path d="{"".join(lines)}" fill="none" stroke="{OUTLINE}" stroke-width="1"/>')
    if image.map:
        out += _bar(image, LEFT + wide + 16, tall)
    right = 20 + BAR + LABELS if image.map else 20
    return "\n".join(filter(None, out)), LEFT + wide + right, TOP + tall + BOTTOM


def _bar(image: Image, left: float, tall: float) -> list[str]:
    import numpy as np

    from potto.applications.colours import Paint, as_bytes

    paint = Paint(*image.ends, image.map, image.tone, image.signed)
    levels = (np.arange(SHADES) + 0.5) / SHADES
    out = []
    for level, (r, g, b) in zip(levels.tolist(), as_bytes(paint.along(levels)).tolist(), strict=True):
        y = TOP + (1 - level - 0.5 / SHADES) * tall
        out.append(f'<rect x="{left:.1f}" y="{y:.2f}" width="{BAR}" height="{tall / SHADES + 0.5:.2f}" '
                   f'fill="rgb({r},{g},{b})"/>')  # fmt: skip
    out.append(f'<rect x="{left:.1f}" y="{TOP}" width="{BAR}" height="{tall:.1f}" fill="none" stroke="#999"/>')
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        number = format_digits(paint.number(share), 3)
        out.append(_text(left + BAR + 6, TOP + (1 - share) * tall + 4, number, "start"))
    return out


def _text(x: float, y: float, text: str, anchor: str, style: str = "") -> str:
    if not text:
        return ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {style}>{html.escape(text)}</text>'
