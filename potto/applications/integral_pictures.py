"""An integral as SVG: the domain and its cells, surfaces, arrows for what the boundary gains, and the numbers.

Owns `integral_svg`, `words`, `told` and `typeset`. Every surface is a group with its number as `data-surface` and the
equation of its condition as `data-equation`, so that a page can tell which one was clicked. Arrows point to where a
place moves; they are as long as what it gains is great, blue where the integral gains and red where it loses. Colours
are those of classes, which a page may set; a picture that stands alone brings its own.
"""

from __future__ import annotations

import base64
import html
import math
import zlib
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from potto.applications.integral_numbers import IntegralNumbers
from potto.applications.integral_views import Arrow, IntegralView, Line, Point, SurfaceView
from potto.applications.pictures import ticks
from potto.applications.png import encode
from potto.checking.facts import show_equation
from potto.kernels.cells import Array
from potto.runtime.answers.printing import format_digits, format_number
from potto.syntax.typesetting import unicode

WIDE, TALL, LEFT, TOP, LINE = 420.0, 300.0, 64.0, 52.0, 20.0
STYLE = (
    "<style>.gain{stroke:#1f77b4}.loss{stroke:#d62728}.edge{stroke:#2ca02c}.curve{stroke:#333}.frame{stroke:#999}"
    ".ghost{stroke:#888}.node{fill:#555}text{fill:#333}text.quiet{fill:#888}text.edge{fill:#2ca02c;stroke:none}"
    "text.loss{fill:#d62728;stroke:none}.zero{stroke:#bbb}</style>"
)
LONGEST = 70.0  # of an arrow
# Of each cell, from where the integrand is 0 to where it is largest.
CELLS = ((222, 233, 247), (253, 236, 214), (226, 243, 224), (244, 226, 241), (250, 246, 205), (228, 228, 228))
FULL = ((150, 189, 232), (247, 192, 120), (158, 213, 150), (212, 160, 206), (233, 220, 116), (172, 172, 172))
DARK = ((44, 62, 88), (84, 62, 38), (44, 74, 50), (76, 50, 76), (80, 76, 40), (66, 66, 66))
DARK_FULL = ((72, 112, 168), (168, 116, 58), (74, 138, 84), (140, 86, 140), (148, 140, 62), (120, 120, 120))
WAITING = "…"
UP, ACROSS = 5, 6  # ticks of the axes, at most
BESIDE = 84  # room at the right for an arrow of the last bound

typeset = lru_cache(maxsize=256)(show_equation(unicode))  # of surfaces, which stay what they are while something moves

Said = tuple[str, str]  # a line, and its class


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


def integral_svg(view: IntegralView, said: Sequence[Said] = (), dark: bool = False) -> str:
    """The picture, with what is `said` above and below it; without, it is for a page that has a style of its own."""
    frame = _Frame(view)
    flat = len(view.box) == 1
    parts = _curve(view, frame, DARK if dark else CELLS) if flat else _cells(view, frame, dark)
    parts += [f'<path class="ghost" d="{_path(lines, frame, flat)}" fill="none" stroke-dasharray="4 3"/>'
              for lines in view.ghosts if lines]  # fmt: skip
    parts += _nodes(view, frame)
    largest = max((abs(a.weight) for a in _arrows(view)), default=0.0)
    for number, surface in enumerate(view.surfaces):
        name, condition = (html.escape(text, quote=True) for text in (surface.equation, surface.condition))
        parts.append(f'<g class="surface" data-surface="{number}" data-equation="{condition}"><title>{name}</title>')
        path = _path(surface.lines, frame, flat)
        parts += [f'<path class="grip" d="{path}" fill="none" stroke="transparent" stroke-width="12"/>',
                  f'<path class="edge" d="{path}" fill="none" stroke-width="2"/>'] if path else []  # fmt: skip
        parts += [_arrow(arrow, frame, largest) for arrow in surface.arrows]
        parts.append("</g>")
    parts += ['<g class="bounds">', *(_arrow(arrow, frame, largest) for arrow in view.bounds), "</g>"]
    parts += _axes(view, frame)
    title, below = said[:1], said[1:]
    start = TOP + frame.tall + 58
    parts += [_text(LEFT, 16, title[0][0], "start", 'font-weight="bold"')] if title else []
    parts += [_text(LEFT + 16 * (kind == "part"), start + LINE * n, line, "start", f'class="{kind}"')
              for n, (line, kind) in enumerate(below)]  # fmt: skip
    tall = start + LINE * len(below) + 6 if said else start - 16
    wide = LEFT + max(frame.wide, WIDE if said else 0.0) + (BESIDE if said or view.bounds else 24)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.0f}" height="{tall:.0f}" '
    head += f'viewBox="0 0 {wide:.0f} {tall:.0f}" font-family="sans-serif" font-size="12">'
    ground = [STYLE, f'<rect width="{wide:.0f}" height="{tall:.0f}" fill="white"/>'] if said else []
    return "\n".join([head, *ground, *parts, "</svg>", ""])


