"""The call around the cursor, found in the text alone: while it is being typed it has no tree.

Owns `call_at` (`call_in` in a chunk) and `juxtaposed_at`.
"""

from __future__ import annotations

import re

from msgspec import Struct

from potto.ide.names.places import ChunkAt, chunk_at, text_of
from potto.query import Database
from potto.source import Span
from potto.syntax import RESERVED, nodes, parse_expression

_KEYWORD = re.compile(r"\s*([^\W\d]\w*)\s*=(?!=)")
_PAIRS = {")": "(", "]": "["}


class PendingCall(Struct, frozen=True):
    """A call whose parentheses are open at the cursor.

    function: what is called; `function_span` where it stands (absolute). open, close: the places of the parentheses
    (the end of the chunk if there is none yet). positional: how many arguments without a name stand before the one at
    the cursor; total: how many there are. keywords: the names given anywhere in the parentheses. keyword: the name of
    the argument at the cursor. fresh: nothing of it is written but a word. measure: the function stands after `~`.
    """

    function: nodes.Expr
    function_span: Span
    open: int
    close: int
    positional: int
    total: int
    keywords: tuple[str, ...]
    keyword: str | None
    fresh: bool
    measure: bool


def call_at(db: Database, file: str, offset: int) -> PendingCall | None:
    """The innermost call whose parentheses hold an offset."""
    chunk = chunk_at(db, file, offset)
    return None if chunk is None else call_in(db, chunk, offset - chunk.start)


def call_in(db: Database, chunk: ChunkAt, at: int) -> PendingCall | None:
    """The innermost call of a chunk whose parentheses hold a place in it."""
    text = _blank_comments(db, chunk)
    at = min(at, len(text))
    position = _open_before(text, at)
    while position is not None:
        if text[position] == "(":
            start = _function_start(text, position)
            if start is not None:
                return _call(chunk, text, start, position, at)
        position = _open_before(text, position)
    return None


def juxtaposed_at(db: Database, file: str, offset: int) -> PendingCall | None:
    """The function that is applied by writing its argument after it, when the cursor follows a blank: `f (1, 2) |`."""
    chunk = chunk_at(db, file, offset)
    end = 0 if chunk is None else len(text_of(db, file)[chunk.start : offset].rstrip(" \t"))
    if chunk is None or end == offset - chunk.start or end > len(chunk.text):
        return None
    text = _blank_comments(db, chunk)[:end]
    start = _function_start(text, end)
    if start is None:
        return None
    function = parse_expression(text[start:end]).expr
    where = Span(chunk.start + start, chunk.start + end)
    return PendingCall(function, where, offset, offset, 0, 0, (), None, True, False)


def _blank_comments(db: Database, chunk: ChunkAt) -> str:
    """The chunk's text with comments blanked out, except for the expressions of live ones."""
    text = chunk.text
    for comment in chunk.parsed(db).comments:
        head = 2 if comment.text.startswith("#>") else len(comment.text)
        start = comment.span.start
        text = text[:start] + " " * head + text[start + head :]
    return text


def _open_before(text: str, at: int) -> int | None:
    """The nearest bracket before a place that is open there."""
    closed: list[str] = []
    for position in range(at - 1, -1, -1):
        char = text[position]
        if char in ")]":
            closed.append(_PAIRS[char])
        elif char in "([":
            if not closed:
                return position
            if closed[-1] == char:
                closed.pop()
    return None


def _function_start(text: str, open: int) -> int | None:
    """Where the function in front of a parenthesis begins; None if there is none, as in `(a + b)`."""
    at, start, starts = open, None, list[int]()
    while True:
        end = len(text[:at].rstrip(" \t"))
        if end == 0:
            return start
        char = text[end - 1]
        if char in ")]":
            before = _open_before(text, end - 1)
            if char == "]" or before is None:
                return start
            start = at = before
            starts.append(before)
            continue
        begin = end
        while begin and (text[begin - 1].isalnum() or text[begin - 1] in "_."):
            begin -= 1
        word = text[begin:end]
        if not word or not (word[0].isalpha() or word[0] == "_") or word in RESERVED or word in ("def", "d"):
            return start
        if re.search(r"(?:\bdef|\bdiffeo|\\)\s*$", text[:begin]):
            body = _after_parameters(text, end)
            return min((place for place in starts if place >= body), default=None)
        start = at = begin
        starts.append(begin)


def _after_parameters(text: str, name_end: int) -> int:
    """Where the groups of parameters end that stand directly behind a name; the end of the text if one is open."""
    at = name_end
    while text[at : at + 1] == "(":
        depth = 0
        for position in range(at, len(text)):
            depth += (text[position] == "(") - (text[position] == ")")
            if depth == 0:
                break
        else:
            return len(text)
        at = position + 1
    return at


def _call(chunk: ChunkAt, text: str, start: int, open: int, at: int) -> PendingCall:
    before = _arguments(text, open + 1, at)
    after = _arguments(text, at, len(text), _depth(text[open + 1 : at]))
    current = before[-1] + (after[0] if after else "")
    names = [found.group(1) for part in (*before[:-1], current, *after[1:]) if (found := _KEYWORD.match(part))]
    mine = _KEYWORD.match(current)
    every = (*before[:-1], current, *after[1:])
    written = text[start:open]
    return PendingCall(
        parse_expression(written).expr,
        Span(chunk.start + start, chunk.start + open),
        chunk.start + open,
        chunk.start + at + len(",".join(after)),
        sum(1 for part in before[:-1] if not _KEYWORD.match(part)),
        sum(1 for part in every if part.strip() and not _KEYWORD.match(part)),
        tuple(names),
        mine.group(1) if mine else None,
        re.fullmatch(r"\s*\w*", before[-1]) is not None,
        text[:start].rstrip().endswith("~"),
    )


def _arguments(text: str, start: int, end: int, inside: int | None = None) -> list[str]:
    """The texts between commas outside of brackets. `inside`: up to the parenthesis that closes the call, with so many
    brackets of its arguments open at the start."""
    parts: list[str] = []
    depth, last = inside or 0, start
    for position in range(start, end):
        char = text[position]
        if char in "([":
            depth += 1
        elif char in ")]":
            if depth == 0 and inside is not None:
                end = position
                break
            depth = max(0, depth - 1)
        elif char == "," and depth == 0:
            parts.append(text[last:position])
            last = position + 1
    return [*parts, text[last:end]]


def _depth(text: str) -> int:
    """How many brackets a text leaves open."""
    depth = 0
    for char in text:
        depth = depth + 1 if char in "([" else max(0, depth - 1) if char in ")]" else depth
    return depth
