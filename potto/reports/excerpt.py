"""Lines of source with places underlined: the gutter, the carets, the labels.

Owns the layout only; `render` decides what is marked. Columns on the screen are counted in cells: a tab runs to the
next multiple of four, East Asian wide characters take two cells, combining ones none. Characters that would move the
cursor or the direction of writing are shown as something harmless. Long lines are cut around what is marked.
"""

from __future__ import annotations

import textwrap
import unicodedata
from collections.abc import Sequence

from msgspec import Struct

from potto.source import SourceText, Span

TAB = 4
LEAST = 8  # cells for a label
WIDTH = 100  # cells of source shown of one line
ALL_LINES_UP_TO = 4  # a span over more lines shows its first two and its last


class Mark(Struct, frozen=True):
    """A place to underline: with carets when primary, with dashes otherwise."""

    span: Span
    label: str
    primary: bool


class _Piece(Struct, frozen=True):
    """The part of a mark on one line, in columns of code points; the label stands at its last piece."""

    start: int
    end: int
    label: str
    primary: bool


class _Row(Struct):
    """One line on the screen: a line number (or none), text, and whether it belongs to the source."""

    number: int | None
    text: str
    style: str = "source"


class Excerpt(Struct):
    """The rows of an excerpt, before the width of the gutter is known."""

    rows: list[_Row] = []

    @property
    def gutter_width(self) -> int:
        return len(str(max((row.number for row in self.rows if row.number is not None), default=1)))

    def lines(self, width: int, gutter: str = "", mark: str = "", off: str = "") -> list[str]:
        """The excerpt as text; `gutter`, `mark` and `off` are the codes that switch colours."""
        bar = f"{gutter}|{off}"
        out = [f"{' ' * (width + 1)}{bar}"]
        for row in self.rows:
            if row.style == "gap":
                out.append(f"{gutter}...{off}")
                continue
            number = "" if row.number is None else str(row.number)
            text = f"{mark}{row.text}{off}" if row.style == "primary" else row.text
            if row.style == "secondary":
                text = f"{gutter}{row.text}{off}"
            out.append(f"{gutter}{number:>{width}}{off} {bar} {text}".rstrip())
        return out


def excerpt(source: SourceText, marks: Sequence[Mark], room: int = WIDTH) -> Excerpt:
    """The lines that the marks touch, each followed by its marks; what lies between distant ones is left out.

    room: how many cells of a line there are.
    """
    by_line: dict[int, list[_Piece]] = {}
    for mark in marks:
        for number, piece in _pieces(source, mark):
            by_line.setdefault(number, []).append(piece)
    result = Excerpt()
    previous: int | None = None
    for number in sorted(by_line):
        if previous is not None and number == previous + 2:
            result.rows.append(_Row(previous + 2, _Line(source.line(previous + 1), [], room).text))
        elif previous is not None and number > previous + 2:
            result.rows.append(_Row(None, "", "gap"))
        result.rows += _line_rows(number, source.line(number), by_line[number], room)
        previous = number
    return result


def _pieces(source: SourceText, mark: Mark) -> list[tuple[int, _Piece]]:
    """A mark line by line."""
    first, last = source.position(mark.span.start), source.position(mark.span.end)
    if last.column == 0 and last.line > first.line:  # up to the end of the line before
        last = source.position(source.line_starts[last.line] - 1)
    if first.line == last.line:
        end = max(min(last.column, len(source.line(first.line))), first.column)
        return [(first.line, _Piece(first.column, end, mark.label, mark.primary))]
    numbers = list(range(first.line, last.line + 1))
    if len(numbers) > ALL_LINES_UP_TO:
        numbers = [numbers[0], numbers[1], numbers[-1]]
    pieces = []
    for number in numbers:
        line = source.line(number)
        start = first.column if number == first.line else len(line) - len(line.lstrip())
        end = last.column if number == last.line else len(line.rstrip())
        if end > start or number == last.line:
            label = mark.label if number == last.line else ""
            pieces.append((number, _Piece(start, max(start, end), label, mark.primary)))
    return pieces


