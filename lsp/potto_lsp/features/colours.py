"""`textDocument/semanticTokens`: whole, by what changed, and in a range."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Any

from potto import ide
from potto.ide.display.semantic_tokens import Word, definition_words, loose_words
from potto.ide.names.places import all_chunks, owner
from potto.modules import chunk_text
from potto.query import Database, query
from potto_lsp.asking import Ask
from potto_lsp.features import TOKEN_MODIFIERS, TOKEN_TYPES
from potto_lsp.text import Encoding, Text

STRIDE = 4096  # numbers that are compared at once
Numbers = tuple[int, tuple[int, ...]]  # the line of the last word, and five for each word

_TYPES = {name: number for number, name in enumerate(TOKEN_TYPES)}
_MODIFIERS = {name: 1 << number for number, name in enumerate(TOKEN_MODIFIERS)}
_ids = itertools.count(1)


def full(ask: Ask) -> dict[str, Any]:
    return {"resultId": _remember(ask, data := _whole(ask)), "data": data}


def delta(ask: Ask) -> dict[str, Any]:
    """What changed since the answer that the client has; all of it if we do not know that one any more."""
    known = ask.session.tokens.get(ask.file)
    if known is None or known[0] != ask.optional("previousResultId"):
        return full(ask)
    old, new = known[1], _whole(ask)
    return {"resultId": _remember(ask, new), "edits": edits(old, new)}


def in_range(ask: Ask) -> dict[str, Any]:
    found = ide.semantic_tokens(ask.db, ask.file, ask.span)
    words = ((token.span.start, token.span.end, token.type, token.modifiers) for token in found)
    return {"data": list(_numbers(ask.text, words)[1])}


def edits(old: list[int], new: list[int]) -> list[dict[str, Any]]:
    """One edit that makes `new` of `old`: all between what they begin and end with in common."""
    if old == new:
        return []
    least = min(len(old), len(new))
    head = _in_common(old, new, least)
    tail = _in_common(old[: head - len(old) - 1 : -1], new[: head - len(new) - 1 : -1], least - head)
    return [{"start": head, "deleteCount": len(old) - head - tail, "data": new[head : len(new) - tail]}]


def _in_common(old: list[int], new: list[int], most: int) -> int:
    """How much two lists begin with in common; equal parts are passed over as fast as memory is read."""
    at = 0
    while at < most and old[at : at + STRIDE] == new[at : at + STRIDE]:
        at += STRIDE
    return next((place for place in range(at, most) if old[place] != new[place]), most) if at < most else most


def _remember(ask: Ask, data: list[int]) -> str:
    id = f"tokens-{next(_ids)}"
    ask.session.tokens[ask.file] = (id, data)
    return id


def _whole(ask: Ask) -> list[int]:
    """The words of a file as numbers. Each says where it stands by the word before, so those of a chunk are the same
    wherever it stands, but for the first: they are kept, and a file is put together from its chunks."""
    found: list[int] = []
    before, text = 0, ask.text
    for chunk in all_chunks(ask.db, ask.file):
        name, line = owner(ask.db, chunk), text.lines.line_of(chunk.start)
        if text.lines.start(line) != chunk.start:  # behind a byte order mark, or blanks
            words = loose_words(ask.db, ask.file, chunk.text)
            (last, numbers), line = _numbers(text, words, chunk.start), 0
        elif name is None:
            last, numbers = _of_the_rest(ask.db, ask.file, chunk.text, text.encoding)
        else:
            last, numbers = _of_definition(ask.db, ask.file, name, text.encoding)
        if numbers:
            found.append(line + numbers[0] - before)
            found += numbers[1:]
            before = line + last
    return found


@query
def _of_definition(db: Database, file: str, name: str, encoding: Encoding) -> Numbers:
    """A definition's words as numbers, as if it stood at the head of its file."""
    return _numbers(Text(chunk_text(db, file, name) or "", encoding), definition_words(db, file, name))


@query(keep=8192)
def _of_the_rest(db: Database, file: str, text: str, encoding: Encoding) -> Numbers:
    """Those of a chunk that defines nothing."""
    return _numbers(Text(text, encoding), loose_words(db, file, text))


def _numbers(text: Text, words: Iterable[Word], start: int = 0) -> Numbers:
    """Words that stand from `start` of a text on as numbers."""
    found: list[int] = []
    before_line = before_column = 0
    for first, last, type, modifiers in words:
        line, column = text.position(start + first)
        length = text.position(start + last)[1] - column
        if line != before_line:
            before_column = 0
        bits = sum(_MODIFIERS[name] for name in modifiers)
        found += (line - before_line, column - before_column, length, _TYPES[type], bits)
        before_line, before_column = line, column
    return before_line, tuple(found)
