"""Going to where something is defined, declared, typed or implemented.

Owns `definition`, `declaration`, `type_definition` and `implementation`. The definition of a name is where it is made;
its declaration is where this file got it from (the import, the binder); the implementation of a condition or of a call
is the diffeomorphism behind it.
"""

from __future__ import annotations

import re

from potto.data.mistakes import DataMistake
from potto.ide.model import Links, Location
from potto.ide.names.descriptions import item_span, name_span
from potto.ide.names.places import ChunkAt, chunk_at, chunks_with
from potto.ide.names.symbols import DefinitionSymbol, FoundName, LocalSymbol, ModuleSymbol, PartSymbol, symbol_at
from potto.modules import DefinitionTarget, dependencies, references, resolve, resolve_member, source
from potto.modules import definition as tree_of
from potto.modules.data import data_file
from potto.query import Database
from potto.source import NOWHERE, Span
from potto.syntax import node_at, nodes, walk
from potto.types import Diffeo, interface, result_of

MOST_STEPS = 20


def definition(db: Database, file: str, offset: int) -> Links | None:
    """Where the name at an offset is defined; for the name of a data file, that file."""
    found = symbol_at(db, file, offset)
    return _data_link(db, file, offset) if found is None else _links(found.span, place_of(db, found))


def _data_link(db: Database, file: str, offset: int) -> Links | None:
    """From the name of a file in `load("…")` to the file."""
    chunk = chunk_at(db, file, offset)
    item = None if chunk is None else chunk.parsed(db).item
    if chunk is None or item is None:
        return None
    for node in node_at(item, offset - chunk.start):
        if isinstance(node, nodes.Text):
            found = data_file(db, file, node.text)
            if not isinstance(found, DataMistake):
                return Links(chunk.absolute(node.span), (Location(found.path, NOWHERE, NOWHERE),))
    return None


def _column(db: Database, path: str, name: str) -> Location:
    """Where a column of a file of data has its name, in the first line that has it; else the head of the file."""
    found = source(db, path)
    named = None if found is None else re.search(rf"(?<![^\s,;\"\'])({re.escape(name)})(?![^\s,;\"\'])", found.text)
    span = NOWHERE if named is None else Span(*named.span(1))
    return Location(path, span, span)


def declaration(db: Database, file: str, offset: int) -> Links | None:
    """Where this file got the name at an offset: its import, else its definition."""
    found = symbol_at(db, file, offset)
    if found is None:
        return None
    if found.occurrence.role in ("use", "path") and found.occurrence.binder < 0:
        imported = import_of(db, file, found.occurrence.name)
        if imported is not None:
            return _links(found.span, (imported,))
    return _links(found.span, place_of(db, found))


def type_definition(db: Database, file: str, offset: int) -> Links | None:
    """The diffeomorphism that gives the value of a name its type; for other names their definition."""
    found = symbol_at(db, file, offset)
    if found is None:
        return None
    maps = _diffeos_of(db, found)
    return _links(found.span, maps or place_of(db, found))


def implementation(db: Database, file: str, offset: int) -> Links | None:
    """The diffeomorphism of the condition at an offset, or what stands behind another name for a definition."""
    found = symbol_at(db, file, offset)
    if found is not None:
        maps = _diffeos_of(db, found)
        return _links(found.span, maps or _behind(db, found))
    chunk = chunk_at(db, file, offset)
    item = None if chunk is None else chunk.parsed(db).item
    if chunk is None or item is None:
        return None
    for node in reversed(node_at(item, offset - chunk.start)):
        if isinstance(node, nodes.InlineDiffeo):  # it is written where it is used
            here = chunk.absolute(node.span)
            return _links(here, (Location(file, here, here),))
        if isinstance(node, nodes.If):
            return _links(chunk.absolute(node.condition.span), _maps_in(db, chunk, node.condition))
    return None