def _line_rows(number: int, line: str, pieces: list[_Piece], room: int) -> list[_Row]:
    shown = _Line(line, pieces, room)
    rows = [_Row(number + 1, shown.text)]
    placed = sorted(((*shown.cells(piece), piece) for piece in pieces), key=lambda item: (item[0], item[1]))
    canvas = [" "] * max(end for _, end, _ in placed)
    for start, end, piece in sorted(placed, key=lambda item: item[2].primary):  # carets over dashes
        canvas[start:end] = ("^" if piece.primary else "-") * (end - start)
    style = "primary" if any(piece.primary for piece in pieces) else "secondary"
    labelled = [(start, piece) for start, _, piece in placed if piece.label]
    inline: _Piece | None = max(placed, key=lambda item: (item[1], item[0]))[2]
    tail = f" {_label(inline.label)}" if inline is not None and inline.label else ""
    if room < WIDTH and len(canvas) + len(tail) > room:
        inline, tail = None, ""
    rows.append(_Row(None, "".join(canvas) + tail, style))
    hanging = [(start, piece) for start, piece in labelled if piece is not inline]
    while hanging:  # the rightmost hangs highest; a bar leads from each mark to its label further down
        start, piece = hanging.pop()
        bars = [" "] * start
        for left, _ in hanging:
            if left < start:
                bars[left] = "|"
        label = _label(piece.label)
        if room < WIDTH:
            bars = bars[: max(room - len(label), 0)]
        beside = max(room - len(bars), LEAST)
        for part in textwrap.wrap(label, beside) if room < WIDTH and len(label) > beside else [label]:
            rows.append(_Row(None, "".join(bars) + part, style))
    return rows


def _label(text: str) -> str:
    return printable(text).replace("\n", " ")


class _Line:
    """One line as it is shown, and where its columns come to stand. Cut around the marks when it is too long."""

    def __init__(self, line: str, pieces: Sequence[_Piece], room: int) -> None:
        self.first, stop = _window(line, pieces, room)
        self.left = "..." if self.first > 0 else ""
        self.starts: list[int] = []
        shown = [self.left]
        at = len(self.left)
        for char in line[self.first : stop]:
            self.starts.append(at)
            text = " " * (TAB - at % TAB) if char == "\t" else _shown(char)
            shown.append(text)
            at += len(text) if char == "\t" else width(text)
        self.starts.append(at)
        self.text = "".join(shown) + ("..." if stop < len(line) else "")

    def cells(self, piece: _Piece) -> tuple[int, int]:
        """The cells that a piece covers: at least one, also past the end of the line."""
        last = len(self.starts) - 1
        start = self.starts[min(max(piece.start - self.first, 0), last)]
        end = self.starts[min(max(piece.end - self.first, 0), last)]
        return start, max(end, start + 1)


def _window(line: str, pieces: Sequence[_Piece], room: int) -> tuple[int, int]:
    """The columns of a line to show: all of a short one, else those around the primary mark (or the first)."""
    if len(line) <= room:
        return 0, len(line)
    room -= 0 if room == WIDTH else 6  # for the dots on both sides
    main = next((p for p in pieces if p.primary), pieces[0] if pieces else _Piece(0, 0, "", True))
    last = max([p.end for p in pieces if p.end - main.start < room * 3 // 4] or [main.end])
    if last <= room - 10:
        return 0, room
    spare = max(room - (last - main.start), room // 4)
    start = max(0, min(main.start - spare // 2, len(line) - room))
    return start, min(len(line), start + room)


def width(text: str) -> int:
    """The cells that a text takes on a screen."""
    if text.isascii():
        return len(text)
    return sum(_cells(char) for char in text)


def _cells(char: str) -> int:
    if unicodedata.combining(char) or unicodedata.category(char) in ("Mn", "Me", "Cf"):
        return 0
    return 2 if unicodedata.east_asian_width(char) in "WF" else 1


def printable(text: str, keep_newlines: bool = False) -> str:
    """The text with nothing in it that a terminal would obey."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(char if char == "\n" and keep_newlines else _shown(char) for char in text)


def _shown(char: str) -> str:
    code = ord(char)
    if code < 0x20:
        return chr(0x2400 + code)
    if code == 0x7F:
        return "\u2421"
    if 0x80 <= code < 0xA0 or 0xD800 <= code < 0xE000:
        return "\ufffd"
    if 0x202A <= code <= 0x202E or 0x2066 <= code <= 0x2069 or code in (0x200E, 0x200F, 0x2028, 0x2029, 0xFEFF):
        return "\ufffd"
    return char
