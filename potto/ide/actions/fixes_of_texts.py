"""Quick fixes for texts that can't be read: what the help of a diagnostic says to write, in the place of what is there.

Owns `suggested_fixes`, and `bracketed` for comparisons. A help is words for people, so nothing in it is trusted: a fix
is offered only if the chunk has fewer errors with it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from potto.diagnostics import Diagnostic
from potto.ide.actions.edits import applied, one_file
from potto.ide.actions.offers import At, Offer, reads
from potto.ide.model import Edit
from potto.ide.names.places import ChunkAt, chunk_at, line_end
from potto.source import Span
from potto.syntax import RESERVED, parse_chunk
from potto.syntax.kinds import BRACKETS, OTHER_LANGUAGE

_QUOTED = re.compile(r"`([^`]+)`")
_WORD = re.compile(r"[^\W\d]\w*")
_TAKE_OUT = re.compile(r"\b(take|leave) (it|the `[^`]+`|`[^`]+`) out\b")
_LONGEST = 40  # characters of a text that a title shows


def suggested_fixes(place: At, said: Diagnostic) -> Iterator[Offer]:
    """The texts that a help names, written where the mistake is."""
    chunk = chunk_at(place.db, place.file, said.span.start)
    if chunk is None or "did you mean" in said.help:
        return
    before = _errors(chunk, [])
    for title, edit in _edits(chunk, said):
        if _errors(chunk, [edit]) < before:
            change = one_file(place.file, Edit(chunk.absolute(edit.span), edit.text))
            yield Offer(title, "quickfix", lambda c=change: c, said, preferred=True)  # type: ignore[misc]
            return


def bracketed(place: At, said: Diagnostic) -> Iterator[Offer]:
    """A comparison in brackets, where a number is needed."""
    chunk = chunk_at(place.db, place.file, said.span.start)
    written = place.text[said.span.start : said.span.end]
    if chunk is None or reads(chunk, [Edit(said.span.shift(-chunk.start), f"[{written}]")]) is None:
        return
    change = one_file(place.file, Edit(said.span, f"[{written}]"))
    yield Offer(f"Write `[{_short(written)}]`", "quickfix", lambda: change, said, preferred=True)


def _errors(chunk: ChunkAt, edits: list[Edit]) -> int:
    found = parse_chunk(applied(chunk.text, edits), chunk.diffeo).diagnostics
    return sum(said.severity == "error" for said in found)


def _edits(chunk: ChunkAt, said: Diagnostic) -> Iterator[tuple[str, Edit]]:
    span = said.span.shift(-chunk.start)
    written = chunk.text[span.start : span.end]
    for text in _QUOTED.findall(said.help):
        new = text.removesuffix(" …")
        if said.code == BRACKETS.code and new in (")", "]"):
            for end in (line_end(chunk.text, span.end), len(chunk.text)):
                place = len(chunk.text[:end].rstrip())
                yield f"Write `{new}`", Edit(Span(place, place), new)
        elif "…" not in new and new != written and _is_at_hand(new, written):
            yield f"Write `{_short(new)}`", Edit(span, _apart(chunk.text, span, new))
            follows = re.match(r"[ \t]*=(?!=)[ \t]*", chunk.text[span.end :])
            if follows is not None and new.startswith("def "):
                yield f"Write `{_short(new)}`", Edit(Span(span.start, span.end + follows.end()), f"{new} ")
    if len(span) and (said.code == OTHER_LANGUAGE.code or _TAKE_OUT.search(said.help)):
        behind = len(chunk.text) - len(chunk.text[span.end :].lstrip(" "))
        yield f"Take out `{_short(written)}`", Edit(Span(span.start, behind), "")


def _is_at_hand(text: str, written: str) -> bool:
    """Whether a text has no names but those that are written already: others stand for what only the author knows."""
    return set(_WORD.findall(text)) <= {*_WORD.findall(written), *RESERVED}


def _apart(text: str, span: Span, new: str) -> str:
    """A text with blanks where it would run into the words around it."""
    before = " " if new[:1].isalpha() and text[:span.start][-1:].isalnum() else ""
    after = " " if new[-1:].isalpha() and text[span.end : span.end + 1].isalnum() else ""
    return f"{before}{new}{after}"


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…"
