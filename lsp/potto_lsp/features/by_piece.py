"""Answers about whole files, put together from pieces that are kept in the form in which they are sent.

Owns `PieceItems`, `sent`, `part_of`, `lined`, `whole` and `touching`. After a key all parts but one are the same; those
below it are moved if lines were added or removed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from msgspec import Struct

from potto.ide.names.places import PieceAt, pieces_of
from potto.source import Span
from potto_lsp.asking import Ask
from potto_lsp.wire import Encoded

_LINES = re.compile(r'"(line|startLine|endLine)":(\d+)')
"""Lines in JSON. Not in its strings, where the quotes would be escaped."""


class PieceItems(Struct, eq=False):
    """The items of a piece as JSON with `%d` for each line, the line numbers relative to the piece, and the text for
    the line where it was last placed."""

    template: str
    lines: tuple[int, ...]
    line: int = -1
    text: bytes = b""

    def placed(self, line: int) -> bytes:
        """The items, for a piece that starts on this line."""
        if self.line != line:
            text = self.template % tuple([line + own for own in self.lines])
            self.line, self.text = line, text.encode("ascii")
        return self.text


def sent(items: Iterable[Any]) -> bytes:
    """Items whose lines are those of the document, without the brackets around them."""
    return json.dumps(list(items), separators=(",", ":"))[1:-1].encode("ascii")


def part_of(items: Iterable[Any]) -> PieceItems:
    """The part for the items of a piece, whose lines count from its first one."""
    text = sent(items).decode("ascii").replace("%", "%%")
    lines = tuple([int(found[2]) for found in _LINES.finditer(text)])
    return PieceItems(_LINES.sub(r'"\1":%d', text), lines)


def lined(ask: Ask) -> Iterator[tuple[PieceAt, int]]:
    """The pieces of the document, each with its first line."""
    text = ask.text
    for at in pieces_of(ask.db, ask.file):
        yield at, text.lines.line_of(at.start)


def whole(ask: Ask, part: Callable[[PieceAt], PieceItems], beside: Iterable[Any] = ()) -> Encoded:
    """The items of all pieces, after those that belong to none."""
    found = [sent(beside)]
    found += [part(at).placed(line) for at, line in lined(ask)]
    return Encoded(found)


def touching(
    ask: Ask, part: Callable[[PieceAt], PieceItems], near: Callable[[PieceAt, Span], Iterable[Any]]
) -> list[bytes]:
    """The items of the pieces that touch the `range` that is asked about: of one that is all within it the `part`, of
    another one those that are `near` it, as it is seen from the piece."""
    span, found = ask.span, list[bytes]()
    for at, line in lined(ask):
        if span.start <= at.span.start and at.span.end <= span.end:
            found.append(part(at).placed(line))
        elif at.span.touches(span):
            found.append(part_of(near(at, span.shift(-at.start))).placed(line))
    return found
