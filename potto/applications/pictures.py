"""Plots as data: curves over axes, and their files.

Owns `Plot`. How a terminal shows it is in `drawing`; images are in `framed`.
"""

from __future__ import annotations

import html
import itertools
import math
from collections.abc import Sequence

from msgspec import Struct

from potto.applications.png import Color, png
from potto.runtime.answers.printing import format_digits

COLORS: tuple[Color, ...] = ((31, 119, 180), (214, 39, 40), (44, 160, 44), (148, 103, 189), (255, 127, 14))
WHITE: Color = (255, 255, 255)
FAR = 100.0  # times the least: a course that is drawn by its logarithm
MOST_TICKS = 6  # of an axis
ROUNDING = 1e-16  # of the largest value of a course: what lies below says nothing


class Curve(Struct, frozen=True):
    """Values and their errors over places in order, nan where there is none.

    breaks: numbers of the points after which the curve jumps. height: the range that is shown; poles go beyond it.
    slope: whether it is a derivative, which figures show beside the values.
    """

    xs: tuple[float, ...]
    ys: tuple[float, ...]
    errors: tuple[float, ...] = ()
    breaks: tuple[int, ...] = ()
    height: tuple[float, float] | None = None
    slope: bool = False

    @classmethod
    def even(cls, values: Sequence[float], lo: float, hi: float) -> Curve:
        """Values at equal distances."""
        last = max(len(values) - 1, 1)
        return cls(tuple(lo + (hi - lo) * i / last for i in range(len(values))), tuple(values))

    @property
    def jumps(self) -> list[tuple[float, float, float]]:
        """Where the curve jumps, and the values before and after."""
        return [((self.xs[i] + self.xs[i + 1]) / 2, self.ys[i], self.ys[i + 1]) for i in self.breaks]

    @property
    def error(self) -> float:
        """The largest error."""
        return max((e for e in self.errors if math.isfinite(e)), default=0.0)

    def pieces(self) -> list[range]:
        """The points between holes and jumps."""
        found: list[range] = []
        start: int | None = None
        for i, y in enumerate(self.ys):
            if not math.isfinite(y):
                found += [range(start, i)] if start is not None else []
                start = None
                continue
            start = i if start is None else start
            if i in self.breaks:
                found.append(range(start, i + 1))
                start = None
        return [*found, range(start, len(self.ys))] if start is not None else found


