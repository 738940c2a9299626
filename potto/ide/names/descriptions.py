"""What authors wrote about their definitions, and the heads under which hover, completion and outlines show them."""

from __future__ import annotations

from typing import Literal

from potto.ide.names.index import call_head
from potto.ide.names.places import ChunkAt
from potto.ide.names.symbols import home
from potto.modules import chunk_text, chunks, is_diffeo, parsed
from potto.modules.texts import piece, pieces
from potto.query import Database, query
from potto.source import Span
from potto.syntax import ParsedChunk, nodes
from potto.types import Function, Unknown, derivative_type, format_type, interface
from potto.types.types import holds_functions


@query
def documentation(db: Database, file: str, name: str) -> str:
    """The comment lines directly above a definition."""
    text = chunk_text(db, file, name)
    if text is None:
        return ""
    found = parsed(db, text, is_diffeo(file))
    return "" if found.item is None else _prose(found, found.item.span.start)


@query
def module_documentation(db: Database, file: str) -> str:
    """The comment at the head of a file, if it stands by itself."""
    found = chunks(db, file)
    if not found:
        return ""
    first = parsed(db, found[0].text, is_diffeo(file))
    return _prose(first, len(found[0].text)) if first.item is None else ""


def _prose(found: ParsedChunk, end: int) -> str:
    """Comments in front of a place; live expressions are not prose."""
    lines = [
        comment.text.lstrip("#").strip()
        for comment in found.comments
        if comment.own_line and comment.span.end <= end and not comment.text.startswith(("#>", "#="))
    ]
    return "\n".join(lines).strip()


@query
def definition_head(db: Database, file: str, name: str) -> str:
    """`f : T` and under it the type of its derivative, if there is a function in it."""
    type = interface(db, file, name).type
    lines = [f"{name} : {format_type(type)}"]
    derived = derivative_type(type)
    if not isinstance(derived, Unknown) and holds_functions(type):
        lines.append(f"{'d' + name if isinstance(type, Function) else 'd ' + name} : {format_type(derived)}")
    return "\n".join(lines)


@query
def type_text(db: Database, file: str, name: str) -> str:
    """The type of a definition."""
    return format_type(interface(db, file, name).type)


Kind = Literal["function", "diffeo", "constant", "record"]


@query
def written_kind(db: Database, file: str, name: str) -> Kind:
    """What a definition is, as far as its text shows: asks for no types."""
    text = chunk_text(db, file, name)
    return "constant" if text is None else chunk_kind(db, text, is_diffeo(file))


@query(keep=16384)
def chunk_kind(db: Database, text: str, diffeo: bool) -> Kind:
    """What a chunk's text defines."""
    item = parsed(db, text, diffeo).item
    if isinstance(item, nodes.DiffeoDefinition):
        return "diffeo"
    if isinstance(item, nodes.RecordDefinition):
        return "record"
    function = isinstance(item, nodes.Definition) and (item.groups or isinstance(item.body, nodes.Lambda))
    derived = isinstance(item, nodes.Definition) and call_head(item.body)[2] > 0 and not item.bindings
    return "function" if function or derived else "constant"


@query
def written_kinds(db: Database, file: str) -> tuple[tuple[str, Kind], ...]:
    """The definitions of a file with their kinds. Runs at every edit: what it asks of a text stands for ever."""
    found: dict[str, Kind] = {}
    for text in pieces(db, file):
        found.update(_piece_kinds(db, text, is_diffeo(file)))
    return tuple(found.items())


@query(keep=512)
def _piece_kinds(db: Database, text: str, diffeo: bool) -> tuple[tuple[str, Kind], ...]:
    """Those of a piece."""
    return tuple((name, chunk_kind(db, chunk, diffeo)) for name, chunk in piece(db, text, diffeo).texts.items())


@query
def kind_of(db: Database, file: str, name: str) -> Kind:
    """What a definition is when it is used: a function, as a record is too, a diffeomorphism, or a constant."""
    written = written_kind(db, file, name)
    if written == "record":
        return "function"
    if written != "constant":
        return written
    return "function" if isinstance(interface(db, file, name).type, Function) else "constant"


def name_span(db: Database, file: str, name: str) -> Span:
    """Where a definition's name stands in its file."""
    chunk = home(db, file, name)
    return Span(0, 0) if chunk is None else defined_at(db, chunk, name)


def defined_at(db: Database, chunk: ChunkAt, name: str) -> Span:
    """Where the name that a chunk defines stands."""
    for occurrence in chunk.index(db).occurrences:
        if occurrence.role == "define":
            return chunk.absolute(occurrence.span)
    at = chunk.text.find(name)  # its head could not be read
    return Span(chunk.start + max(at, 0), chunk.start + max(at, 0) + (len(name) if at >= 0 else 0))


def item_span(db: Database, file: str, name: str) -> Span:
    """Where a definition stands in its file, its comment included."""
    chunk = home(db, file, name)
    return Span(0, 0) if chunk is None else Span(chunk.start, chunk.start + len(chunk.text))
