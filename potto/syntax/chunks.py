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

_STARTS = re.compile(r"^\f*([^\s])|^([^\S\n]+)[^\s]|^[^\S\n]*+\n(?:[^\S\n]*+\n)*+", re.MULTILINE)
"""A line that starts with code or a comment in its first column, an indented one, or a run of blank ones."""


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
    adjacent = False  # whether the last block of comments goes on up to this line
    if text.startswith("\ufeff"):
        text = "\n" + text[1:]
    for found in _STARTS.finditer(normalized(text)):
        kind = found.lastindex
        if kind == 1 and found.group(1) == "#":
            if not adjacent:
                comments.append(found.start())
            adjacent = True
        elif kind is None:
            adjacent = False
        elif starts and (kind == 2 or found.group(1) in ")]"):
            comments, adjacent = [], False
        else:
            if not adjacent:
                comments.append(found.start())
            starts += comments
            comments, adjacent = [], False
    return starts + comments
