"""Live expressions as the checker sees them: what is wrong with them, though they stand in comments.

Owns `live_in` and `live_diagnostics`. What they give is for who evaluates.
"""

from __future__ import annotations

from collections.abc import Iterator

from potto.diagnostics import Diagnostic
from potto.ide.names.places import ChunkAt, all_chunks
from potto.modules.texts import moved
from potto.query import Database, query
from potto.quick import replace
from potto.source import Span
from potto.syntax import live_expressions, parse_expression
from potto.syntax.live import Live
from potto.types import infer_expression


def live_in(db: Database, file: str) -> tuple[Live, ...]:
    """The live expressions of a file, in order."""
    found: list[Live] = []
    for chunk in all_chunks(db, file):
        for live in lives(db, chunk.text) if "#>" in chunk.text else ():
            span, text_span = live.span.shift(chunk.start), live.text_span.shift(chunk.start)
            expected = None if live.expected_span is None else live.expected_span.shift(chunk.start)
            found.append(replace(live, span=span, text_span=text_span, expected_span=expected))
    return tuple(found)


def live_diagnostics(db: Database, file: str) -> tuple[Diagnostic, ...]:
    """What is wrong with the live expressions of a file, and with what they are expected to give."""
    return tuple(said for chunk in all_chunks(db, file) if "#>" in chunk.text for said in _of_chunk(db, chunk))


def _of_chunk(db: Database, chunk: ChunkAt) -> Iterator[Diagnostic]:
    for live in lives(db, chunk.text):
        yield from (_placed(said, chunk.start, live.text_span) for said in wrong_with(db, chunk.file, live.text))
        if live.expected is not None and live.expected_span is not None:
            found = wrong_with(db, chunk.file, live.expected)
            yield from (_placed(said, chunk.start, live.expected_span) for said in found)


@query(keep=8192)
def lives(db: Database, text: str) -> tuple[Live, ...]:
    """The live expressions of a chunk."""
    return live_expressions(text)


@query(keep=4096)
def wrong_with(db: Database, file: str, text: str) -> tuple[Diagnostic, ...]:
    """What is wrong with an expression in a file's scope; its places are relative to it."""
    parsed = parse_expression(text)
    return parsed.diagnostics or infer_expression(db, file, parsed.expr).diagnostics


def _placed(said: Diagnostic, start: int, where: Span) -> Diagnostic:
    shift = start + where.start
    related = tuple(r if r.file else replace(r, span=r.span.shift(shift)) for r in said.related)
    return replace(moved(said, shift), related=related)
