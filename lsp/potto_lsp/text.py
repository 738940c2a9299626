"""The text of an open document, its lines, and positions in it as editors count them.

Owns `Text`, which is immutable: an edit gives a new one, so whoever holds a text keeps it whole. Lines end at LF, CRLF
or a lone CR and at nothing else. Offsets count code points; columns count units of the negotiated encoding. A position
past the end of its line means the end of that line, one past the last line the end of the text, and one inside of a
code point its start.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from functools import cached_property
from itertools import accumulate
from typing import Literal

from msgspec import Struct

Encoding = Literal["utf-8", "utf-16", "utf-32"]
ENCODINGS: tuple[Encoding, ...] = ("utf-8", "utf-16", "utf-32")
_LINE_END = re.compile(r"\r\n?|\n")
_BEYOND_ASCII, _ASTRAL = "[^\x00-\x7f]", "[\U00010000-\U0010ffff]"  # for `re` to compile where there are any


def line_starts(text: str) -> list[int]:
    """Where the lines of a text start."""
    if "\r" in text:
        return [0, *(found.end() for found in _LINE_END.finditer(text))]
    starts, at, find = [0], text.find("\n") + 1, text.find
    while at:
        starts.append(at)
        at = find("\n", at) + 1
    return starts


def units(text: str, encoding: Encoding) -> int:
    """How long a text is in the units of an encoding."""
    if encoding == "utf-32" or text.isascii():
        return len(text)
    if encoding == "utf-16":
        return len(text) + sum(char > "\uffff" for char in text)
    return len(text.encode("utf-8", "surrogatepass"))


def code_points(line: str, column: int, encoding: Encoding) -> int:
    """The code points of a line in front of a column."""
    if encoding == "utf-32" or line.isascii():
        return min(column, len(line))
    passed = 0
    for index, char in enumerate(line):
        passed += units(char, encoding)
        if passed > column:
            return index
    return len(line)


class Text(Struct, frozen=True, dict=True):
    """A text with its lines."""

    text: str
    encoding: Encoding = "utf-16"

    @cached_property
    def starts(self) -> list[int]:
        return line_starts(self.text)

    def line(self, number: int) -> str:
        """A line without its end."""
        starts = self.starts
        if number + 1 >= len(starts):
            return self.text[starts[number] :]
        stop = starts[number + 1] - 1
        if stop > starts[number] and self.text[stop] == "\n" and self.text[stop - 1] == "\r":
            stop -= 1
        return self.text[starts[number] : stop]

    def offset(self, line: int, column: int) -> int:
        """The offset of a position."""
        if line >= len(self.starts):
            return len(self.text)
        if line < 0:
            return 0
        return self.starts[line] + code_points(self.line(line), max(column, 0), self.encoding)

    def position(self, offset: int) -> tuple[int, int]:
        """The line and the column of an offset; one inside of a CRLF is the end of its line."""
        offset = min(max(offset, 0), len(self.text))
        number = bisect_right(self.starts, offset) - 1
        start = self.starts[number]
        if offset > start and self.text[offset - 1] == "\r" and self.text.startswith("\n", offset):
            offset -= 1
        wide, extra = self._wide
        return number, offset - start + extra[bisect_left(wide, offset)] - extra[bisect_left(wide, start)]

    @cached_property
    def _wide(self) -> tuple[list[int], list[int]]:
        """Where code points stand that are longer than one unit, and by how much those before each are in all. With
        them a position costs the same in a line of any length."""
        if self.encoding == "utf-32" or self.text.isascii():
            return [], [0]
        pattern = _BEYOND_ASCII if self.encoding == "utf-8" else _ASTRAL
        wide = [found.start() for found in re.finditer(pattern, self.text)]
        longer = (units(self.text[at], self.encoding) - 1 for at in wide)
        return wide, list(accumulate(longer, initial=0))

    def replaced(self, start: int, end: int, inserted: str) -> Text:
        """The text with another one between two offsets; only the lines nearby are looked at again."""
        start, end = min(start, end), max(start, end)
        old, starts = self.text, self.starts
        text = old[:start] + inserted + old[end:]
        # A CR or LF at the border may join or leave the line end before it: begin one line above, end with the line.
        first = max(bisect_right(starts, start) - 2, 0)
        after = bisect_right(starts, end)
        region_end = (starts[after] if after < len(starts) else len(old)) + len(inserted) - (end - start)
        found = [match.end() for match in _LINE_END.finditer(text, starts[first], region_end)]
        if after < len(starts) and found:
            found.pop()  # the end of the region, which is where line `after` starts
        shift = len(inserted) - (end - start)
        tail = [at + shift for at in starts[after:]] if shift else starts[after:]
        new = Text(text, self.encoding)
        new.__dict__["starts"] = [*starts[: first + 1], *found, *tail]
        return new
