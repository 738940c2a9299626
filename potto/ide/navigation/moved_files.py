"""Files that move: the imports that must follow.

Owns `rename_files`. Imports of what moves are rewritten, and so are the imports in it.
"""

from __future__ import annotations

import os.path
from collections.abc import Mapping, Sequence

from potto.ide.actions.edits import change_of
from potto.ide.model import Change, Edit, FileRename
from potto.ide.names.places import ChunkAt, all_chunks
from potto.modules import find_module
from potto.modules.lookup import SUFFIXES, folders
from potto.modules.workspace import files
from potto.query import Database
from potto.source import Span
from potto.syntax import nodes


def rename_files(db: Database, renames: Sequence[FileRename]) -> Change:
    """The edits of imports for files (or folders) that are about to move. The moves themselves are not included."""
    moved = _moved(db, renames)
    if not moved:
        return Change(())
    edits: dict[str, list[Edit]] = {}
    for file in dict.fromkeys((*files(db), *moved)):
        found = _edits(db, file, moved)
        if found:
            edits[file] = found
    return change_of(edits)


def _moved(db: Database, renames: Sequence[FileRename]) -> dict[str, str]:
    """The programs that move; a folder takes along what is in it."""
    moved: dict[str, str] = {}
    known = files(db)
    for rename in renames:
        if rename.old.endswith(SUFFIXES):
            moved[rename.old] = rename.new
        else:
            inside = rename.old.rstrip(os.sep) + os.sep
            moved.update({f: os.path.join(rename.new, f[len(inside) :]) for f in known if f.startswith(inside)})
    return moved


def _edits(db: Database, file: str, moved: Mapping[str, str]) -> list[Edit]:
    out: list[Edit] = []
    paths: dict[str, str] = {}  # modules as they are written in front of members, before and after
    for chunk in all_chunks(db, file):
        match chunk.parsed(db).item:
            case nodes.FromImport() as item:
                out += _from_import(db, chunk, item, moved, paths)
            case nodes.Import() as item:
                new = _written(db, file, item.module, moved)
                if new is not None:
                    out.append(Edit(chunk.absolute(item.module_span), new))
                    if item.alias is None:
                        paths[item.module] = new
    if paths:
        out += _members(db, file, paths)
    return out


def _from_import(
    db: Database, chunk: ChunkAt, item: nodes.FromImport, moved: Mapping[str, str], paths: dict[str, str]
) -> list[Edit]:
    new = _written(db, chunk.file, item.module, moved)
    if new is not None:
        return [Edit(chunk.absolute(item.module_span), new)]
    out: list[Edit] = []
    for imported in item.names:  # `from pkg import m` of a module in a folder
        whole = f"{item.module}.{imported.name}"
        if find_module(db, chunk.file, item.module) is not None:
            continue
        changed = _written(db, chunk.file, whole, moved)
        if changed is None:
            continue
        package, _, leaf = changed.rpartition(".")
        if package != item.module and (len(item.names) > 1 or not package):
            continue  # the others stay where they are: no one import can say both
        if package != item.module:
            out.append(Edit(chunk.absolute(item.module_span), package))
        if leaf != imported.name:
            out.append(Edit(chunk.absolute(imported.name_span), leaf))
            if imported.alias is None:
                paths[imported.name] = leaf
    return out


def _members(db: Database, file: str, paths: Mapping[str, str]) -> list[Edit]:
    out: list[Edit] = []
    for chunk in all_chunks(db, file):
        for occurrence in chunk.index(db).occurrences:
            if occurrence.role != "path" or occurrence.binder >= 0:
                continue
            for old, new in paths.items():
                if occurrence.name == old or occurrence.name.startswith(old + "."):
                    start = chunk.start + occurrence.span.start
                    out.append(Edit(Span(start, start + len(old)), new))
                    break
    return out


def _written(db: Database, file: str, module: str, moved: Mapping[str, str]) -> str | None:
    """How an import must be written after the move; None if it can stay."""
    target = find_module(db, file, module)
    if target is None or (target not in moved and file not in moved):
        return None
    at, new = moved.get(file, file), moved.get(target, target)
    before, after = folders(db, file), _folders(db, at)
    base = next((i for i, folder in enumerate(before) if _dotted(folder, target) == module), 0)
    if base < len(after):  # first as it was: from the file's own folder, or from the same root
        after = (after[base], *after[:base], *after[base + 1 :])
    found = next((dotted for folder in after if (dotted := _dotted(folder, new)) is not None), None)
    return None if found == module else found


def _folders(db: Database, file: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys((os.path.dirname(file), *folders(db, "<nowhere>"))))


def _dotted(folder: str, target: str) -> str | None:
    """How a file in a folder is called from there."""
    relative = os.path.relpath(target, folder)
    stem, suffix = os.path.splitext(relative)
    if suffix not in SUFFIXES or stem.startswith(os.pardir):
        return None
    parts = stem.split(os.sep)
    return ".".join(parts) if all(part.isidentifier() for part in parts) else None
