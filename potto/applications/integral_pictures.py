"""An integral as SVG: the domain and its cells, surfaces, arrows for what the boundary gains, and the numbers.

Owns `integral_svg`. Every surface is a group with its number as `data-surface`, so that a page can tell which one was
clicked. Arrows point to where a place moves; they are as long as what it gains is great, blue where the integral gains
and red where it loses.
"""

from __future__ import annotations

import base64
import html
import math

import numpy as np

from potto.applications.integral_views import Arrow, IntegralNumbers, IntegralView
from potto.applications.png import encode
from potto.runtime.answers.printing import format_digits, format_number

WIDE, TALL, LEFT, TOP, LINE = 420.0, 300.0, 64.0, 40.0, 20.0
GAIN, LOSS, SURFACE, INK = "#1f77b4", "#d62728", "#2ca02c", "#333"
LONGEST = 70.0  # of an arrow
CELLS = ((222, 233, 247), (253, 236, 214), (226, 243, 224), (244, 226, 241), (250, 246, 205), (228, 228, 228))
OUTSIDE = (255, 255, 255)


class _Frame:
    """Where places of the domain are on the picture."""

    def __init__(self, view: IntegralView) -> None:
        self.x0, self.x1 = view.box[0]
        flat = len(view.box) == 1
        values = np.asarray(view.integrand, dtype=float)
        known = values[np.isfinite(values)]
        low, high = (float(min(known.min(), 0)), float(max(known.max(), 0))) if known.size else (0.0, 1.0)
        room = (high - low or 1.0) * 0.15
        self.y0, self.y1 = (low - room * (low < 0), high + room) if flat else view.box[1]
        across, up = (self.x1 - self.x0) or 1.0, (self.y1 - self.y0) or 1.0
        square = not flat and 0.25 < up / across < 4
        scale = min(WIDE / across, WIDE / up) if square else 0.0
        self.wide, self.tall = (scale * across, scale * up) if square else (WIDE, TALL)
        self.right, self.up = self.wide / across, self.tall / up

    def x(self, value: float) -> float:
        return LEFT + (value - self.x0) * self.right

    def y(self, value: float) -> float:
        return TOP + (self.y1 - value) * self.up


def integral_svg(view: IntegralView, numbers: IntegralNumbers | None, title: str, wrt: str) -> str:
    """The picture; without numbers it shows the geometry alone."""
    frame = _Frame(view)
    flat = len(view.box) == 1
    parts = [_text(LEFT, 22, title, "start", 'font-weight="bold"'), *(_curve if flat else _cells)(view, frame)]
    largest = max((abs(a.weight) for a in _arrows(view)), default=0.0)
    for number, surface in enumerate(view.surfaces):
        parts.append(f'<g class="surface" data-surface="{number}"><title>{html.escape(surface.equation)}</title>')
        parts += _lines(surface.lines, frame, flat)
        parts += [_arrow(arrow, frame, largest) for arrow in surface.arrows]
        parts.append("</g>")
    parts += ['<g class="bounds">', *(_arrow(arrow, frame, largest) for arrow in view.bounds), "</g>"]
    parts += _axes(view, frame)
    below = _words(view, numbers, wrt)
    start = TOP + frame.tall + 58
    parts += [
        _text(LEFT, start + LINE * n, line, "start", f'fill="{colour}"') for n, (line, colour) in enumerate(below)
    ]
    wide, tall = LEFT + max(frame.wide, WIDE) + 90, start + LINE * len(below) + 6
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.0f}" height="{tall:.0f}" '
    head += f'viewBox="0 0 {wide:.0f} {tall:.0f}" font-family="sans-serif" font-size="12">'
    return "\n".join([head, f'<rect width="{wide:.0f}" height="{tall:.0f}" fill="white"/>', *parts, "</svg>", ""])


def _arrows(view: IntegralView) -> list[Arrow]:
    return [*view.bounds, *(arrow for surface in view.surfaces for arrow in surface.arrows)]


def _curve(view: IntegralView, frame: _Frame) -> list[str]:
    """The integrand over the range, with the ground below it in the colour of its cell."""
    values, cells = view.integrand[0], view.cells[0]
    xs = np.linspace(frame.x0, frame.x1, len(values)).tolist()
    ground = frame.y(0)
    out: list[str] = []
    start = 0
    for place in range(1, len(values) + 1):
        if place < len(values) and cells[place] == cells[start]:
            continue
        points = [(frame.x(x), frame.y(v)) for x, v in zip(xs[start:place], values[start:place], strict=True)
                  if math.isfinite(v)]  # fmt: skip
        if points:
            line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
            colour = "#{:02x}{:02x}{:02x}".format(*CELLS[cells[start] % len(CELLS)])
            area = f"{points[0][0]:.1f},{ground:.1f} {line} {points[-1][0]:.1f},{ground:.1f}"
            left, right = points[0][0], frame.x(xs[min(place, len(xs) - 1)])
            out.append(f'<rect x="{left:.1f}" y="{TOP}" width="{right - left:.1f}" height="{frame.tall:.1f}" '
                       f'fill="{colour}" opacity="0.45"/>')  # fmt: skip
            out.append(f'<polygon points="{area}" fill="{colour}"/>')
            out.append(f'<polyline points="{line}" fill="none" stroke="{INK}" stroke-width="1.5"/>')
        start = place
    return out


