"""Answers about whole files, put together from what is kept for each of their pieces as it is sent.

Owns `Part`, `part_of`, `whole` and `Pieces`. After a key all parts but one are what they were; those below it are moved
if there are more or fewer lines.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from msgspec import Struct

from potto.ide.names.places import PieceAt, pieces_of
from potto_lsp.asking import Ask
from potto_lsp.wire import Encoded

_LINES = re.compile(r'"(line|startLine|endLine)":(\d+)')
"""Lines in JSON. Not in its strings, where the quotes would be escaped."""


class Part(Struct, eq=False):
    """The items of a piece: JSON with `%d` for each line, the lines from the piece's own first one on, and what was
    made of them for one place."""

    template: str
    lines: tuple[int, ...]
    line: int = -1
    text: bytes = b""

    def placed(self, line: int) -> bytes:
        """The items of a piece that starts on a line."""
        if self.line != line:
            text = self.template % tuple([line + own for own in self.lines])
            self.line, self.text = line, text.encode("ascii")
        return self.text


def part_of(items: Iterable[Any]) -> Part:
    """Items of a piece, with lines counted from its first one."""
    text = json.dumps(list(items), separators=(",", ":"))[1:-1].replace("%", "%%")
    lines = tuple([int(found[2]) for found in _LINES.finditer(text)])
    return Part(_LINES.sub(r'"\1":%d', text), lines)


def lined(ask: Ask) -> Iterator[tuple[PieceAt, int]]:
    """The pieces of the document, each with its first line."""
    text = ask.text
    for at in pieces_of(ask.db, ask.file):
        yield at, text.lines.line_of(at.start)


def whole(ask: Ask, part: Callable[[PieceAt], Part], beside: Iterable[Any] = ()) -> Encoded:
    """The items of all pieces, behind some that belong to none."""
    found = [part_of(beside).placed(0)]
    found += [part(at).placed(line) for at, line in lined(ask)]
    return Encoded(found)
