"""Finding all places that mean the same thing: references in the workspace, highlights in the file.

Owns `references`, `highlights` and `occurrences_of`. Files are asked by their text first, so that nothing is parsed
that does not even mention the name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from potto.ide.model import Highlight, Location
from potto.ide.names.index import Occurrence
from potto.ide.names.parts import is_part, occurrences
from potto.ide.names.places import ChunkAt, all_chunks, chunks_with, owner
from potto.ide.names.symbols import (
    BuiltinSymbol,
    DefinitionSymbol,
    LocalSymbol,
    MeasureSymbol,
    ModuleSymbol,
    PartSymbol,
    Symbol,
    callee,
    meaning_of,
    parameters,
    symbol_at,
)
from potto.modules.texts import imports
from potto.modules.workspace import files, mentions
from potto.query import Database, query
from potto.source import Span
from potto.syntax import nodes

Place = tuple[ChunkAt, Occurrence]


def references(db: Database, file: str, offset: int, declaration: bool = True) -> tuple[Location, ...]:
    """All places with the meaning of the name at an offset. `declaration`: include where it is bound or defined."""
    found = symbol_at(db, file, offset)
    if found is None or found.symbol is None:
        return ()
    out: list[Location] = []
    for chunk, occurrence in occurrences_of(db, file, found.symbol):
        if not declaration and occurrence.role in ("bind", "define"):
            continue
        span = chunk.absolute(occurrence.span)
        out.append(Location(chunk.file, span, span))
    if declaration and isinstance(found.symbol, ModuleSymbol):
        out.insert(0, Location(found.symbol.file, Span(0, 0), Span(0, 0)))
    return tuple(out)


def highlights(db: Database, file: str, offset: int) -> tuple[Highlight, ...]:
    """The places of this file that mean what the name at an offset means."""
    found = symbol_at(db, file, offset)
    if found is None:
        return ()
    if found.symbol is None:  # not defined: its namesakes in the same chunk
        name, part = found.occurrence.name, is_part(db, file, found.occurrence)
        same = (o for o in occurrences(db, found.chunk) if o.name == name and o.binder < 0)
        here = (o.span for o in same if is_part(db, file, o) == part)
        return tuple(Highlight(found.chunk.absolute(span), "text") for span in here)
    places = occurrences_of(db, file, found.symbol, (file,))
    return tuple(
        Highlight(chunk.absolute(o.span), "write" if o.role in ("bind", "define") else "read") for chunk, o in places
    )


def occurrences_of(db: Database, file: str, symbol: Symbol, only: tuple[str, ...] | None = None) -> Iterator[Place]:
    """Where a symbol occurs, file by file in the order of the text; in all of the workspace, or in `only` some."""
    match symbol:
        case LocalSymbol():
            yield from _local(db, symbol, only)
        case DefinitionSymbol(where, name):
            for each in only if only is not None else _files(db, where, file):
                yield from _in_file(db, each, symbol, written_as(db, each, name))
        case ModuleSymbol(where, _):
            for each in only if only is not None else _files(db, where, file):
                yield from _in_file(db, each, symbol, None)
        case BuiltinSymbol(name) | MeasureSymbol(name):
            for each in only if only is not None else _files(db, file):
                if mentions(db, each, name):
                    yield from _in_file(db, each, symbol, frozenset((name,)))
        case PartSymbol(name):
            for each in only if only is not None else _files(db, file):
                yield from _parts(db, each, symbol, name)


def _files(db: Database, *own: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*own, *files(db))))


@query
def aliases(db: Database) -> Mapping[str, frozenset[str]]:
    """The names that imports in the workspace give to a name. A table, to be read by entry."""
    found: dict[str, set[str]] = {}
    for file in files(db):
        for item in imports(db, file):
            for imported in item.names if isinstance(item, nodes.FromImport) else ():
                if imported.alias:
                    found.setdefault(imported.name, set()).add(imported.alias)
    return {name: frozenset(given) for name, given in found.items()}


def written_as(db: Database, file: str, name: str) -> frozenset[str]:
    """The words by which a definition could be called: its name, and those that imports give it one after the other."""
    found = {name}
    pending = [name]
    while pending:
        for alias in db.entry(aliases, (), pending.pop()) or ():
            if alias not in found:
                found.add(alias)
                pending.append(alias)
    for item in imports(db, file):  # also of a file that is not in the workspace
        if isinstance(item, nodes.FromImport):
            found.update(imported.alias for imported in item.names if imported.alias and imported.name in found)
    return frozenset(found)


def _in_file(db: Database, file: str, symbol: Symbol, words: frozenset[str] | None) -> Iterator[Place]:
    if words is not None and not any(mentions(db, file, word) for word in words):
        return
    for chunk in all_chunks(db, file) if words is None else chunks_with(db, file, words):
        for occurrence in occurrences(db, chunk):
            if occurrence.binder >= 0 or (words is not None and occurrence.name not in words):
                continue
            if _same(meaning_of(db, chunk, occurrence), symbol):
                yield chunk, occurrence


def _same(found: Symbol | None, symbol: Symbol) -> bool:
    if isinstance(found, ModuleSymbol) and isinstance(symbol, ModuleSymbol):
        return found.file == symbol.file
    return found == symbol


def _local(db: Database, symbol: LocalSymbol, only: tuple[str, ...] | None) -> Iterator[Place]:
    chunk = symbol.chunk
    if only is None or chunk.file in only:
        yield from ((chunk, o) for o in chunk.index(db).of(symbol.number))
    name = owner(db, chunk)
    if symbol.binder.kind != "parameter" or name is None:
        return
    if not any(_starts(p, symbol) for group in parameters(db, chunk.file, name) for p in group):
        return
    for each in only if only is not None else _files(db, chunk.file):
        yield from _keywords(db, each, symbol, chunk.file, name)
        if chunk.sketch(db).record:
            yield from _parts(db, each, symbol, symbol.binder.name)


def _parts(db: Database, file: str, symbol: LocalSymbol | PartSymbol, name: str) -> Iterator[Place]:
    """Where a part of a value is named: `c.focal`, `c with focal = 2`."""
    for chunk in chunks_with(db, file, (name,)):
        for occurrence in occurrences(db, chunk):
            named = occurrence.name == name and is_part(db, file, occurrence)
            if named and meaning_of(db, chunk, occurrence) == symbol:
                yield chunk, occurrence


def _starts(parameter: nodes.Parameter, symbol: LocalSymbol) -> bool:
    return parameter.span.start == symbol.binder.span.start


def _keywords(db: Database, file: str, symbol: LocalSymbol, where: str, name: str) -> Iterator[Place]:
    """The keyword arguments, also those of derivatives (`dc` for `c`), that fill a parameter of a definition."""
    parameter = symbol.binder.name
    for chunk in chunks_with(db, file, (parameter,)):
        if "=" not in chunk.text:
            continue
        for occurrence in chunk.index(db).occurrences:
            if occurrence.role != "keyword" or occurrence.callee is None or not occurrence.name.endswith(parameter):
                continue
            called = callee(db, file, occurrence.callee)
            if called is None or (called.file, called.name) != (where, name):
                continue
            if occurrence.name == "d" * called.derived + parameter:
                yield chunk, occurrence


__all__ = ["highlights", "occurrences_of", "references"]