class Plot(Struct, frozen=True):
    """Curves over one stretch. caption: how far they may be off, and what they cost. marks: a mark at every point."""

    labels: tuple[str, ...]
    curves: tuple[Curve, ...]
    lo: float
    hi: float
    axis: str = "x"
    caption: str = ""
    marks: bool = False

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest value that is to be seen, a little apart."""
        heights = [c.height for c in self.curves if c.height is not None]
        finite = [y for c in self.curves if c.height is None for y in c.ys if math.isfinite(y)]
        finite += [y for height in heights for y in height]
        if not finite:
            return 0.0, 1.0
        low, high = min(finite), max(finite)
        if high - low <= 1e-12 * max(abs(low), abs(high)):
            pad = max(abs(high), 1.0) * 0.5
            return low - pad, high + pad
        return low, high

    def runs(self, curve: Curve, shift: float = 0.0) -> list[list[tuple[float, float]]]:
        """The pieces of a curve in the unit square, from below; `shift` errors higher."""
        low, high = self.span
        found: list[list[tuple[float, float]]] = []
        for piece in curve.pieces():
            ys = [curve.ys[i] + (shift * _finite(curve.errors[i]) if shift else 0.0) for i in piece]
            run = [(self.share(curve.xs[i]), (y - low) / (high - low)) for i, y in zip(piece, ys, strict=True)]
            found += clipped(run)
        return found

    def share(self, x: float) -> float:
        """How far along the axis a place is."""
        return (x - self.lo) / (self.hi - self.lo)

    def svg(self, width: int = 640, height: int = 400) -> str:
        left, top, right, bottom = 70, 24, 20, 44
        inner_w, inner_h = width - left - right, height - top - bottom
        frame = (left, top, inner_w, inner_h)
        low, high = self.span
        out = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" '
            f'font-size="12">',
            f'<rect width="{width}" height="{height}" fill="white"/>',
            f'<rect x="{left}" y="{top}" width="{inner_w}" height="{inner_h}" fill="none" stroke="#999"/>',
        ]
        for at in ticks(low, high):
            y = top + (high - at) / (high - low) * inner_h
            out.append(f'<path d="M{left} {y:.1f}h{inner_w}" stroke="#ddd"/>')
            out.append(f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{self.label(at)}</text>')
        for label in ticks(self.lo, self.hi):
            x = left + self.share(label) * inner_w
            out.append(f'<path d="M{x:.1f} {top}v{inner_h}" stroke="#ddd"/>')
            out.append(f'<text x="{x:.1f}" y="{height - 26}" text-anchor="middle">{format_digits(label, 4)}</text>')
        out.append(f'<text x="{left + inner_w / 2}" y="{height - 6}" text-anchor="middle" font-style="italic">'
                   f"{html.escape(self.axis)}</text>")  # fmt: skip
        if self.caption:
            out.append(f'<text x="{left}" y="{top - 6}" font-size="11" fill="#555">{html.escape(self.caption)}</text>')
        for number, curve in enumerate(self.curves):
            color = "rgb({},{},{})".format(*COLORS[number % len(COLORS)])
            for band in self._bands(curve):
                out.append(f'<polygon points="{_points(band, frame)}" fill="{color}" fill-opacity="0.2"/>')
            for x, y0, y1 in self._steps(curve):
                points = _points([(x, y0), (x, y1)], frame)
                out.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-dasharray="2 3"/>')
            for run in self.runs(curve):
                points = _points(run, frame)
                out.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.5"/>')
            name = html.escape(self.labels[number]) if number < len(self.labels) else ""
            out.append(f'<text x="{left + 8}" y="{top + 16 + 15 * number}" fill="{color}">{name}</text>')
        return "\n".join([*out, "</svg>", ""])

    def label(self, value: float) -> str:
        """A height in few digits; what is nothing beside the others is 0."""
        low, high = self.span
        return format_digits(0.0 if abs(value) < 1e-4 * (high - low) else value, 4)

    def _bands(self, curve: Curve) -> list[list[tuple[float, float]]]:
        """Between which heights the curve may lie, where that can be seen."""
        low, high = self.span
        if not curve.error > (high - low) / 1000:
            return []
        found = []
        for piece in curve.pieces():
            xs, ys, off = ([row[i] for i in piece] for row in (curve.xs, curve.ys, curve.errors))
            above, below = ([(self.share(x), min(max((y + sign * _finite(e) - low) / (high - low), 0.0), 1.0))
                             for x, y, e in zip(xs, ys, off, strict=True)] for sign in (1, -1))  # fmt: skip
            found.append(above + below[::-1])
        return found

    def _steps(self, curve: Curve) -> list[tuple[float, float, float]]:
        """Jumps as places and heights in the unit square; of poles none."""
        low, high = self.span
        seen = ((self.share(x), (a - low) / (high - low), (b - low) / (high - low)) for x, a, b in curve.jumps)
        return [step for step in seen if min(step[1:]) >= 0 and max(step[1:]) <= 1]

    def png(self, width: int = 640, height: int = 400) -> bytes:
        pixels = [[WHITE] * width for _ in range(height)]
        for x in range(width):
            pixels[0][x] = pixels[-1][x] = (200, 200, 200)
        for row in pixels:
            row[0] = row[-1] = (200, 200, 200)
        for number, curve in enumerate(self.curves):
            for run in self.runs(curve):
                for x, y in line([(x * (width - 1), (1 - y) * (height - 1)) for x, y in run]):
                    for dx, dy in ((0, 0), (1, 0), (0, 1)):
                        if 0 <= x + dx < width and 0 <= y + dy < height:
                            pixels[y + dy][x + dx] = COLORS[number % len(COLORS)]
        return png(pixels)


def ticks(low: float, high: float, most: int = MOST_TICKS) -> list[float]:
    """Round numbers from low to high, about `most` at the most: steps of 1, 2 or 5 times a power of ten."""
    rough = (high - low) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = power * next(m for m in (1, 2, 5, 10) if m * power >= rough * (1 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    return [n * step for n in range(first, math.floor(high / step + 1e-9) + 1)]


def course(name: str, values: Sequence[float], caption: str = "") -> Plot:
    """A value from step to step; its logarithm where it falls far."""
    least, most = min(values), max(values)
    logarithm = least > 0 and most > FAR * least
    heights = [math.log10(max(value, ROUNDING * most)) for value in values] if logarithm else list(values)
    label, last = f"log10 {name}" if logarithm else name, len(values) - 1
    return Plot((label,), (Curve.even(heights, 0, last),), 0, last, "step", caption, True)


def _finite(error: float) -> float:
    return error if math.isfinite(error) else 0.0


def _points(run: Sequence[tuple[float, float]], frame: tuple[float, float, float, float]) -> str:
    """Points of the unit square as an SVG wants them."""
    left, top, width, height = frame
    return " ".join(f"{left + x * width:.2f},{top + (1 - y) * height:.2f}" for x, y in run)


def clipped(run: Sequence[tuple[float, float]]) -> list[list[tuple[float, float]]]:
    """What is to be seen of a curve between the heights 0 and 1."""
    found: list[list[tuple[float, float]]] = [[]]
    if len(run) == 1 and 0 <= run[0][1] <= 1:
        return [list(run)]
    for (x0, y0), (x1, y1) in itertools.pairwise(run):
        ends = sorted((y - y0) / (y1 - y0) for y in (0.0, 1.0)) if y1 != y0 else [0.0, 1.0]
        start, stop = max(0.0, ends[0]), min(1.0, ends[1])
        if start > stop or (y0 == y1 and not 0 <= y0 <= 1):
            continue
        first = (x0 + (x1 - x0) * start, y0 + (y1 - y0) * start) if start else (x0, y0)
        if not found[-1] or found[-1][-1] != first:
            found.append([first])
        found[-1].append((x0 + (x1 - x0) * stop, y0 + (y1 - y0) * stop) if stop < 1 else (x1, y1))
    return [piece for piece in found if piece]


def line(points: Sequence[tuple[float, float]]) -> set[tuple[int, int]]:
    """The pixels of a line through points."""
    found = {(round(x), round(y)) for x, y in points}
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        steps = max(abs(round(x1) - round(x0)), abs(round(y1) - round(y0)), 1)
        found |= {(round(x0 + (x1 - x0) * i / steps), round(y0 + (y1 - y0) * i / steps)) for i in range(steps + 1)}
    return found
