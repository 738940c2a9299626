"""`textDocument/semanticTokens`: all of them, what changed, and those in a range."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Any

from potto import ide
from potto.ide.display.semantic_tokens import Word, definition_words, loose_words
from potto.ide.names.places import PieceAt
from potto.modules import chunk_text
from potto.query import Database, query
from potto_lsp.asking import Ask
from potto_lsp.colouring import Colours, TokenNumbers, edits
from potto_lsp.features import TOKEN_MODIFIERS, TOKEN_TYPES
from potto_lsp.features.by_piece import lined
from potto_lsp.text import DocumentText, Encoding
from potto_lsp.wire import Encoded

_TYPES = {name: number for number, name in enumerate(TOKEN_TYPES)}
_MODIFIERS = {name: 1 << number for number, name in enumerate(TOKEN_MODIFIERS)}
_ids = itertools.count(1)


def full(ask: Ask) -> Encoded:
    return _remember(ask).sent()


def delta(ask: Ask) -> dict[str, Any] | Encoded:
    """What changed since the client's last answer; everything if that one is not known any more."""
    old = ask.session.tokens.get(ask.file)
    if old is None or old.id != ask.optional("previousResultId"):
        return full(ask)
    new = _remember(ask)
    return {"resultId": new.id, "edits": edits(old, new)}


def _remember(ask: Ask) -> Colours:
    """The colours of a file, put together from those of its pieces."""
    parts: list[TokenNumbers] = []
    below: list[int] = []
    before, encoding = 0, ask.text.encoding
    for at, line in lined(ask):
        found = _of_piece(ask.db, ask.file, at.text, at.hidden, encoding)
        if found.numbers:
            parts.append(found)
            below.append(line + found.numbers[0] - before)
            before = line + found.last
    made = ask.session.tokens[ask.file] = Colours(f"tokens-{next(_ids)}", parts, below)
    return made


def in_range(ask: Ask) -> dict[str, Any]:
    found = ide.semantic_tokens(ask.db, ask.file, ask.span)
    words = ((token.span.start, token.span.end, token.type, token.modifiers) for token in found)
    return {"data": list(_numbers(ask.text, words).numbers)}


@query(keep=1024)
def _of_piece(db: Database, file: str, text: str, hidden: tuple[str, ...], encoding: Encoding) -> TokenNumbers:
    """The words of a piece as numbers, as if it stood at the head of its file: those of its chunks, one behind the
    other."""
    found: list[int] = []
    before, place = 0, DocumentText(text, encoding)
    for chunk, name in PieceAt(file, 0, text, hidden).chunks(db):
        line = place.lines.line_of(chunk.start)
        if place.lines.start(line) != chunk.start:  # behind a byte order mark, or blanks
            words = loose_words(db, file, chunk.text)
            part, line = _numbers(place, words, chunk.start), 0
        elif name is None:
            part = _of_the_rest(db, file, chunk.text, encoding)
        else:
            part = _of_definition(db, file, name, encoding)
        if part.numbers:
            found.append(line + part.numbers[0] - before)
            found += part.numbers[1:]
            before = line + part.last
    return TokenNumbers(before, tuple(found))


@query
def _of_definition(db: Database, file: str, name: str, encoding: Encoding) -> TokenNumbers:
    """The words of a definition as numbers, as if it stood at the beginning of its file."""
    return _numbers(DocumentText(chunk_text(db, file, name) or "", encoding), definition_words(db, file, name))


@query(keep=8192)
def _of_the_rest(db: Database, file: str, text: str, encoding: Encoding) -> TokenNumbers:
    """Those of a chunk that defines nothing."""
    return _numbers(DocumentText(text, encoding), loose_words(db, file, text))


def _numbers(text: DocumentText, words: Iterable[Word], start: int = 0) -> TokenNumbers:
    """TokenNumbers as numbers, counted from `start` of a text."""
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
    return TokenNumbers(before_line, tuple(found))