def words(view: IntegralView, numbers: IntegralNumbers | None, title: str, wrt: str) -> list[Said]:
    """What stands above and below a picture."""
    found: list[Said] = [(title, "")]
    for name, text in told(numbers, wrt):
        kind = "part" if name in ("interior", "boundary") else "quiet" if "difference" in name else ""
        found.append((f"{name} = {text}", kind))
    if numbers is not None and not numbers.converged:
        found.append(("not as accurate as was asked", "loss"))
    found += [(f"{typeset(surface.equation)}{comment(surface)}", "edge") for surface in view.surfaces]
    return [*found, *((text, "quiet") for text in remarks(view))]


def comment(surface: SurfaceView) -> str:
    """What is to be said of a surface that moves nothing, as the end of a sentence."""
    if not surface.lines:
        return " is not in the domain"
    still = surface.arrows and not any(arrow.weight for arrow in surface.arrows)
    return ": nothing is gained there" if still else ""


def told(numbers: IntegralNumbers | None, wrt: str) -> list[tuple[str, str]]:
    """The numbers with their names and errors; `…` for one that is not there yet."""

    def with_error(value: float, error: float) -> str:
        return f"{format_number(value, error)} ± {format_digits(error, 2)}"

    names = ("value", f"derivative by {wrt}", "interior", "boundary")
    if numbers is None:
        return [(name, WAITING) for name in (*names, f"central difference, {wrt}")]
    n = numbers
    pairs = ((n.value, n.error), (n.tangent, n.tangent_error), (n.interior, n.interior_error),
             (n.boundary, n.boundary_error))  # fmt: skip
    found = [(name, with_error(*pair)) for name, pair in zip(names, pairs, strict=True)]
    difference = WAITING if n.difference is None else format_digits(n.difference, 8)
    return [*found, (f"central difference, {wrt} ± {format_digits(n.step, 2)}", difference)]


def remarks(view: IntegralView) -> list[str]:
    """What the picture leaves out."""
    found = [f"section at {held.name} = {format_digits(held.at, 4)}" for held in view.held]
    found += ["the domain goes on beyond what is drawn"] if view.cut else []
    return [*found, "surfaces of a sum's conditions are not drawn"] if view.unseen else found


def _arrows(view: IntegralView) -> list[Arrow]:
    return [*view.bounds, *(arrow for surface in view.surfaces for arrow in surface.arrows)]


