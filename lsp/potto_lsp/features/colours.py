"""`textDocument/semanticTokens`: all of them, what changed, and those in a range."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Any

from msgspec import Struct

from potto import ide
from potto.ide.display.semantic_tokens import Word, definition_words, loose_words
from potto.ide.names.places import PieceAt
from potto.modules import chunk_text
from potto.query import Database, query
from potto_lsp.asking import Ask
from potto_lsp.features import TOKEN_MODIFIERS, TOKEN_TYPES
from potto_lsp.features.whole import lined
from potto_lsp.text import DocumentText, Encoding

Numbers = tuple[int, tuple[int, ...]]  # the line of the last word, and five for each word

_TYPES = {name: number for number, name in enumerate(TOKEN_TYPES)}
_MODIFIERS = {name: 1 << number for number, name in enumerate(TOKEN_MODIFIERS)}
_ids = itertools.count(1)


class Colours(Struct, frozen=True):
    """The colours of a file: those of its pieces, and how many lines each piece begins below the last word of the one
    before."""

    id: str
    parts: list[Numbers]
    below: list[int]

    def data(self, first: int, last: int) -> list[int]:
        """The numbers of some pieces. Each word is placed relative to the one before, so the numbers of a piece are the
        same wherever it stands, but for the first."""
        found: list[int] = []
        for (_, numbers), below in zip(self.parts[first:last], self.below[first:last]):
            found.append(below)
            found += numbers[1:]
        return found


def full(ask: Ask) -> dict[str, Any]:
    new = _remember(ask)
    return {"resultId": new.id, "data": new.data(0, len(new.parts))}


def delta(ask: Ask) -> dict[str, Any]:
    """What changed since the client's last answer; everything if that one is not known any more."""
    old = ask.session.tokens.get(ask.file)
    if old is None or old.id != ask.optional("previousResultId"):
        return full(ask)
    new = _remember(ask)
    return {"resultId": new.id, "edits": edits(old, new)}


def edits(old: Colours, new: Colours) -> list[dict[str, Any]]:
    """One edit that turns `old` into `new`: everything between their common beginning and end. Most of these are pieces
    that are the same objects, so their numbers are not compared."""
    least, head, tail = min(len(old.parts), len(new.parts)), 0, 0
    while head < least and _same(old, head, new, head):
        head += 1
    while tail < least - head and _same(old, len(old.parts) - 1 - tail, new, len(new.parts) - 1 - tail):
        tail += 1
    before, after = old.data(head, len(old.parts) - tail), new.data(head, len(new.parts) - tail)
    if before == after:
        return []
    start = sum([len(numbers) for _, numbers in old.parts[:head]])
    shortest = min(len(before), len(after))
    first = _in_common(before, after, shortest)
    last = _in_common(before[::-1], after[::-1], shortest - first)
    changed = after[first : len(after) - last]
    return [{"start": start + first, "deleteCount": len(before) - first - last, "data": changed}]


def _same(old: Colours, mine: int, new: Colours, other: int) -> bool:
    return old.parts[mine] is new.parts[other] and old.below[mine] == new.below[other]


def _in_common(old: list[int], new: list[int], most: int) -> int:
    """The length of the common beginning of two lists, up to `most`."""
    return next((place for place in range(most) if old[place] != new[place]), most)


def _remember(ask: Ask) -> Colours:
    """The colours of a file, put together from those of its pieces."""
    parts: list[Numbers] = []
    below: list[int] = []
    before, encoding = 0, ask.text.encoding
    for at, line in lined(ask):
        found = last, numbers = _of_piece(ask.db, ask.file, at.text, at.hidden, encoding)
        if numbers:
            parts.append(found)
            below.append(line + numbers[0] - before)
            before = line + last
    made = ask.session.tokens[ask.file] = Colours(f"tokens-{next(_ids)}", parts, below)
    return made


def in_range(ask: Ask) -> dict[str, Any]:
    found = ide.semantic_tokens(ask.db, ask.file, ask.span)
    words = ((token.span.start, token.span.end, token.type, token.modifiers) for token in found)
    return {"data": list(_numbers(ask.text, words)[1])}


@query(keep=1024)
def _of_piece(db: Database, file: str, text: str, hidden: tuple[str, ...], encoding: Encoding) -> Numbers:
    """The words of a piece as numbers, as if it stood at the head of its file: those of its chunks, one behind the
    other."""
    found: list[int] = []
    before, place = 0, DocumentText(text, encoding)
    for chunk, name in PieceAt(file, 0, text, hidden).chunks(db):
        line = place.lines.line_of(chunk.start)
        if place.lines.start(line) != chunk.start:  # behind a byte order mark, or blanks
            words = loose_words(db, file, chunk.text)
            (last, numbers), line = _numbers(place, words, chunk.start), 0
        elif name is None:
            last, numbers = _of_the_rest(db, file, chunk.text, encoding)
        else:
            last, numbers = _of_definition(db, file, name, encoding)
        if numbers:
            found.append(line + numbers[0] - before)
            found += numbers[1:]
            before = line + last
    return before, tuple(found)


@query
def _of_definition(db: Database, file: str, name: str, encoding: Encoding) -> Numbers:
    """The words of a definition as numbers, as if it stood at the beginning of its file."""
    return _numbers(DocumentText(chunk_text(db, file, name) or "", encoding), definition_words(db, file, name))


@query(keep=8192)
def _of_the_rest(db: Database, file: str, text: str, encoding: Encoding) -> Numbers:
    """Those of a chunk that defines nothing."""
    return _numbers(DocumentText(text, encoding), loose_words(db, file, text))


def _numbers(text: DocumentText, words: Iterable[Word], start: int = 0) -> Numbers:
    """Words as numbers, counted from `start` of a text."""
    found: list[int] = []
    before_line = before_column = 0
    for first, last, type, modifiers in words:
        line, column = text.position(start + first)
        length = text.position(start + last)[1] - column
        if line != before_line:
            before_column = 0
        bits = sum([_MODIFIERS[name] for name in modifiers])
        found += (line - before_line, column - before_column, length, _TYPES[type], bits)
        before_line, before_column = line, column
    return before_line, tuple(found)
