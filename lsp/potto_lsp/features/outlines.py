"""`textDocument/documentSymbol`, `workspace/symbol`: what there is, in a file and everywhere."""

from __future__ import annotations

from potto import ide
from potto.ide.navigation.outlines import best_matches, piece_symbols, placeless_symbol
from potto.modules import chunk_start, chunk_text
from potto.query import Database, query
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.features.by_piece import PieceItems, part_of, whole
from potto_lsp.text import DocumentText, Encoding
from potto_lsp.wire import Encoded

KINDS = {
    "function": 12, "constant": 14, "diffeo": 12, "module": 2, "variable": 13, "parameter": 13, "local": 13,
    "statement": 24, "record": 23, "field": 8,
}  # fmt: skip


def document_symbols(ask: Ask) -> Encoded:
    tree = ask.client.can("textDocument.documentSymbol.hierarchicalDocumentSymbolSupport")
    file, uri, encoding = ask.file, "" if tree else ask.uri, ask.text.encoding
    return whole(ask, lambda at: _part(ask.db, file, at.text, at.hidden, uri, encoding))


@query(keep=1024)
def _part(db: Database, file: str, text: str, hidden: tuple[str, ...], uri: str, encoding: Encoding) -> PieceItems:
    """Those of a piece: a list with places in the document of a URI, or a tree."""
    found, place = piece_symbols(db, file, text, hidden), DocumentText(text, encoding)
    return part_of(_flat(place, symbol, uri) if uri else _tree(place, symbol) for symbol in found)


def _flat(text: DocumentText, symbol: ide.DocumentSymbol, uri: str) -> protocol.SymbolInformation:
    place: protocol.Location = {"uri": uri, "range": convert.range_of(text, symbol.span)}
    return {"name": symbol.name, "kind": KINDS[symbol.kind], "location": place}


def _tree(text: DocumentText, symbol: ide.DocumentSymbol) -> protocol.DocumentSymbol:
    return {
        "name": symbol.name,
        "detail": symbol.detail,
        "kind": KINDS[symbol.kind],
        "range": convert.range_of(text, symbol.span),
        "selectionRange": convert.range_of(text, symbol.selection),
        "children": [_tree(text, child) for child in symbol.children],
    }


def workspace_symbols(ask: Ask) -> Encoded:
    found, analysis = list[bytes](), ask.analysis
    for name, file in best_matches(ask.db, ask.string("query") if ask.optional("query") else ""):
        text = analysis.text(file)
        part = _found(ask.db, file, name, analysis.uri(file), text.encoding)
        found.append(part.placed(text.lines.line_of(chunk_start(ask.db, file, name))))
        ask.db.give_way()
    return Encoded(found)


@query(keep=2048)
def _found(db: Database, file: str, name: str, uri: str, encoding: Encoding) -> PieceItems:
    """A symbol of the workspace, placed by the first line of its chunk."""
    symbol, text = placeless_symbol(db, file, name), DocumentText(chunk_text(db, file, name) or "", encoding)
    place: protocol.Location = {"uri": uri, "range": convert.range_of(text, symbol.location.span)}
    told: protocol.SymbolInformation = {
        "name": symbol.name, "kind": KINDS[symbol.kind], "location": place, "containerName": symbol.container,
    }  # fmt: skip
    return part_of([told])
