"""Call hierarchy: who uses a definition, and what it uses.

Owns `prepare_call_hierarchy`, `incoming_calls` and `outgoing_calls`. A definition that is passed on counts as called.
"""

from __future__ import annotations

import os.path

from potto.ide.model import CallItem, HierarchyCall, Location
from potto.ide.names.descriptions import kind_of, type_text
from potto.ide.names.places import ChunkAt, chunk_at, owner
from potto.ide.names.symbols import DefinitionSymbol, home, meaning_of, symbol_at
from potto.ide.navigation.references import occurrences_of
from potto.ide.navigation.targets import location
from potto.modules import definition, names
from potto.query import Database
from potto.source import Span

SCRIPT = ""  # the statements of a script, as a caller


def prepare_call_hierarchy(db: Database, file: str, offset: int) -> CallItem | None:
    """The definition named at an offset, else the one that contains the offset."""
    found = symbol_at(db, file, offset)
    if found is not None and isinstance(found.symbol, DefinitionSymbol):
        return call_item(db, found.symbol.file, found.symbol.name)
    chunk = chunk_at(db, file, offset)
    name = None if chunk is None or offset > chunk.start + len(chunk.text) else owner(db, chunk)
    return None if name is None else call_item(db, file, name)


def call_item(db: Database, file: str, name: str) -> CallItem:
    """A definition in a hierarchy."""
    module = os.path.splitext(os.path.basename(file))[0]
    detail = f"{module}: {type_text(db, file, name)}"
    return CallItem(name, detail, kind_of(db, file, name), location(db, file, name), (file, name))


def incoming_calls(db: Database, file: str, name: str) -> tuple[HierarchyCall, ...]:
    """The definitions and scripts that use a definition, with the places."""
    callers: dict[tuple[str, str], list[Span]] = {}
    scripts: dict[str, ChunkAt] = {}
    for chunk, occurrence in occurrences_of(db, file, DefinitionSymbol(file, name)):
        if occurrence.role not in ("use", "member"):
            continue
        caller = owner(db, chunk)
        if caller is None:
            scripts.setdefault(chunk.file, chunk)
        callers.setdefault((chunk.file, caller or SCRIPT), []).append(chunk.absolute(occurrence.span))
    found: list[HierarchyCall] = []
    for (where, caller), spans in callers.items():
        item = call_item(db, where, caller) if caller else _script(where, scripts[where])
        found.append(HierarchyCall(item, tuple(spans)))
    return tuple(found)


def _script(file: str, chunk: ChunkAt) -> CallItem:
    span = Span(chunk.start, chunk.start + len(chunk.text))
    return CallItem(os.path.basename(file), "script", "module", Location(file, span, span), (file, SCRIPT))


def outgoing_calls(db: Database, file: str, name: str) -> tuple[HierarchyCall, ...]:
    """The definitions that a definition uses, with the places in it."""
    chunk = home(db, file, name) if name in names(db, file) else None
    if chunk is None or definition(db, file, name) is None:
        return ()
    callees: dict[tuple[str, str], list[Span]] = {}
    for occurrence in chunk.index(db).occurrences:
        if occurrence.role not in ("use", "member") or occurrence.binder >= 0:
            continue
        symbol = meaning_of(db, chunk, occurrence)
        if isinstance(symbol, DefinitionSymbol):
            callees.setdefault((symbol.file, symbol.name), []).append(chunk.absolute(occurrence.span))
    return tuple(HierarchyCall(call_item(db, *target), tuple(spans)) for target, spans in callees.items())
