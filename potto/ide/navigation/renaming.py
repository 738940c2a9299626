"""Renaming: local names, parameters with the keyword arguments that fill them, definitions across modules, modules.

Owns `prepare_rename` and `rename`. A definition is renamed with every import that passes it on under its own name, up
to an alias. A rename that would capture or hide a name is refused: the names of each chunk are looked up again in the
new text, and must mean what they meant.
"""

from __future__ import annotations

import os.path
import re
from collections.abc import Sequence

from potto.ide.actions.edits import applied, change_of
from potto.ide.model import Change, Edit, FileRename, Refused, Renaming
from potto.ide.names.index import NameIndex, Occurrence, index
from potto.ide.names.parts import occurrences, split
from potto.ide.names.places import ChunkAt, chunks_with
from potto.ide.names.symbols import (
    BuiltinSymbol,
    FoundName,
    LocalSymbol,
    MeasureSymbol,
    ModuleSymbol,
    PartSymbol,
    symbol_at,
)
from potto.ide.navigation.moved_files import rename_files
from potto.ide.navigation.references import occurrences_of
from potto.modules import find_module, resolve_module, source
from potto.modules.builtins import is_builtin
from potto.modules.lookup import ImportBinding, meaning
from potto.modules.workspace import files, mentions
from potto.query import Database
from potto.source import Span
from potto.syntax import RESERVED

_NAME = re.compile(r"(?!λ)[^\W\d²³¹⁰⁴-⁹][^\W²³¹⁰⁴-⁹]*")
Bound = tuple[str, str]  # a file, and a name at the top of it


def prepare_rename(db: Database, file: str, offset: int) -> Renaming | Refused | None:
    """What a rename at an offset would change, or why it is impossible; None if there is no name."""
    found = symbol_at(db, file, offset)
    if found is None:
        return None
    if found.symbol is None:
        return Refused(f"`{found.occurrence.name}` is not defined")
    if isinstance(found.symbol, BuiltinSymbol | MeasureSymbol):
        return Refused(f"`{found.symbol.name}` is a builtin")
    if isinstance(found.symbol, PartSymbol):
        file_of = found.symbol.data
        where = "of a tuple" if file_of is None else f"of `{os.path.basename(file_of)}`: rename it there"
        return Refused(f"`{found.symbol.name}` is a {'part' if file_of is None else 'column'} {where}")
    span = found.span
    if isinstance(found.symbol, ModuleSymbol) and _is_file_name(db, found):
        leaf = found.occurrence.name.rpartition(".")[2]
        span = Span(span.end - len(leaf), span.end)
        return Renaming(span, leaf)
    return Renaming(span, found.occurrence.name)


def rename(db: Database, file: str, offset: int, new_name: str) -> Change | Refused:
    """The edits that give the name at an offset another name, everywhere."""
    prepared = prepare_rename(db, file, offset)
    if prepared is None:
        return Refused("there is no name here")
    if isinstance(prepared, Refused):
        return prepared
    if not _NAME.fullmatch(new_name):
        return Refused(f"`{new_name}` is not a name: names are letters, digits and `_`, and do not begin with a digit")
    if new_name in RESERVED or new_name == "print":
        return Refused(f"`{new_name}` is a word of the language")
    if new_name == prepared.placeholder:
        return Change(())
    found = symbol_at(db, file, offset)
    assert found is not None
    match found.symbol:
        case LocalSymbol():
            return _rename_local(db, file, found.symbol, found.occurrence, new_name)
        case ModuleSymbol() if _is_file_name(db, found):
            return _rename_module(found.symbol, new_name, db)
        case _:
            return _rename_bound(db, found, new_name)


def _is_file_name(db: Database, found: FoundName) -> bool:
    """Whether the name of a module is that of its file, not an alias."""
    if found.occurrence.role in ("module", "import"):
        return True
    bound = meaning(db, found.chunk.file, found.occurrence.name)
    return not (
        isinstance(bound, ImportBinding) and bound.module.rpartition(".")[2] != found.occurrence.name.rpartition(".")[2]
    )


# Local names


def _rename_local(
    db: Database, file: str, symbol: LocalSymbol, occurrence: Occurrence, new_name: str
) -> Change | Refused:
    prefix = symbol.prefix if occurrence.role == "keyword" else ""
    if not new_name.startswith(prefix) or len(new_name) == len(prefix):
        return Refused(f"the name of a tangent begins with `{prefix}`: call it `{prefix}{new_name}`")
    plain, old = new_name[len(prefix) :], symbol.binder.name
    if symbol.chunk.sketch(db).record and any(b.name == plain for b in symbol.chunk.index(db).binders):
        return Refused(f"`{symbol.chunk.sketch(db).name}` has a field `{plain}` already")
    if not _NAME.fullmatch(plain) or plain in RESERVED:
        return Refused(f"`{plain}` cannot be the name of a parameter")
    places: list[tuple[ChunkAt, Occurrence, str]] = []
    for chunk, found in occurrences_of(db, file, symbol):
        front = found.name[: len(found.name) - len(old)] if found.role == "keyword" else ""
        places.append((chunk, found, front + plain))
    return _change(db, places)


# Definitions


