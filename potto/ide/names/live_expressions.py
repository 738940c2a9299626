"""Live expressions as the checker sees them: what is wrong with them, although they are comments.

Owns `live_in` and `live_diagnostics`.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec.structs import replace

from potto.diagnostics import Diagnostic
from potto.ide.names.places import pieces_of
from potto.modules.misread import moved
from potto.modules.texts import groups_of_pieces
from potto.query import Database, query
from potto.syntax import live_expressions, parse_expression, split
from potto.syntax.live import Live
from potto.types import infer_expression


def live_in(db: Database, file: str) -> tuple[Live, ...]:
    """The live expressions of a file, in order."""
    return tuple([_moved(live, at.start) for at in pieces_of(db, file) for live in piece_lives(db, at.text)])


@query(keep=1024)
def piece_lives(db: Database, text: str) -> tuple[Live, ...]:
    """Those of a piece of a file, relative to it."""
    if "#>" not in text:
        return ()
    chunks = (chunk for chunk in split(text) if "#>" in chunk.text)
    return tuple([_moved(live, chunk.start) for chunk in chunks for live in lives(db, chunk.text)])


def _moved(live: Live, start: int) -> Live:
    expected = None if live.expected_span is None else live.expected_span.shift(start)
    return replace(live, span=live.span.shift(start), text_span=live.text_span.shift(start), expected_span=expected)


def live_diagnostics(db: Database, file: str) -> tuple[Diagnostic, ...]:
    """What is wrong with the live expressions of a file, and with what they are expected to give."""
    start, found = 0, list[Diagnostic]()
    for group in groups_of_pieces(db, file):
        found += [_shifted(said, start) for said in _group_diagnostics(db, file, group)]
        start += sum([len(text) for text in group])
    return tuple(found)


@query(keep=512)
def _group_diagnostics(db: Database, file: str, group: tuple[str, ...]) -> tuple[Diagnostic, ...]:
    """What is wrong with those of some pieces of the file, relative to the first."""
    start, found = 0, list[Diagnostic]()
    for text in group:
        found += [_shifted(said, start) for live in piece_lives(db, text) for said in _of_one(db, file, live)]
        start += len(text)
    return tuple(found)


def _of_one(db: Database, file: str, live: Live) -> Iterator[Diagnostic]:
    yield from (_shifted(said, live.text_span.start) for said in wrong_with(db, file, live.text))
    if live.expected is not None and live.expected_span is not None:
        yield from (_shifted(said, live.expected_span.start) for said in wrong_with(db, file, live.expected))


@query(keep=8192)
def lives(db: Database, text: str) -> tuple[Live, ...]:
    """The live expressions of a chunk."""
    return live_expressions(text)


@query(keep=4096)
def wrong_with(db: Database, file: str, text: str) -> tuple[Diagnostic, ...]:
    """What is wrong with an expression in a file's scope; its places are relative to it."""
    parsed = parse_expression(text)
    return parsed.diagnostics or infer_expression(db, file, parsed.expr).diagnostics


def _shifted(said: Diagnostic, shift: int) -> Diagnostic:
    related = tuple(r if r.file else replace(r, span=r.span.shift(shift)) for r in said.related)
    return replace(moved(said, shift), related=related)
