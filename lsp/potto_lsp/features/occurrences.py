"""`textDocument/references`, `documentHighlight`: where else a name occurs."""

from __future__ import annotations

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask

KINDS = {"text": 1, "read": 2, "write": 3}


def references(ask: Ask) -> list[protocol.Location]:
    declaration = ask.optional("context", "includeDeclaration") is not False
    found = ide.references(ask.db, ask.file, ask.offset, declaration)
    return [convert.place(ask.analysis, place) for place in found]


def highlights(ask: Ask) -> list[protocol.DocumentHighlight]:
    found = ide.highlights(ask.db, ask.file, ask.offset)
    return [{"range": ask.range(highlight.span), "kind": KINDS[highlight.kind]} for highlight in found]