def place_of(db: Database, found: FoundName) -> tuple[Location, ...]:
    """Where a symbol is bound or defined."""
    match found.symbol:
        case LocalSymbol(chunk, _, binder):
            return (Location(chunk.file, chunk.absolute(binder.span), chunk.absolute(binder.span)),)
        case DefinitionSymbol(file, name):
            return (location(db, file, name),)
        case PartSymbol(name, data=str() as path):
            return (_column(db, path, name),)
        case ModuleSymbol(file, _):
            return (Location(file, Span(0, 0), Span(0, 0)),) if source(db, file) is not None else ()
        case _:
            return ()


def location(db: Database, file: str, name: str) -> Location:
    """Where a definition stands."""
    return Location(file, name_span(db, file, name), item_span(db, file, name))


def import_of(db: Database, file: str, name: str) -> Location | None:
    """The import that binds a name (or a dotted module) in a file; None if a definition does."""
    last: Location | None = None
    for chunk in chunks_with(db, file, (name,)):
        item = chunk.parsed(db).item
        if isinstance(item, nodes.Definition | nodes.DiffeoDefinition) and item.name == name:
            return None
        full = Span(chunk.start, chunk.start + len(chunk.text))
        if isinstance(item, nodes.FromImport):
            for imported in item.names:
                if (imported.alias or imported.name) == name:
                    last = Location(file, chunk.absolute(imported.alias_span or imported.name_span), full)
        elif isinstance(item, nodes.Import) and (item.alias or item.module) == name:
            last = Location(file, chunk.absolute(item.alias_span or item.module_span), full)
    return last


def _links(origin: Span, targets: tuple[Location, ...]) -> Links | None:
    return Links(origin, targets) if targets else None


def _is_map(db: Database, file: str, name: str) -> bool:
    return isinstance(tree_of(db, file, name), nodes.DiffeoDefinition)


def _diffeos_of(db: Database, found: FoundName) -> tuple[Location, ...]:
    """The diffeomorphisms behind a name: itself, what gives its value, or those that a local name stands for."""
    match found.symbol:
        case DefinitionSymbol(file, name):
            if _is_map(db, file, name):
                return (location(db, file, name),)
            if isinstance(result_of(interface(db, file, name).type), Diffeo):
                needed = dependencies(db, file, name)
                return tuple(location(db, t.file, t.name) for t in needed if _is_map(db, t.file, t.name))
        case LocalSymbol(chunk, _, binder) if binder.kind == "local":
            item = chunk.parsed(db).item
            for node in () if item is None else walk(item):
                if isinstance(node, nodes.Binding) and any(t.span == binder.span for t in node.targets):
                    return _maps_in(db, chunk, node.value)
        case _:
            pass
    return ()


def _maps_in(db: Database, chunk: ChunkAt, expr: nodes.Expr) -> tuple[Location, ...]:
    """The diffeomorphisms that an expression calls."""
    places: dict[Location, None] = {}
    for node in walk(expr):
        target: object = None
        if isinstance(node, nodes.Name):
            target = resolve(db, chunk.file, node.id)
        elif isinstance(node, nodes.Member):
            target = resolve_member(db, chunk.file, node.path, node.name)
        if isinstance(target, DefinitionTarget) and _is_map(db, target.file, target.name):
            places[location(db, target.file, target.name)] = None
    return tuple(places)


def _behind(db: Database, found: FoundName) -> tuple[Location, ...]:
    """`f = g` or `f = deriv(g)`: g, however many names there are between."""
    symbol = found.symbol
    if not isinstance(symbol, DefinitionSymbol):
        return place_of(db, found)
    file, name = symbol.file, symbol.name
    for _ in range(MOST_STEPS):
        item = tree_of(db, file, name)
        needed = dependencies(db, file, name)
        if not isinstance(item, nodes.Definition) or item.groups or item.bindings or len(needed) != 1:
            break
        if isinstance(item.body, nodes.Lambda) or len(references(db, file, name)) > 2:
            break
        file, name = needed[0].file, needed[0].name
    return (location(db, file, name),)


__all__ = ["declaration", "definition", "implementation", "import_of", "location", "place_of", "type_definition"]
