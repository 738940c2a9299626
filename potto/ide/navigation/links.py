"""Links from imports to files, and places that are edited together.

Owns `document_links` and `linked_editing`.
"""

from __future__ import annotations

import os.path

from potto.ide.model import DocumentLink
from potto.ide.names.places import chunk_of
from potto.ide.names.symbols import LocalSymbol, ModuleSymbol, meaning_of, symbol_at
from potto.modules.texts import at, exists, layout
from potto.query import Database
from potto.source import Span


def document_links(db: Database, file: str) -> tuple[DocumentLink, ...]:
    """The modules of imports, with the files that they mean."""
    links: list[DocumentLink] = []
    found = layout(db, file)
    chunks = (at(one, start) for piece, start in zip(found.pieces, found.starts) for one in piece.imports)
    for chunk in [chunk_of(file, one) for one in chunks]:
        for occurrence in chunk.index(db).occurrences:
            if occurrence.role not in ("module", "import"):
                continue
            symbol = meaning_of(db, chunk, occurrence)
            if isinstance(symbol, ModuleSymbol) and exists(db, symbol.file):
                tooltip = f"open {os.path.basename(symbol.file)}"
                links.append(DocumentLink(chunk.absolute(occurrence.span), symbol.file, tooltip))
    return tuple(links)


def linked_editing(db: Database, file: str, offset: int) -> tuple[Span, ...]:
    """The places of a local name, including its binder, if they can be edited together; otherwise none. Parameters that
    calls name are left to a rename, since they also occur in other chunks."""
    found = symbol_at(db, file, offset)
    if found is None or not isinstance(found.symbol, LocalSymbol) or found.occurrence.binder < 0:
        return ()
    places = found.chunk.index(db).of(found.symbol.number)
    name = found.symbol.binder.name
    if any(occurrence.name != name for occurrence in places):
        return ()
    return tuple(found.chunk.absolute(occurrence.span) for occurrence in places)
