"""`textDocument/formatting`, `rangeFormatting`, `onTypeFormatting`."""

from __future__ import annotations

from potto import ide
from potto.ide.display.formatting import format_at_once, piece_edits
from potto.modules import is_diffeo
from potto.query import Database, query
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.features.by_piece import PieceItems, part_of, whole
from potto_lsp.text import DocumentText, Encoding
from potto_lsp.wire import Encoded


def document(ask: Ask) -> list[protocol.TextEdit] | Encoded:
    at_once = format_at_once(ask.db, ask.file)
    if at_once is not None:
        return convert.text_edits(ask.text, at_once)
    db, encoding, diffeo = ask.db, ask.text.encoding, is_diffeo(ask.file)
    ends = len(ask.text.text)
    return whole(ask, lambda at: _part(db, at.text, encoding, diffeo, at.start == 0, at.start + len(at.text) == ends))


@query(keep=1024)
def _part(db: Database, text: str, encoding: Encoding, diffeo: bool, first: bool, last: bool) -> PieceItems:
    """The edits of a piece."""
    return part_of(convert.text_edits(DocumentText(text, encoding), piece_edits(db, text, diffeo, first, last)))


def in_range(ask: Ask) -> list[protocol.TextEdit]:
    return convert.text_edits(ask.text, ide.format_range(ask.db, ask.file, ask.span))


def on_type(ask: Ask) -> list[protocol.TextEdit]:
    return convert.text_edits(ask.text, ide.format_on_type(ask.db, ask.file, ask.offset, ask.string("ch")))