def _curve(view: IntegralView, frame: _Frame, colours: Sequence[tuple[int, int, int]]) -> list[str]:
    """The integrand over the range, with the ground below it in the colour of its cell."""
    values, cells = view.integrand[0], view.cells[0]
    xs = np.linspace(frame.x0, frame.x1, len(values)).tolist()
    ground, right = frame.y(0), LEFT + frame.wide
    out, start = list[str](), 0
    for place in range(1, len(values) + 1):
        if place < len(values) and cells[place] == cells[start]:
            continue
        points = [(frame.x(x), frame.y(v)) for x, v in zip(xs[start:place], values[start:place], strict=True)
                  if math.isfinite(v)]  # fmt: skip
        if points:
            line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
            colour = "#{:02x}{:02x}{:02x}".format(*colours[cells[start] % len(colours)])
            area = f"{points[0][0]:.1f},{ground:.1f} {line} {points[-1][0]:.1f},{ground:.1f}"
            left, end = points[0][0], frame.x(xs[min(place, len(xs) - 1)])
            out.append(f'<rect x="{left:.1f}" y="{TOP}" width="{end - left:.1f}" height="{frame.tall:.1f}" '
                       f'fill="{colour}" opacity="0.45"/>')  # fmt: skip
            out.append(f'<polygon points="{area}" fill="{colour}"/>')
            out.append(f'<polyline class="curve" points="{line}" fill="none" stroke-width="1.5"/>')
        start = place
    return [*out, f'<path class="zero" d="M{LEFT} {ground:.1f}H{right:.1f}" fill="none"/>']


def _cells(view: IntegralView, frame: _Frame, dark: bool) -> list[str]:
    """The cells in their colours, stronger where the integrand is greater; nothing outside of the domain."""
    cells, values = np.asarray(view.cells), np.asarray(view.integrand, dtype=float)
    size = np.abs(np.where(np.isfinite(values), values, 0.0))
    least, most = (np.asarray(colours, dtype=float)[cells % len(colours)]
                   for colours in ((DARK, DARK_FULL) if dark else (CELLS, FULL)))  # fmt: skip
    rgb = least + (most - least) * (size / (size.max() or 1.0))[:, :, None]
    rgba = np.concatenate([rgb, np.where(cells < 0, 0.0, 255.0)[:, :, None]], axis=2)
    if view.outline:
        rgba = _beyond(rgba)
    rows, columns = cells.shape
    data = base64.b64encode(encode(rgba[::-1].astype(np.uint8).tobytes(), columns, rows, quick=True)).decode()
    # A pixel is around its place: half of one is beyond each side, and cut off, as is what is not of the domain.
    wide, tall = frame.wide / (columns - 1), frame.tall / (rows - 1)
    (x0, x1), (y0, y1) = view.box
    outline = "".join(
        "M" + "L".join(f"{frame.x(x):.1f} {frame.y(y):.1f}" for x, y in piece) + "Z"
        for piece in view.outline or (((x0, y0), (x1, y0), (x1, y1), (x0, y1)),)
    )
    name = f"domain-{zlib.crc32(outline.encode()):08x}"  # of several pictures on a page each has its own
    edge = [f'<path class="frame" d="{outline}" fill="none"/>'] if view.outline else []
    return [f'<clipPath id="{name}"><path d="{outline}"/></clipPath><g clip-path="url(#{name})">',
            f'<image x="{LEFT - wide / 2:.2f}" y="{TOP - tall / 2:.2f}" width="{frame.wide + wide:.2f}" '
            f'height="{frame.tall + tall:.2f}" image-rendering="pixelated" preserveAspectRatio="none" '
            f'href="data:image/png;base64,{data}"/></g>', *edge]  # fmt: skip


def _beyond(rgba: Array) -> Array:
    """Places beside the domain in the colour of a neighbour within: its edge goes through their pixels."""
    for axis, way in ((0, 1), (0, -1), (1, 1), (1, -1)):
        beside = np.roll(rgba, way, axis)
        rgba = np.where((rgba[:, :, 3:] == 0) & (beside[:, :, 3:] > 0), beside, rgba)
    return rgba


def _path(lines: Sequence[Line], frame: _Frame, flat: bool) -> str:
    if flat:
        return "".join(f"M{frame.x(a[0]):.1f} {TOP}V{TOP + frame.tall:.1f}" for a, _ in lines)
    chains = ("L".join(f"{frame.x(x):.1f} {frame.y(y):.1f}" for x, y in chain) for chain in _chains(lines))
    return "".join(f"M{chain}" for chain in chains)


