"""Pictures in a terminal: braille for curves, half blocks for images, and real images where the terminal has them.

Owns `braille`, `half_blocks`, `shrunk`, `protocol` and `inline`. Which protocol a terminal speaks is told by its
name; it is never asked, for the answer could come late and end up in the input.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Iterator, Mapping
from typing import Literal

from msgspec.structs import replace

from potto.applications.framed import Image
from potto.applications.pictures import Curve, Plot, line
from potto.applications.png import Color
from potto.runtime.answers.printing import format_digits

Protocol = Literal["kitty", "iterm", "sixel", "blocks"]
_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
_RAMP = " .:-=+*#%@"
_MARKS = "*+ox#"
_ANSI = (34, 31, 32, 35, 33)


def room_for_curves(columns: int) -> int:
    """How wide curves are drawn on a screen this wide: beside them stand the numbers of the axis."""
    return max(6, min(columns - 14, 72))


def braille(plot: Plot, width: int = 60, height: int = 12, *, unicode: bool = True, color: bool = False) -> str:
    """Curves as text: axis on the left, each curve in its colour, a legend below."""
    low, high = plot.span
    cells = [[0] * width for _ in range(height)]
    owners = [[-1] * width for _ in range(height)]
    fine_w, fine_h = (2, 4) if unicode else (1, 1)
    for number, curve in enumerate(plot.curves):
        for x, y in _dots(plot, curve, width * fine_w, height * fine_h):
            row, column = y // fine_h, x // fine_w
            cells[row][column] |= _DOTS[y % 4][x % 2] if unicode else 1
            owners[row][column] = number
    heights = {0: high, height // 2: (low + high) / 2, height - 1: low}
    labels = {row: plot.label(at) for row, at in heights.items()}
    margin = max(map(len, labels.values()))
    bar = "│" if unicode else "|"
    lines = []
    for r in range(height):
        drawn = "".join(_cell(cells[r][c], owners[r][c], unicode, color) for c in range(width))
        lines.append(f"{labels.get(r, ''):>{margin}} {bar}{drawn}".rstrip())
    first, last = format_digits(plot.lo, 4), format_digits(plot.hi, 4)
    foot = f"{first} {last:>{max(width - len(first) - 1, 0)}}"
    corner = "└" + "─" * width if unicode else "+" + "-" * width
    lines += [" " * (margin + 1) + corner, " " * (margin + 2) + foot]
    if len(plot.labels) > 1:
        legends = (_legend(i, name, unicode, color) for i, name in enumerate(plot.labels))
        lines.append(" " * (margin + 2) + "   ".join(legends))
    return "\n".join(lines)


def _dots(plot: Plot, curve: Curve, width: int, height: int) -> Iterator[tuple[int, int]]:
    """The dots of a curve, and every third dot of the edges of its error band if that is visible."""

    def placed(run: list[tuple[float, float]]) -> set[tuple[int, int]]:
        return line([(x * (width - 1), (1 - y) * (height - 1)) for x, y in run])

    for run in plot.runs(curve):
        yield from placed(run)
    low, high = plot.span
    if curve.error * height > high - low:
        for shift in (-1.0, 1.0):
            for run in plot.runs(curve, shift):
                yield from (dot for dot in placed(run) if dot[0] % 3 == 0)


def _cell(dots: int, owner: int, unicode: bool, color: bool) -> str:
    if not dots:
        return " "
    char = chr(0x2800 + dots) if unicode else _MARKS[owner % len(_MARKS)]
    return f"\x1b[{_ANSI[owner % len(_ANSI)]}m{char}\x1b[0m" if color else char


def _legend(number: int, name: str, unicode: bool, color: bool) -> str:
    mark = "──" if unicode else _MARKS[number % len(_MARKS)]
    return f"\x1b[{_ANSI[number % len(_ANSI)]}m{mark}\x1b[0m {name}" if color else f"{mark} {name}"


def half_blocks(image: Image, *, unicode: bool = True, color: bool = True) -> str:
    """An image as text: two pixels a character in colours, else one character of more or less ink a pixel pair."""
    rows = image.pixels
    if not (unicode and color):
        ink = _ink_from_white if image.signed else _ink
        inked = ("".join(map(ink, top, bottom)).rstrip() for top, bottom in _pairs(rows))
        return "\n".join(inked)
    lines = []
    for top, bottom in _pairs(rows):
        cells = "".join(
            f"\x1b[38;2;{a[0]};{a[1]};{a[2]};48;2;{b[0]};{b[1]};{b[2]}m▀" for a, b in zip(top, bottom, strict=True)
        )
        lines.append(cells + "\x1b[0m")
    return "\n".join(lines)


def shrunk(image: Image, columns: int) -> Image:
    """The image, no wider than `columns`. If there are too many pixels, the ones in the middle of the others are
    taken."""
    width, height = image.size
    if width <= columns:
        return image
    rows = max(1, round(height * columns / width))
    across = [int((i + 0.5) * width / columns) for i in range(columns)]
    down = [int((i + 0.5) * height / rows) for i in range(rows)]
    return replace(image, pixels=tuple(tuple(image.pixels[y][x] for x in across) for y in down))


def _pairs(rows: tuple[tuple[Color, ...], ...]) -> Iterator[tuple[tuple[Color, ...], tuple[Color, ...]]]:
    for i in range(0, len(rows), 2):
        yield rows[i], rows[i + 1] if i + 1 < len(rows) else rows[i]


def _ink(a: Color, b: Color) -> str:
    light = (sum(a) + sum(b)) / (6 * 255)
    return _RAMP[min(int(light * len(_RAMP)), len(_RAMP) - 1)]


def _ink_from_white(a: Color, b: Color) -> str:
    """The more ink the further from zero, which is white."""
    least = min(*a, *b)
    return _RAMP[min(int((255 - least) / 256 * len(_RAMP)), len(_RAMP) - 1)]


# Real images


def protocol(environment: Mapping[str, str] = os.environ) -> Protocol:
    """How this terminal shows images, by its name."""
    term, program = environment.get("TERM", ""), environment.get("TERM_PROGRAM", "")
    if environment.get("TMUX") or term.startswith(("screen", "tmux")):
        return "blocks"
    if "kitty" in term or environment.get("KITTY_WINDOW_ID") or program == "ghostty" or "ghostty" in term:
        return "kitty"
    if program in ("iTerm.app", "WezTerm", "vscode") or environment.get("LC_TERMINAL") == "iTerm2":
        return "iterm"
    return "sixel" if term.startswith(("foot", "mlterm", "contour")) or "sixel" in term else "blocks"


def inline(image: Image, how: Protocol, columns: int) -> str:
    """The escape codes that show an image across the given number of columns."""
    if how == "kitty":
        data = base64.b64encode(image.png()).decode()
        pieces = [data[i : i + 4096] for i in range(0, len(data), 4096)]
        head = f"a=T,f=100,c={columns},"
        return "".join(
            f"\x1b_G{'' if i else head}m={int(i < len(pieces) - 1)};{piece}\x1b\\" for i, piece in enumerate(pieces)
        )
    if how == "iterm":
        data = base64.b64encode(image.png()).decode()
        return f"\x1b]1337;File=inline=1;width={columns};preserveAspectRatio=1:{data}\x07"
    if how == "sixel":
        return sixel(image, max(1, columns * 8 // max(image.size[0], 1)))
    return half_blocks(image)


def sixel(image: Image, scale: int = 1) -> str:
    """An image as sixels, in 216 colours."""
    wide = [[_index(pixel) for pixel in row for _ in range(scale)] for row in image.pixels for _ in range(scale)]
    used = sorted({index for row in wide for index in row})
    out = ["\x1bPq", f'"1;1;{len(wide[0])};{len(wide)}']
    out += [f"#{i};2;{i // 36 * 20};{i // 6 % 6 * 20};{i % 6 * 20}" for i in used]
    for start in range(0, len(wide), 6):
        band = wide[start : start + 6]
        for index in sorted({i for row in band for i in row}):
            bits = (sum((row[x] == index) << k for k, row in enumerate(band)) for x in range(len(wide[0])))
            out.append(f"#{index}{_packed(bits)}$")
        out.append("-")
    return "".join([*out, "\x1b\\"])


def _index(pixel: Color) -> int:
    r, g, b = (round(c / 51) for c in pixel)
    return r * 36 + g * 6 + b


def _packed(bits: Iterator[int]) -> str:
    """Sixels with repetitions counted."""
    out: list[str] = []
    last, count = -1, 0
    for bit in [*bits, -1]:
        if bit == last:
            count += 1
            continue
        if count:
            char = chr(63 + last)
            out.append(f"!{count}{char}" if count > 3 else char * count)
        last, count = bit, 1
    return "".join(out)
