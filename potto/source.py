"""Text and places in it.

Owns `Span`, `NOWHERE` and `SourceText`. Every offset is a count of code points. Spans kept in memoized values are
relative to the start of their chunk (a top-level definition), so that an edit above moves nothing below; whoever shows
them adds the chunk's start. UTF-16 exists only in `SourceText.utf16_column`.
"""

from __future__ import annotations

import bisect
from dataclasses import dataclass
from functools import cached_property

from msgspec import Struct


class Span(Struct, frozen=True):
    """A half-open range `[start, end)` of code points. Ten thousand are made for 2,000 lines, and most are compared."""

    start: int
    end: int

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Span) and self.start == other.start and self.end == other.end

    def __hash__(self) -> int:
        return hash((self.start, self.end))

    def __lt__(self, other: Span) -> bool:
        return (self.start, self.end) < (other.start, other.end)

    def shift(self, by: int) -> Span:
        return Span(self.start + by, self.end + by)

    def cover(self, other: Span) -> Span:
        return Span(min(self.start, other.start), max(self.end, other.end))

    def touches(self, other: Span) -> bool:
        """Whether they have a place in common, if only an end."""
        return self.start <= other.end and other.start <= self.end

    def __len__(self) -> int:
        return self.end - self.start


NOWHERE = Span(0, 0)


class Position(Struct, frozen=True):
    """A zero-based line and a column in code points."""

    line: int
    column: int


@dataclass(frozen=True)
class SourceText:
    """The text of one file and the places where its lines start. Lines end at LF, CRLF or a lone CR only."""

    name: str
    text: str

    @cached_property
    def line_starts(self) -> tuple[int, ...]:
        text, starts = self.text, [0]
        if "\r" not in text:
            at = text.find("\n")
            while at >= 0:
                starts.append(at + 1)
                at = text.find("\n", at + 1)
            return tuple(starts)
        for index, char in enumerate(text):
            if char == "\n" or (char == "\r" and text[index + 1 : index + 2] != "\n"):
                starts.append(index + 1)
        return tuple(starts)

    def position(self, offset: int) -> Position:
        line = bisect.bisect_right(self.line_starts, offset) - 1
        return Position(line, offset - self.line_starts[line])

    def offset(self, position: Position) -> int:
        """The offset of a position; one past the end of its line is clamped to the end of that line."""
        if position.line >= len(self.line_starts):
            return len(self.text)
        start = self.line_starts[position.line]
        return min(start + position.column, start + len(self.line(position.line)))

    def line(self, number: int) -> str:
        """Line `number` without its end."""
        starts = self.line_starts
        stop = starts[number + 1] if number + 1 < len(starts) else len(self.text)
        return self.text[starts[number] : stop].rstrip("\r\n")

    def utf16_column(self, position: Position) -> int:
        """The column in UTF-16 code units, which editors count in."""
        head = self.line(position.line)[: position.column]
        return len(head) + sum(1 for char in head if ord(char) > 0xFFFF)