def _cells(view: IntegralView, frame: _Frame) -> list[str]:
    """The cells in their colours, darker where the integrand is greater."""
    cells, values = np.asarray(view.cells), np.asarray(view.integrand, dtype=float)
    size = np.abs(np.where(np.isfinite(values), values, 0.0))
    share = size / (size.max() or 1.0)
    rgb = np.asarray(CELLS, dtype=float)[cells % len(CELLS)] * (1 - 0.35 * share)[:, :, None]
    rgb[cells < 0] = OUTSIDE
    data = base64.b64encode(encode(rgb[::-1].astype(np.uint8).tobytes(), *cells.shape[::-1])).decode()
    rows, columns = cells.shape  # a pixel is around its place: half of one is beyond each side
    wide, tall = frame.wide / (columns - 1), frame.tall / (rows - 1)
    return [f'<image x="{LEFT - wide / 2:.1f}" y="{TOP - tall / 2:.1f}" width="{frame.wide + wide:.1f}" '
            f'height="{frame.tall + tall:.1f}" style="image-rendering:pixelated" '
            f'preserveAspectRatio="none" href="data:image/png;base64,{data}"/>']  # fmt: skip


def _lines(lines: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...], frame: _Frame, flat: bool) -> list[str]:
    if flat:
        path = "".join(f"M{frame.x(a[0]):.1f} {TOP}V{TOP + frame.tall:.1f}" for a, _ in lines)
    else:
        path = "".join(f"M{frame.x(a):.1f} {frame.y(b):.1f}L{frame.x(c):.1f} {frame.y(d):.1f}"
                       for (a, b), (c, d) in lines)  # fmt: skip
    return [f'<path d="{path}" fill="none" stroke="{SURFACE}" stroke-width="2"/>'] if path else []


def _arrow(arrow: Arrow, frame: _Frame, largest: float) -> str:
    if not arrow.weight or not largest:
        return ""
    flat = len(arrow.at) == 1
    x, y = frame.x(arrow.at[0]), TOP + 0.35 * frame.tall if flat else frame.y(arrow.at[1])
    dx, dy = arrow.velocity[0] * frame.right, 0.0 if flat else -arrow.velocity[1] * frame.up
    long = math.hypot(dx, dy) or 1.0
    length = LONGEST * (1.0 if flat else 0.6) * abs(arrow.weight) / largest
    dx, dy = dx / long, dy / long
    tip = (x + dx * length, y + dy * length)
    wing = min(6.0, length / 2)
    left = (tip[0] - wing * dx - 0.6 * wing * dy, tip[1] - wing * dy + 0.6 * wing * dx)
    right = (tip[0] - wing * dx + 0.6 * wing * dy, tip[1] - wing * dy - 0.6 * wing * dx)
    path = f"M{x:.1f} {y:.1f}L{tip[0]:.1f} {tip[1]:.1f}M{left[0]:.1f} {left[1]:.1f}L{tip[0]:.1f} {tip[1]:.1f}"
    path += f"L{right[0]:.1f} {right[1]:.1f}"
    colour = GAIN if arrow.weight > 0 else LOSS
    return f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{2.5 if flat else 1.3}"/>'


def _axes(view: IntegralView, frame: _Frame) -> list[str]:
    out = [f'<rect x="{LEFT}" y="{TOP}" width="{frame.wide:.1f}" height="{frame.tall:.1f}" fill="none" stroke="#999"/>']
    foot = TOP + frame.tall
    names = (view.variables[0], view.variables[1] if len(view.box) == 2 else "integrand")
    for share in (0.0, 0.5, 1.0):
        across, up = (a + share * (b - a) for a, b in ((frame.x0, frame.x1), (frame.y0, frame.y1)))
        out.append(_text(frame.x(across), foot + 17, format_digits(across, 4), "middle"))
        out.append(_text(LEFT - 6, frame.y(up) + 4, format_digits(up, 3), "end"))
    out.append(_text(LEFT + frame.wide / 2, foot + 34, names[0], "middle", 'font-style="italic"'))
    out.append(_text(LEFT - 8, TOP - 12, names[1], "end", 'font-style="italic"'))
    return out


def _words(view: IntegralView, numbers: IntegralNumbers | None, wrt: str) -> list[tuple[str, str]]:
    """What stands below the picture, with its colour."""
    found: list[tuple[str, str]] = []
    if numbers is not None:
        n = numbers

        def told(value: float, error: float) -> str:
            return f"{format_number(value, error)} ± {format_digits(error, 2)}"

        found.append((f"value {told(n.value, n.error)}", INK))
        found.append((f"derivative by {wrt} {told(n.tangent, n.tangent_error)}", INK))
        found.append((f"   interior {told(n.interior, n.interior_error)}", INK))
        found.append((f"   boundary {told(n.boundary, n.boundary_error)}", INK))
        found.append(
            (f"central difference, {wrt} ± {format_digits(n.step, 2)}: {format_digits(n.difference, 8)}", "#888")
        )
        if not n.converged:
            found.append(("not as accurate as was asked", LOSS))
    for surface in view.surfaces:
        found.append((surface.equation if surface.lines else f"{surface.equation}: not in the domain", SURFACE))
    found += [(f"section at {name} = {format_digits(value, 4)}", "#888") for name, value in view.held]
    return [*found, ("the domain goes on beyond what is drawn", "#888")] if view.cut else found


def _text(x: float, y: float, text: str, anchor: str, style: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {style}>{html.escape(text)}</text>' if text else ""
