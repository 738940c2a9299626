"""Outlines: the definitions of a file with what they bind, and those of the workspace by name.

Owns `document_symbols`, `workspace_symbols`, and `best_matches` and `placeless_symbol`, which the latter is made of.
"""

from __future__ import annotations

import os.path

from msgspec.structs import replace

from potto.ide.actions.imports import exports
from potto.ide.model import DocumentSymbol, Location, SymbolKind, WorkspaceSymbol
from potto.ide.names.descriptions import defined_at, type_text, written_kind
from potto.ide.names.index import BoundName
from potto.ide.names.places import ChunkAt, PieceAt, pieces_of
from potto.ide.names.symbols import placeless
from potto.modules import chunk_start
from potto.query import Database, query
from potto.source import Span
from potto.syntax import nodes

MOST_FOUND = 500
LONG_LABEL = 60


def document_symbols(db: Database, file: str) -> tuple[DocumentSymbol, ...]:
    """The definitions of a file in order, each with its parameters and local names; also the statements of a script."""
    return tuple(
        [
            _shifted(symbol, at.start)
            for at in pieces_of(db, file)
            for symbol in piece_symbols(db, file, at.text, at.hidden)
        ]
    )


@query(keep=1024)
def piece_symbols(db: Database, file: str, text: str, hidden: tuple[str, ...]) -> tuple[DocumentSymbol, ...]:
    """Those of a piece of a file, relative to it."""
    found: list[DocumentSymbol] = []
    for chunk, name in PieceAt(file, 0, text, hidden).chunks(db):
        symbol = _symbol(db, chunk, None) if name is None else definition_symbol(db, file, name)
        if symbol is not None:
            found.append(symbol if name is None else _shifted(symbol, chunk.start))
    return tuple(found)


@query
def definition_symbol(db: Database, file: str, name: str) -> DocumentSymbol | None:
    """A definition for an outline, its places relative to its chunk."""
    chunk = placeless(db, file, name)
    return None if chunk is None else _symbol(db, chunk, name)


def _shifted(symbol: DocumentSymbol, by: int) -> DocumentSymbol:
    span, selection = symbol.span.shift(by), symbol.selection.shift(by)
    children = tuple([_shifted(child, by) for child in symbol.children])
    return DocumentSymbol(symbol.name, symbol.detail, symbol.kind, span, selection, children)


def _symbol(db: Database, chunk: ChunkAt, name: str | None) -> DocumentSymbol | None:
    item = chunk.parsed(db).item
    match item:
        case nodes.Definition() | nodes.DiffeoDefinition():
            kind = _kind(db, chunk.file, name, item)
            detail = type_text(db, chunk.file, name) if name is not None else "defined again below"
            selection, full = chunk.absolute(item.name_span), chunk.absolute(item.span)
            return DocumentSymbol(item.name, detail, kind, full.cover(selection), selection, _children(db, chunk))
        case nodes.RecordDefinition():
            detail = type_text(db, chunk.file, name) if name is not None else "defined again below"
            selection, full = chunk.absolute(item.name_span), chunk.absolute(item.span)
            return DocumentSymbol(item.name, detail, "record", full.cover(selection), selection, _children(db, chunk))
        case nodes.BrokenItem(span=span, name=str() as guessed):
            return DocumentSymbol(guessed, "cannot be read", "constant", chunk.absolute(span), chunk.absolute(span))
        case nodes.Print(span=span) | nodes.For(span=span) | nodes.ExpressionStatement(span=span):
            line = chunk.text[span.start : span.end].splitlines()[0] if len(span) else ""
            label = line if len(line) <= LONG_LABEL else line[: LONG_LABEL - 1] + "…"
            whole = chunk.absolute(span)
            return DocumentSymbol(label, "", "statement", whole, whole, _children(db, chunk)) if label else None
        case _:
            return None


def _kind(db: Database, file: str, name: str | None, item: nodes.Definition | nodes.DiffeoDefinition) -> SymbolKind:
    if isinstance(item, nodes.DiffeoDefinition):
        return "diffeo"
    return "function" if item.groups or name is None else written_kind(db, file, name)


def _children(db: Database, chunk: ChunkAt) -> tuple[DocumentSymbol, ...]:
    """What a chunk binds, without what live expressions bind in its comments."""
    item = chunk.parsed(db).item
    inside = Span(0, 0) if item is None else item.span
    record = isinstance(item, nodes.RecordDefinition)
    found: list[DocumentSymbol] = []
    for b in chunk.index(db).binders:
        if inside.start <= b.span.start and b.span.end <= inside.end:
            place = chunk.absolute(b.span)
            kind: SymbolKind = "field" if record else _child_kind(b)
            found.append(DocumentSymbol(b.name, "field" if record else b.kind, kind, place, place))
    return tuple(found)


def _child_kind(binder: BoundName) -> SymbolKind:
    match binder.kind:
        case "parameter":
            return "parameter"
        case "variable" | "index":
            return "variable"
        case _:
            return "local"


def workspace_symbols(db: Database, text: str) -> tuple[WorkspaceSymbol, ...]:
    """The definitions of the workspace whose names contain the letters of `text` in this order, the likeliest first."""
    found = []
    for name, file in best_matches(db, text):
        symbol, start = placeless_symbol(db, file, name), chunk_start(db, file, name)
        place = Location(file, symbol.location.span.shift(start), symbol.location.full.shift(start))
        found.append(replace(symbol, location=place))
    return tuple(found)


def best_matches(db: Database, text: str) -> list[tuple[str, str]]:
    """Their names and files."""
    wanted = text.casefold()
    scored: list[tuple[int, str, str]] = []
    for folded, name, file in exports(db):
        score = _score(wanted, folded)
        if score is not None:
            scored.append((score, name, file))
    scored.sort()
    return [(name, file) for _, name, file in scored[:MOST_FOUND]]


def _score(wanted: str, name: str) -> int | None:
    if name.startswith(wanted):
        return 0 if name == wanted else 1
    if wanted in name:
        return 2
    at = -1
    for letter in wanted:
        at = name.find(letter, at + 1)
        if at < 0:
            return None
    return 3


@query(keep=2048)
def placeless_symbol(db: Database, file: str, name: str) -> WorkspaceSymbol:
    """A definition, its places relative to its chunk."""
    container, chunk = os.path.splitext(os.path.basename(file))[0], placeless(db, file, name)
    spans = (Span(0, 0), Span(0, 0)) if chunk is None else (defined_at(db, chunk, name), Span(0, len(chunk.text)))
    return WorkspaceSymbol(name, written_kind(db, file, name), container, Location(file, *spans))
