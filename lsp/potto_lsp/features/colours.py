"""`textDocument/semanticTokens`: whole, by what changed, and in a range."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Any

from potto import ide
from potto_lsp.asking import Ask
from potto_lsp.features import TOKEN_MODIFIERS, TOKEN_TYPES

_TYPES = {name: number for number, name in enumerate(TOKEN_TYPES)}
_MODIFIERS = {name: 1 << number for number, name in enumerate(TOKEN_MODIFIERS)}
_ids = itertools.count(1)


def full(ask: Ask) -> dict[str, Any]:
    return {"resultId": _remember(ask, data := _data(ask, ide.semantic_tokens(ask.db, ask.file))), "data": data}


def delta(ask: Ask) -> dict[str, Any]:
    """What changed since the answer that the client has; all of it if we do not know that one any more."""
    known = ask.session.tokens.get(ask.file)
    if known is None or known[0] != ask.optional("previousResultId"):
        return full(ask)
    old, new = known[1], _data(ask, ide.semantic_tokens(ask.db, ask.file))
    return {"resultId": _remember(ask, new), "edits": edits(old, new)}


def in_range(ask: Ask) -> dict[str, Any]:
    return {"data": _data(ask, ide.semantic_tokens(ask.db, ask.file, ask.span))}


def edits(old: list[int], new: list[int]) -> list[dict[str, Any]]:
    """One edit that makes `new` of `old`: all between what they begin and end with in common."""
    if old == new:
        return []
    least = min(len(old), len(new))
    head = next((at for at in range(least) if old[at] != new[at]), least)
    tail = next((at for at in range(least - head) if old[-1 - at] != new[-1 - at]), least - head)
    return [{"start": head, "deleteCount": len(old) - head - tail, "data": new[head : len(new) - tail]}]


def _remember(ask: Ask, data: list[int]) -> str:
    id = f"tokens-{next(_ids)}"
    ask.session.tokens[ask.file] = (id, data)
    return id


def _data(ask: Ask, tokens: Iterable[ide.SemanticToken]) -> list[int]:
    found: list[int] = []
    before_line = before_column = 0
    for token in tokens:
        line, column = ask.text.position(token.span.start)
        length = ask.text.position(token.span.end)[1] - column
        if line != before_line:
            before_column = 0
        modifiers = sum(_MODIFIERS[name] for name in token.modifiers)
        found += (line - before_line, column - before_column, length, _TYPES[token.type], modifiers)
        before_line, before_column = line, column
    return found
