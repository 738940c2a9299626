"""What the parser has to say about a file, read in pieces, and diagnostics of a text that stands further on in a file.

Owns `syntax_diagnostics`, `piece_diagnostics`, `moved` and `shift`. What is said of a piece is kept relative to it, so
that an edit above it says nothing anew.
"""

from __future__ import annotations

from msgspec.structs import replace

from potto.diagnostics import Diagnostic
from potto.modules.texts import groups_of_pieces, is_diffeo, parsed, piece
from potto.query import Database, query


@query(travels=True)
def syntax_diagnostics(db: Database, file: str) -> tuple[Diagnostic, ...]:
    """What the parser has to say about a file, with absolute spans."""
    diffeo, start, found = is_diffeo(file), 0, list[Diagnostic]()
    for group in groups_of_pieces(db, file):
        found += [shift(diagnostic, start) for diagnostic in _group_diagnostics(db, group, diffeo)]
        start += sum(map(len, group))
    return tuple(found)


@query(keep=128)
def _group_diagnostics(db: Database, group: tuple[str, ...], diffeo: bool) -> tuple[Diagnostic, ...]:
    """What it has to say about a group of pieces, relative to the first one."""
    start, found = 0, list[Diagnostic]()
    for text in group:
        found += [shift(diagnostic, start, None) for diagnostic in piece_diagnostics(db, text, diffeo)]
        start += len(text)
    return tuple(found)


@query(keep=512, travels=True)
def piece_diagnostics(db: Database, text: str, diffeo: bool) -> tuple[Diagnostic, ...]:
    """What it has to say about a piece, relative to it."""
    return tuple(
        [
            shift(diagnostic, chunk.start, None)
            for chunk in piece(db, text, diffeo).chunks
            for diagnostic in parsed(db, chunk.text, diffeo).diagnostics
        ]
    )


def moved(diagnostic: Diagnostic, start: int) -> Diagnostic:
    """A diagnostic of a text that begins further on, with its suggestions; related places stay."""
    suggestions = tuple(suggestion.shift(start) for suggestion in diagnostic.suggestions)
    return replace(diagnostic, span=diagnostic.span.shift(start), suggestions=suggestions)


def shift(diagnostic: Diagnostic, start: int, owner: str | None = "") -> Diagnostic:
    """A diagnostic of a chunk with absolute spans; with no `owner`, of a piece, with spans relative to that. Related
    places in other chunks are left to who knows them."""
    related = tuple(
        replace(place, span=place.span.shift(start), owner=owner)
        if place.file is None and place.owner is None
        else place
        for place in diagnostic.related
    )
    return replace(moved(diagnostic, start), related=related)
