"""`textDocument/documentLink`, `linkedEditingRange`."""

from __future__ import annotations

from typing import Any

from potto import ide
from potto_lsp import protocol
from potto_lsp.asking import Ask


def document_links(ask: Ask) -> list[protocol.DocumentLink]:
    return [
        {"range": ask.range(link.span), "target": ask.analysis.uri(link.target), "tooltip": link.tooltip}
        for link in ide.document_links(ask.db, ask.file)
    ]


def linked_editing(ask: Ask) -> dict[str, Any] | None:
    spans = ide.linked_editing(ask.db, ask.file, ask.offset)
    return {"ranges": [ask.range(span) for span in spans]} if spans else None
