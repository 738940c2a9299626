"""Makes the pictures of the prompt from real sessions: `python docs/terminal_pictures.py [NAME…]`.

Each session is typed into `potto repl` on a terminal of its own; what stands on its screen in the end is written as
`docs/images/NAME.svg`, character by character. Times in the pictures are those of the machine that made them.
"""

from __future__ import annotations

import html
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

IMAGES = Path(__file__).parent / "images"
CELL_W, CELL_H, SIZE, EDGE = 8.4, 18, 14, 12
BACKGROUND, FOREGROUND = "#1d1f21", "#d0d0d0"
COLORS = {
    "black": "#1d1f21", "red": "#cc6666", "green": "#8abe6a", "brown": "#de935f", "blue": "#6f9fd0",
    "magenta": "#b294bb", "cyan": "#8abeb7", "white": "#c5c8c6", "brightblack": "#808080", "brightred": "#e06c6c",
    "brightgreen": "#a5d66f", "brightbrown": "#f0c674", "brightyellow": "#f0c674", "brightblue": "#81a2ea",
    "brightmagenta": "#c397d8", "brightcyan": "#70c0ba", "brightwhite": "#ffffff",
}  # fmt: skip


@dataclass(frozen=True)
class Session:
    """What is typed, entry by entry; the last may be left on its line. `tab`: the menu is open in the end."""

    entries: tuple[str, ...]
    rows: int = 40
    left: str = ""
    tab: bool = False


SESSIONS = {
    "derivative": Session((
        "def f(t) integral [0, 1] [x < t]*t^2 d(x)", "f(0.3)", "deriv(f)((0.3, 1))", ":deriv f", ":check f(0.3)",
    ), 45),
    "plot": Session((
        "def g(t) (integral [0, 1] [x < t]*t^2 d(x)) * (if t < 0.6 then 1 else 0.4)", ":plot g, deriv g 0 0.9",
    ), 24),
    "image": Session((
        "def edge(x, y, c) integral ([0, 1], [0, 1]) [(x + u/40)^2 + (y + v/40)^2 < c^2]*x d(u, v)", "c = 0.7",
        ":image edge(x, y, c) 48", ":image edge(x, y, c) by c 48",
    ), 58),
    "mistakes": Session((
        "def g(t) integral [0, 1] (if x < t then 1 else 0) d(x)", "x + 1",
    ), 24, "integral [0, 1] (if [x < 0.5] then sin(x) else cosine(x)) d(x)"),
    "completion": Session((
        "# how much light falls through\ndef shade(c) integral [0, 1] [x < c]*exp(x) d(x)\n",
    ), 18, "shade(0.2) + s", True),
}  # fmt: skip


def screen_of(session: Session, columns: int = 92) -> Any:
    """The screen when everything was typed."""
    import pexpect
    import pyte

    screen = pyte.Screen(columns, session.rows)
    stream = pyte.Stream(screen)
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "TERM": "xterm-256color", "COLORTERM": "truecolor",
                       "PROMPT_TOOLKIT_NO_CPR": "1", "POTTO_HISTORY": f"{folder}/history"}  # fmt: skip
        environment.pop("NO_COLOR", None)
        process = pexpect.spawn(sys.executable, ["-m", "potto", "repl"], cwd=folder, env=environment,
                                encoding="utf-8", dimensions=(session.rows, columns), timeout=60)  # fmt: skip

        def settle(seconds: float) -> None:
            until = time.perf_counter() + seconds
            while time.perf_counter() < until:
                try:
                    written = process.read_nonblocking(100_000, 0.05)
                    stream.feed(written.replace("\x1b[2m", "\x1b[90m"))  # pyte knows no dim letters
                    until = max(until, time.perf_counter() + 0.3)
                except pexpect.TIMEOUT:
                    pass

        settle(5.0)  # until everything is loaded that gives colours
        for entry in session.entries:
            for line in entry.split("\n"):
                process.send(f"{line}\r")
                settle(0.2)
            settle(1.5)
        if session.left:
            process.send(session.left + ("\t" if session.tab else ""))
            settle(1.5)
        process.close(force=True)
    return screen


def svg(screen: Any) -> str:
    """The screen as an SVG, without the empty rows below."""
    rows = [[screen.buffer[y][x] for x in range(screen.columns)] for y in range(screen.lines)]
    while rows and all(cell.data in ("", " ") and cell.bg == "default" for cell in rows[-1]):
        rows.pop()
    width, height = screen.columns * CELL_W + 2 * EDGE, len(rows) * CELL_H + 2 * EDGE
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" '
        f'font-family="ui-monospace, SFMono-Regular, Menlo, DejaVu Sans Mono, monospace" font-size="{SIZE}">',
        f'<rect width="100%" height="100%" rx="8" fill="{BACKGROUND}"/>',
    ]
    for y, row in enumerate(rows):
        for x, text, style in runs(row):
            out += drawn(x, y, text, style)
    return "\n".join([*out, "</svg>", ""])


def runs(row: list[Any]) -> Iterator[tuple[int, str, tuple[Any, ...]]]:
    """Neighbouring characters of one style."""
    start = 0
    while start < len(row):
        style, stop = style_of(row[start]), start
        while stop < len(row) and style_of(row[stop]) == style:
            stop += 1
        yield start, "".join(cell.data or " " for cell in row[start:stop]), style
        start = stop


def style_of(cell: Any) -> tuple[Any, ...]:
    fg, bg = color(cell.fg, FOREGROUND), color(cell.bg, "")
    if cell.reverse:
        fg, bg = bg or BACKGROUND, fg
    return fg, bg, cell.bold, cell.underscore


def color(name: str, default: str) -> str:
    return default if name == "default" else COLORS.get(name, f"#{name}")


def drawn(x: int, y: int, text: str, style: tuple[Any, ...]) -> list[str]:
    """A run of characters; half blocks as rectangles, so that no font leaves gaps between them."""
    fg, bg, bold, underlined = style
    left, top, wide = EDGE + x * CELL_W, EDGE + y * CELL_H, len(text) * CELL_W
    out = []
    if bg:
        out.append(f'<rect x="{left:.1f}" y="{top}" width="{wide + 0.3:.1f}" height="{CELL_H + 0.3}" fill="{bg}"/>')
    if text.strip("▀") == "":
        return [*out, f'<rect x="{left:.1f}" y="{top}" width="{wide + 0.3:.1f}" height="{CELL_H / 2}" fill="{fg}"/>']
    if not text.strip():
        return out
    blanks = len(text) - len(text.lstrip())
    text, left = text.strip(), left + blanks * CELL_W
    marks = (' font-weight="bold"' if bold else "") + (' text-decoration="underline"' if underlined else "")
    out.append(
        f'<text x="{left:.1f}" y="{top + SIZE}" textLength="{len(text) * CELL_W:.1f}" xml:space="preserve" '
        f'fill="{fg}"{marks}>{html.escape(text)}</text>'
    )
    return out


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or SESSIONS:
        path = IMAGES / f"{name}.svg"
        path.write_text(svg(screen_of(SESSIONS[name])), encoding="utf-8")
        print(path)


if __name__ == "__main__":
    main()
