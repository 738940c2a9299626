"""The text of an open document, its lines, and positions in it as editors count them.

Owns `DocumentText`, which is immutable: an edit gives a new one, so whoever holds a text keeps it whole. Lines end at
LF, CRLF or a lone CR and at nothing else. Offsets count code points; columns count units of the negotiated encoding. A
position past the end of its line means the end of that line, one past the last line the end of the text, and one inside
of a code point its start.
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
BLOCK = 256  # lines
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


class LineStarts(Struct, frozen=True):
    """Where the lines of a text start, in blocks: an edit makes one or two new blocks and moves the others.

    offsets: where each block starts; numbers: the number of its first line; blocks: the starts of its lines, relative
    to it.
    """

    offsets: list[int]
    numbers: list[int]
    blocks: list[list[int]]
    count: int

    def start(self, number: int) -> int:
        """Where a line starts."""
        block = bisect_right(self.numbers, number) - 1
        return self.offsets[block] + self.blocks[block][number - self.numbers[block]]

    def line_of(self, offset: int) -> int:
        """The line that an offset is in."""
        block = bisect_right(self.offsets, offset) - 1
        return self.numbers[block] + bisect_right(self.blocks[block], offset - self.offsets[block]) - 1

    def replaced(self, text: str, start: int, end: int, shift: int) -> LineStarts:
        """The lines of `text`, which differs from the text before between two offsets; everything after has moved by
        `shift`."""
        # A CR or LF at the border may join or leave the line end before it: begin one line above.
        first = bisect_right(self.numbers, max(self.line_of(start) - 1, 0)) - 1
        last = bisect_right(self.offsets, end)
        stop = self.offsets[last] + shift if last < len(self.offsets) else len(text)
        begin = self.offsets[first]
        found = line_starts(text[begin:stop])
        if last < len(self.offsets):
            found.pop()  # the end of what was looked at, where the next block starts
        blocks = [found[at : at + BLOCK] for at in range(0, len(found), BLOCK)]
        fresh = [[at - block[0] for at in block] for block in blocks]
        offsets = [*self.offsets[:first], *(begin + block[0] for block in blocks)]
        offsets += [offset + shift for offset in self.offsets[last:]]
        all_blocks = [*self.blocks[:first], *fresh, *self.blocks[last:]]
        *numbers, count = accumulate(map(len, all_blocks), initial=0)
        return LineStarts(offsets, numbers, all_blocks, count)


def lines_of(text: str) -> LineStarts:
    """The lines of a text."""
    return LineStarts([0], [0], [[0]], 1).replaced(text, 0, 0, len(text))


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


class DocumentText(Struct, frozen=True, dict=True):
    """A text with its lines."""

    text: str
    encoding: Encoding = "utf-16"

    @cached_property
    def lines(self) -> LineStarts:
        return lines_of(self.text)

    def line(self, number: int) -> str:
        """A line without its end."""
        lines = self.lines
        start = lines.start(number)
        if number + 1 >= lines.count:
            return self.text[start:]
        stop = lines.start(number + 1) - 1
        if stop > start and self.text[stop] == "\n" and self.text[stop - 1] == "\r":
            stop -= 1
        return self.text[start:stop]

    def offset(self, line: int, column: int) -> int:
        """The offset of a position."""
        if line >= self.lines.count:
            return len(self.text)
        if line < 0:
            return 0
        return self.lines.start(line) + code_points(self.line(line), max(column, 0), self.encoding)

    def position(self, offset: int) -> tuple[int, int]:
        """The line and the column of an offset; one inside of a CRLF is the end of its line."""
        offset = min(max(offset, 0), len(self.text))
        number = self.lines.line_of(offset)
        start = self.lines.start(number)
        if offset > start and self.text[offset - 1] == "\r" and self.text.startswith("\n", offset):
            offset -= 1
        wide, extra = self._wide
        return number, offset - start + extra[bisect_left(wide, offset)] - extra[bisect_left(wide, start)]

    @cached_property
    def _wide(self) -> tuple[list[int], list[int]]:
        """Where code points longer than one unit are, and the extra length of those before each. This makes converting
        a position equally fast in lines of any length."""
        if self.encoding == "utf-32" or self.text.isascii():
            return [], [0]
        pattern = _BEYOND_ASCII if self.encoding == "utf-8" else _ASTRAL
        wide = [found.start() for found in re.finditer(pattern, self.text)]
        longer = (units(self.text[at], self.encoding) - 1 for at in wide)
        return wide, list(accumulate(longer, initial=0))

    def replaced(self, start: int, end: int, inserted: str) -> DocumentText:
        """The text with something else between two offsets. Only the lines nearby are scanned again."""
        start, end = min(start, end), max(start, end)
        text = self.text[:start] + inserted + self.text[end:]
        new = DocumentText(text, self.encoding)
        new.__dict__["lines"] = self.lines.replaced(text, start, end, len(inserted) - (end - start))
        return new
