"""`textDocument/foldingRange`, `selectionRange`: the text in pieces."""

from __future__ import annotations

from potto import ide
from potto.source import Span
from potto_lsp import protocol
from potto_lsp.asking import Ask

KINDS = {"comment": "comment", "imports": "imports", "region": "region"}


def folding_ranges(ask: Ask) -> list[protocol.FoldingRange]:
    found: list[protocol.FoldingRange] = []
    for fold in ide.folding_ranges(ask.db, ask.file):
        first, last = ask.position(fold.span.start)["line"], ask.position(fold.span.end)["line"]
        if last > first:
            found.append({"startLine": first, "endLine": last, "kind": KINDS[fold.kind]})
    return found


def selection_ranges(ask: Ask) -> list[protocol.SelectionRange]:
    return [_nested(ask, offset) for offset in ask.offsets("positions")]


def _nested(ask: Ask, offset: int) -> protocol.SelectionRange:
    """The ranges around an offset, from the widest to the narrowest, which is what is sent."""
    spans = sorted({*ide.selection_ranges(ask.db, ask.file, offset)}, key=len, reverse=True)
    found: protocol.SelectionRange | None = None
    for span in spans or [Span(offset, offset)]:
        wider = found
        found = {"range": ask.range(span)}
        if wider is not None:
            found["parent"] = wider
    assert found is not None
    return found
