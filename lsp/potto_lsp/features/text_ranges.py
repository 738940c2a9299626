"""`textDocument/foldingRange`, `selectionRange`: the text in pieces."""

from __future__ import annotations

from potto import ide
from potto.ide.display.folding_ranges import import_folds, piece_folds
from potto.modules import is_diffeo
from potto.query import Database, query
from potto.source import Span
from potto_lsp import protocol
from potto_lsp.asking import Ask
from potto_lsp.features.by_piece import PieceItems, part_of, whole
from potto_lsp.text import DocumentText
from potto_lsp.wire import Encoded

KINDS = {"comment": "comment", "imports": "imports", "region": "region"}


def folding_ranges(ask: Ask) -> Encoded:
    imports = [_lines(ask.text, fold) for fold in import_folds(ask.db, ask.file)]
    return whole(ask, lambda at: _part(ask.db, at.text, is_diffeo(at.file)), imports)


@query(keep=1024)
def _part(db: Database, text: str, diffeo: bool) -> PieceItems:
    """The folds of a piece."""
    place = DocumentText(text)
    found = [_lines(place, fold) for fold in piece_folds(db, text, diffeo)]
    return part_of(fold for fold in found if fold["endLine"] > fold["startLine"])


def _lines(text: DocumentText, fold: ide.Foldable) -> protocol.FoldingRange:
    first, last = text.position(fold.span.start)[0], text.position(fold.span.end)[0]
    return {"startLine": first, "endLine": last, "kind": KINDS[fold.kind]}


def selection_ranges(ask: Ask) -> list[protocol.SelectionRange]:
    return [_nested(ask, offset) for offset in ask.offsets("positions")]


def _nested(ask: Ask, offset: int) -> protocol.SelectionRange:
    """The ranges around an offset as they are sent: from the narrowest to the widest, each with its parent."""
    spans = sorted({*ide.selection_ranges(ask.db, ask.file, offset)}, key=len, reverse=True)
    found: protocol.SelectionRange | None = None
    for span in spans or [Span(offset, offset)]:
        wider = found
        found = {"range": ask.range(span)}
        if wider is not None:
            found["parent"] = wider
    assert found is not None
    return found
