"""Pictures as data: curves and images, and their files.

Owns `Plot`, `Image` and `png`. How a terminal shows them is in `drawing`.
"""

from __future__ import annotations

import html
import itertools
import math
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

Color = tuple[int, int, int]
COLORS: tuple[Color, ...] = ((31, 119, 180), (214, 39, 40), (44, 160, 44), (148, 103, 189), (255, 127, 14))
WHITE: Color = (255, 255, 255)
HOLE: Color = (128, 128, 128)


@dataclass(frozen=True, slots=True)
class Plot:
    """Curves over one stretch: values at equal distances, nan where there is none."""

    labels: tuple[str, ...]
    curves: tuple[tuple[float, ...], ...]
    lo: float
    hi: float
    axis: str = "x"

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest value, a little apart."""
        finite = [y for curve in self.curves for y in curve if math.isfinite(y)]
        if not finite:
            return 0.0, 1.0
        low, high = min(finite), max(finite)
        if high - low <= 1e-12 * max(abs(low), abs(high)):
            pad = max(abs(high), 1.0) * 0.5
            return low - pad, high + pad
        return low, high

    def places(self, curve: Sequence[float]) -> list[tuple[float, float]]:
        """A curve in the unit square, from below."""
        low, high = self.span
        last = max(len(curve) - 1, 1)
        return [(i / last, (y - low) / (high - low)) for i, y in enumerate(curve)]

    def svg(self, width: int = 640, height: int = 400) -> str:
        left, top, right, bottom = 70, 20, 20, 40
        inner_w, inner_h = width - left - right, height - top - bottom
        low, high = self.span
        out = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" '
            f'font-size="12">',
            f'<rect width="{width}" height="{height}" fill="white"/>',
            f'<rect x="{left}" y="{top}" width="{inner_w}" height="{inner_h}" fill="none" stroke="#999"/>',
        ]
        for share, label in ((0.0, low), (0.5, (low + high) / 2), (1.0, high)):
            y = top + (1 - share) * inner_h
            out.append(f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{label:.4g}</text>')
        for share, label in ((0.0, self.lo), (0.5, (self.lo + self.hi) / 2), (1.0, self.hi)):
            x = left + share * inner_w
            out.append(f'<text x="{x:.1f}" y="{height - 20}" text-anchor="middle">{label:.4g}</text>')
        for number, curve in enumerate(self.curves):
            color = "rgb({},{},{})".format(*COLORS[number % len(COLORS)])
            for run in runs(self.places(curve)):
                points = " ".join(f"{left + x * inner_w:.2f},{top + (1 - y) * inner_h:.2f}" for x, y in run)
                out.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.5"/>')
            name = html.escape(self.labels[number]) if number < len(self.labels) else ""
            out.append(f'<text x="{left + 8}" y="{top + 16 + 15 * number}" fill="{color}">{name}</text>')
        return "\n".join([*out, "</svg>", ""])

    def png(self, width: int = 640, height: int = 400) -> bytes:
        pixels = [[WHITE] * width for _ in range(height)]
        for x in range(width):
            pixels[0][x] = pixels[-1][x] = (200, 200, 200)
        for row in pixels:
            row[0] = row[-1] = (200, 200, 200)
        for number, curve in enumerate(self.curves):
            for run in runs(self.places(curve)):
                for x, y in line([(x * (width - 1), (1 - y) * (height - 1)) for x, y in run]):
                    for dx, dy in ((0, 0), (1, 0), (0, 1)):
                        if 0 <= x + dx < width and 0 <= y + dy < height:
                            pixels[y + dy][x + dx] = COLORS[number % len(COLORS)]
        return png(pixels)


@dataclass(frozen=True, slots=True)
class Image:
    """Pixels row by row from the top, and what the darkest and the lightest stand for."""

    pixels: tuple[tuple[Color, ...], ...]
    low: float
    high: float

    @property
    def size(self) -> tuple[int, int]:
        return (len(self.pixels[0]) if self.pixels else 0), len(self.pixels)

    def png(self) -> bytes:
        return png(self.pixels)

    def svg(self) -> str:
        """The image as an image inside of an SVG."""
        import base64

        width, height = self.size
        data = base64.b64encode(self.png()).decode()
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width * 4}" height="{height * 4}" '
            f'viewBox="0 0 {width} {height}"><image width="{width}" height="{height}" '
            f'style="image-rendering:pixelated" href="data:image/png;base64,{data}"/></svg>\n'
        )


def image_of(components: Sequence[Sequence[float]], columns: int) -> Image:
    """An image of one component in greys, or of three as red, green and blue; scaled from the least to the largest."""
    finite = [v for part in components for v in part if math.isfinite(v)]
    low, high = (min(finite), max(finite)) if finite else (0.0, 1.0)
    if len(components) >= 3 and low >= 0 and high <= 1:
        low, high = 0.0, 1.0  # colours as they are meant
    scale = high - low or 1.0

    def level(value: float) -> int:
        return round(255 * (value - low) / scale)

    flat: list[Color] = []
    for values in zip(*components, strict=True):
        if not all(map(math.isfinite, values)):
            flat.append(HOLE)
        elif len(values) >= 3:
            flat.append((level(values[0]), level(values[1]), level(values[2])))
        else:
            flat.append((level(values[0]),) * 3)
    return Image(tuple(tuple(flat[i : i + columns]) for i in range(0, len(flat), columns)), low, high)


def runs(places: Sequence[tuple[float, float]]) -> list[list[tuple[float, float]]]:
    """The stretches of a curve without holes."""
    found: list[list[tuple[float, float]]] = [[]]
    for x, y in places:
        if math.isfinite(y):
            found[-1].append((x, y))
        elif found[-1]:
            found.append([])
    return [run for run in found if run]


def line(points: Sequence[tuple[float, float]]) -> set[tuple[int, int]]:
    """The pixels of a line through points."""
    found = {(round(x), round(y)) for x, y in points}
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        steps = max(abs(round(x1) - round(x0)), abs(round(y1) - round(y0)), 1)
        found |= {(round(x0 + (x1 - x0) * i / steps), round(y0 + (y1 - y0) * i / steps)) for i in range(steps + 1)}
    return found


def png(pixels: Sequence[Sequence[Color]]) -> bytes:
    """Pixels as a PNG file."""
    width, height = len(pixels[0]), len(pixels)
    raw = b"".join(b"\x00" + bytes(channel for pixel in row for channel in pixel) for row in pixels)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b"")
