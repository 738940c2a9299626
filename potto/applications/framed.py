"""Images as data, and with axes and a colour bar as SVG: what does without a library for figures.

Owns `Image`, `image_of` and `images_svg`. The pixels are a PNG inside; all else is text and lines, so that it can be
read at every size.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence

from msgspec import Struct

from potto.applications.png import Color, png
from potto.runtime.answers.printing import format_digits

LEFT, TOP, BOTTOM, BAR, LABELS = 64, 30, 64, 16, 76
SIDE = 320  # of the longer side of an image
OUTLINE = "#2ca02c"  # of surfaces: neither a gray nor of a diverging map
SHADES = 64  # of a colour bar


class Image(Struct, frozen=True):
    """Pixels row by row from the top, the least and the largest value; whether zero is white between two colours.

    label: what is drawn. names, box: the axes and what is seen of them. map, tone: how numbers became colours, as
    `colours.Paint` says; no map where the pixels are colours themselves. ends: the numbers at both ends of the map.
    outlines: straight lines over it, where surfaces are.
    """

    pixels: tuple[tuple[Color, ...], ...]
    low: float
    high: float
    signed: bool = False
    label: str = ""
    names: tuple[str, str] = ("x", "y")
    box: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0)
    map: str = ""
    tone: str = "linear"
    ends: tuple[float, float] = (0.0, 1.0)
    caption: str = ""
    outlines: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        return (len(self.pixels[0]) if self.pixels else 0), len(self.pixels)

    def png(self) -> bytes:
        return png(self.pixels)

    def svg(self) -> str:
        """The image with its axes, its scale and its caption, as an SVG."""
        return images_svg([self])


def image_of(components: Sequence[Sequence[float]], columns: int, *, signed: bool = False) -> Image:
    """An image of one component in greys, or of three as red, green and blue; scaled from the least to the largest.

    signed: of a derivative; zero is white, what is above it red, what is below it blue.
    """
    from potto.applications.colours import coloured

    colours, low, high = coloured(components, signed)
    rows = (colours[i : i + columns] for i in range(0, len(colours), columns))
    plain = len(components) < 3
    most = max(-low, high) or 1.0
    colouring = ("red-blue" if signed else "gray") if plain else ""
    ends = (-most, most) if signed else (low, high)
    return Image(tuple(map(tuple, rows)), low, high, signed and plain, map=colouring, ends=ends)


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
