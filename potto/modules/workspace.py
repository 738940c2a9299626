"""Questions over all files of the workspace, for hints only: who defines a name, who imports one from here.

Each file is asked by itself and by its text first, so that a keystroke asks again only the file it is in, and nothing
is parsed that does not even mention the name.
"""

from __future__ import annotations

import os.path
import re

from potto.modules.lookup import SUFFIXES, bindings, find_module, folders
from potto.modules.texts import chunk_references, chunks, content, imports, is_diffeo, names
from potto.query import Database, query
from potto.syntax import nodes


def files(db: Database) -> tuple[str, ...]:
    """All programs of the workspace."""
    found: tuple[str, ...] = db.get_input(("workspace",), ())
    return found


@query
def mentions(db: Database, file: str, name: str) -> bool:
    """Whether a name occurs as a word in a file's text."""
    text = content(db, file)
    return isinstance(text, str) and name in text and re.search(rf"\b{re.escape(name)}\b", text) is not None


@query
def definers(db: Database, name: str) -> tuple[str, ...]:
    """The files of the workspace that define a name."""
    return tuple(file for file in files(db) if mentions(db, file, name) and name in names(db, file))


@query
def module_name(db: Database, file: str, target: str) -> str | None:
    """How `file` would write an import of the file `target`, if it can."""
    for folder in folders(db, file):
        relative = os.path.relpath(target, folder)
        stem, suffix = os.path.splitext(relative)
        dotted = stem.replace(os.sep, ".")
        if suffix in SUFFIXES and not stem.startswith("..") and find_module(db, file, dotted) == target:
            return dotted
    return None


@query
def is_reexported(db: Database, file: str, name: str) -> bool:
    """Whether another file of the workspace takes the name `name` from this one, which may itself import it."""
    return any(other != file and mentions(db, other, name) and _takes(db, other, file, name) for other in files(db))


def _takes(db: Database, other: str, file: str, name: str) -> bool:
    for item in imports(db, other):
        if find_module(db, other, item.module) != file:
            continue
        if isinstance(item, nodes.FromImport):
            if any(imported.name == name for imported in item.names):
                return True
        elif any((bound, name) in _members(db, other) for bound, _ in bindings(item)):
            return True
    return False


@query
def _members(db: Database, file: str) -> frozenset[tuple[str, str]]:
    """The members of modules that a file uses."""
    diffeo = is_diffeo(file)
    found = (reference for chunk in chunks(db, file) for reference in chunk_references(db, chunk.text, diffeo))
    return frozenset((path, name) for path, name in found if path is not None)