def _chains(lines: Sequence[Line]) -> list[list[Point]]:
    """Lines that meet at their ends, as curves: dashes go on from one to the next."""
    beside: dict[Point, list[int]] = {}
    for number, line in enumerate(lines):
        for end in line:
            beside.setdefault(end, []).append(number)
    left = dict.fromkeys(range(len(lines)))
    starts = [numbers[0] for numbers in beside.values() if len(numbers) == 1]  # of closed curves any line is one
    found: list[list[Point]] = []
    for first in (*starts, *range(len(lines))):
        if first not in left:
            continue
        a, b = lines[first]
        chain = [b, a] if len(beside[b]) == 1 else [a, b]
        del left[first]
        while (after := next((n for n in beside[chain[-1]] if n in left), None)) is not None:
            a, b = lines[after]
            chain.append(b if a == chain[-1] else a)
            del left[after]
        found.append(chain)
    return found


def _nodes(view: IntegralView, frame: _Frame) -> list[str]:
    """A dot for each place where the integrand was evaluated; of one variable, on the ground."""
    if not view.nodes:
        return []
    places = [(frame.x(p[0]), frame.y(p[1]) if len(p) > 1 else frame.y(0)) for p in view.nodes]
    return ['<g class="nodes">', *(f'<circle class="node" cx="{x:.1f}" cy="{y:.1f}" r="1.6"/>' for x, y in places),
            "</g>"]  # fmt: skip


def _arrow(arrow: Arrow, frame: _Frame, largest: float) -> str:
    if not arrow.weight or not largest:
        return ""
    flat = len(arrow.at) == 1
    x, y = frame.x(arrow.at[0]), TOP + 0.35 * frame.tall if flat else frame.y(arrow.at[1])
    dx, dy = arrow.velocity[0] * frame.right, 0.0 if flat else -arrow.velocity[1] * frame.up
    long = math.hypot(dx, dy) or 1.0
    length = LONGEST * (1.0 if flat else 0.5) * abs(arrow.weight) / largest
    dx, dy = dx / long, dy / long
    tip = (x + dx * length, y + dy * length)
    wing = min(6.0, length / 2)
    left = (tip[0] - wing * dx - 0.6 * wing * dy, tip[1] - wing * dy + 0.6 * wing * dx)
    right = (tip[0] - wing * dx + 0.6 * wing * dy, tip[1] - wing * dy - 0.6 * wing * dx)
    path = f"M{x:.1f} {y:.1f}L{tip[0]:.1f} {tip[1]:.1f}M{left[0]:.1f} {left[1]:.1f}L{tip[0]:.1f} {tip[1]:.1f}"
    path += f"L{right[0]:.1f} {right[1]:.1f}"
    kind = "gain" if arrow.weight > 0 else "loss"
    return f'<path class="{kind}" d="{path}" fill="none" stroke-width="{2.5 if flat else 1.3}"/>'


def _axes(view: IntegralView, frame: _Frame) -> list[str]:
    out = [f'<rect class="frame" x="{LEFT}" y="{TOP}" width="{frame.wide:.1f}" height="{frame.tall:.1f}" fill="none"/>']
    foot = TOP + frame.tall
    names = (view.variables[0], view.variables[1] if len(view.box) == 2 else "integrand")
    for at in ticks(frame.x0, frame.x1, ACROSS) if frame.x0 < frame.x1 else ():
        x = frame.x(at)
        out.append(f'<path class="frame" d="M{x:.1f} {foot:.1f}v4" fill="none"/>')
        out.append(_text(x, foot + 17, format_digits(at, 12), "middle"))
    for at in ticks(frame.y0, frame.y1, UP) if frame.y0 < frame.y1 else ():
        y = frame.y(at)
        out.append(f'<path class="frame" d="M{LEFT} {y:.1f}h-4" fill="none"/>')
        out.append(_text(LEFT - 8, y + 4, format_digits(at, 12), "end"))
    out.append(_text(LEFT + frame.wide / 2, foot + 34, names[0], "middle", 'font-style="italic"'))
    out.append(_text(LEFT - 24, TOP - 9, names[1], "start", 'font-style="italic"'))
    return out


def _text(x: float, y: float, text: str, anchor: str, style: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {style}>{html.escape(text)}</text>' if text else ""
