"""A file cut into chunks: one for each top-level definition or statement.

Owns `Chunk` and `split`. A chunk starts at each line with code in its first column, whatever brackets are open: so that
a stray bracket can't swallow the next definition. Two things go with the chunk above or below: a line that starts with
a closing bracket, which can start nothing, belongs to the chunk above it; comment lines directly above a definition
belong to the definition. Other comments in the first column are chunks of their own, unless an indented line follows.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from potto.syntax.tokens import normalized

_LINE = re.compile(r"\n(?:#.*\n)*\f*([^\s])")
"""A line with code or a comment in its first column, and the comment lines directly above it. It begins with the end of
the line before, so that blank and indented lines are passed over as fast as memory is read."""
_INDENTED = re.compile(r"\n[^\S\n]+[^\s]")


@dataclass(frozen=True, slots=True)
class Chunk:
    """`text` from the offset `start` of the file, without the blank lines after it."""

    start: int
    text: str


def split(text: str) -> tuple[Chunk, ...]:
    """The chunks of a file, in order."""
    starts = _starts(text)
    ends = [*starts[1:], len(text)]
    return tuple(Chunk(start, text[start:end].rstrip()) for start, end in zip(starts, ends))


def _starts(text: str) -> list[int]:
    starts: list[int] = []
    comments: list[int] = []  # where the blocks of comments since the last code start
    if text.startswith("\ufeff"):
        text = "\n" + text[1:]
    text = "\n" + normalized(text)  # a line starts in `text` where in this one the line before ends
    end = 0  # of the last comment
    for found in _LINE.finditer(text):
        start, first = found.start(), found[1]
        if comments or not starts:
            comments = _passed(text, end, start, starts, comments)
        if not comments or start != end:
            comments.append(start)
        if first == "#":
            end = text.find("\n", found.end())
            end = len(text) if end < 0 else end
        elif starts and first in ")]":
            comments = []
        else:
            starts += comments
            comments = []
    return starts + _passed(text, end, len(text), starts, comments)


def _passed(text: str, end: int, start: int, starts: list[int], comments: list[int]) -> list[int]:
    """The comments that are still to be given to a chunk, behind the blank and indented lines from `end` to `start`."""
    indented = _INDENTED.search(text, end, start)
    if indented is None:
        return comments
    if not starts:  # there is no chunk yet that it could go on with
        starts += comments if comments and indented.start() == end else [*comments, indented.start()]
    return []