def _rename_bound(db: Database, found: FoundName, new_name: str) -> Change | Refused:
    start = _refers(db, found.chunk, found.occurrence)
    if start is None:
        return Refused(f"`{found.occurrence.name}` cannot be renamed here")
    name = start[1]
    family = _family(db, _root(db, start), found.chunk.file)
    for where, _ in family:
        if meaning(db, where, new_name) is not None:
            return Refused(f"`{new_name}` is already defined or imported in `{os.path.basename(where)}`")
        if is_builtin(new_name) and _uses(db, where, new_name):
            return Refused(f"`{os.path.basename(where)}` uses the builtin `{new_name}`")
    wanted = set(family)
    places: list[tuple[ChunkAt, Occurrence, str]] = []
    for each in dict.fromkeys((*(where for where, _ in family), *files(db))):
        if not mentions(db, each, name):
            continue
        for chunk in chunks_with(db, each, (name,)):
            for occurrence in occurrences(db, chunk):
                if occurrence.name == name and occurrence.binder < 0 and _refers(db, chunk, occurrence) in wanted:
                    places.append((chunk, occurrence, new_name))
    return _change(db, places)


def _refers(db: Database, chunk: ChunkAt, occurrence: Occurrence) -> Bound | None:
    """The name at the top of a file that an occurrence is the name of."""
    match occurrence.role:
        case "use" | "define" | "alias" | "path":
            return (chunk.file, occurrence.name)
        case "import":
            module = find_module(db, chunk.file, occurrence.path)
        case "member":
            module = resolve_module(db, chunk.file, occurrence.path)
        case _:
            return None
    return None if module is None else (module, occurrence.name)


def _root(db: Database, start: Bound) -> Bound:
    """Where a name is made: defined, or given by an alias."""
    seen = {start}
    file, name = start
    while True:
        bound = meaning(db, file, name)
        if not isinstance(bound, ImportBinding) or bound.name != name:
            return file, name
        target = find_module(db, file, bound.module)
        if target is None or (target, name) in seen or meaning(db, target, name) is None:
            return file, name
        file = target
        seen.add((file, name))


def _family(db: Database, root: Bound, file: str) -> tuple[Bound, ...]:
    """The names in all files that stand for this one, passed on without an alias."""
    name = root[1]
    found = {root: None}
    candidates = [each for each in dict.fromkeys((file, *files(db))) if mentions(db, each, name)]
    grew = True
    while grew:
        grew = False
        for each in candidates:
            if (each, name) in found:
                continue
            bound = meaning(db, each, name)
            if not isinstance(bound, ImportBinding) or bound.name != name:
                continue
            target = find_module(db, each, bound.module)
            if target is not None and (target, name) in found:
                found[each, name] = None
                grew = True
    return tuple(found)


def _uses(db: Database, file: str, name: str) -> bool:
    if not mentions(db, file, name):
        return False
    return any(
        o.name == name and o.role == "use" and o.binder < 0
        for chunk in chunks_with(db, file, (name,))
        for o in chunk.index(db).occurrences
    )


# Modules


def _rename_module(symbol: ModuleSymbol, new_name: str, db: Database) -> Change | Refused:
    folder, base = os.path.split(symbol.file)
    new = os.path.join(folder, new_name + os.path.splitext(base)[1])
    if source(db, new) is not None:
        return Refused(f"there is a file `{os.path.basename(new)}` already")
    moved = FileRename(symbol.file, new)
    return Change(rename_files(db, (moved,)).files, (moved,))


# Checking


def _change(db: Database, places: Sequence[tuple[ChunkAt, Occurrence, str]]) -> Change | Refused:
    by_chunk: dict[ChunkAt, list[tuple[Occurrence, str]]] = {}
    for chunk, occurrence, text in places:
        by_chunk.setdefault(chunk, []).append((occurrence, text))
    edits: dict[str, list[Edit]] = {}
    for chunk, given in by_chunk.items():
        local = [Edit(occurrence.span, text) for occurrence, text in given]
        after = index(db, applied(chunk.text, local), chunk.diffeo)
        captured = _captured(chunk.index(db), after, _wholes(db, chunk, dict(given)))
        if captured is not None:
            return Refused(f"`{captured}` would mean something else in `{os.path.basename(chunk.file)}`")
        edits.setdefault(chunk.file, []).extend(Edit(chunk.absolute(e.span), e.text) for e in local)
    return change_of(edits)


def _wholes(db: Database, chunk: ChunkAt, renamed: dict[Occurrence, str]) -> dict[Occurrence, str]:
    """What the names of a chunk's index are called afterwards, where a part of one is renamed: `front.eye`."""
    for whole in chunk.index(db).occurrences:
        pieces = split(db, chunk.file, whole)
        if any(piece in renamed for piece in pieces):
            renamed[whole] = ".".join(renamed.get(piece, piece.name) for piece in pieces)
    return renamed


def _captured(before: NameIndex, after: NameIndex, renamed: dict[Occurrence, str]) -> str | None:
    """The first name that does not mean what it meant."""
    if len(before.occurrences) != len(after.occurrences):
        return next(iter(renamed.values()), "")
    for old, new in zip(before.occurrences, after.occurrences):
        if (old.role, old.binder) != (new.role, new.binder) or new.name != renamed.get(old, old.name):
            return new.name
    return None
