"""`textDocument/documentSymbol`, `workspace/symbol`: what there is, in a file and everywhere."""

from __future__ import annotations

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask

KINDS = {
    "function": 12, "constant": 14, "diffeo": 12, "module": 2, "variable": 13, "parameter": 13, "local": 13,
    "statement": 24, "record": 23, "field": 8,
}  # fmt: skip


def document_symbols(ask: Ask) -> list[protocol.DocumentSymbol] | list[protocol.SymbolInformation]:
    found = ide.document_symbols(ask.db, ask.file)
    if ask.client.can("textDocument.documentSymbol.hierarchicalDocumentSymbolSupport"):
        return [_tree(ask, symbol) for symbol in found]
    return [_flat(ask, symbol) for symbol in found]


def _flat(ask: Ask, symbol: ide.DocumentSymbol) -> protocol.SymbolInformation:
    place: protocol.Location = {"uri": ask.uri, "range": ask.range(symbol.span)}
    return {"name": symbol.name, "kind": KINDS[symbol.kind], "location": place}


def _tree(ask: Ask, symbol: ide.DocumentSymbol) -> protocol.DocumentSymbol:
    return {
        "name": symbol.name,
        "detail": symbol.detail,
        "kind": KINDS[symbol.kind],
        "range": ask.range(symbol.span),
        "selectionRange": ask.range(symbol.selection),
        "children": [_tree(ask, child) for child in symbol.children],
    }


def workspace_symbols(ask: Ask) -> list[protocol.SymbolInformation]:
    return [
        {
            "name": symbol.name,
            "kind": KINDS[symbol.kind],
            "location": convert.place(ask.analysis, symbol.location),
            "containerName": symbol.container,
        }
        for symbol in ide.workspace_symbols(ask.db, ask.string("query") if ask.optional("query") else "")
    ]
