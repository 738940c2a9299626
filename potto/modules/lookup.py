"""Names to definitions: modules to files, the scope of a file, and what a name means, through imports and re-exports.

Owns `find_module`, `resolve` and `resolve_member`. A dotted module `pkg.m` is `pkg/m.po` or `pkg/m.diffeo` in the
folder of the importing file, then in each of the workspace's roots (the input `("roots",)`); `.po` wins over
`.diffeo`, and a file does not find itself where another one answers. Which candidates exist is asked of the inputs of
their texts, one by one, so a file that appears, disappears or is opened unsaved changes just the lookups it concerns.
"""

from __future__ import annotations

import os.path
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from msgspec import Struct

from potto.modules.texts import exists, imports, names
from potto.query import Database, query
from potto.syntax import nodes

SUFFIXES = (".po", ".diffeo")


class DefinitionTarget(NamedTuple):
    """A definition of a file. A tuple, as it is a key of nearly everything: those are compared ten times as fast."""

    file: str
    name: str


class ModuleTarget(Struct, frozen=True):
    """A module: its file, and how it was written."""

    file: str
    dotted: str


Target = DefinitionTarget | ModuleTarget


class ImportBinding(Struct, frozen=True):
    """What an import binds a name to: `name` of `module`, or the module itself."""

    module: str
    name: str | None


class DefinitionBinding(Struct, frozen=True):
    """What a definition of the file itself binds a name to."""


class FoundModule(Struct, frozen=True):
    """The file that a module name means, and another one that it could mean as well."""

    file: str
    other: str | None = None


def folders(db: Database, file: str) -> tuple[str, ...]:
    """Where modules that `file` imports are looked for, in order."""
    roots: tuple[str, ...] = db.get_input(("roots",), ())
    own = (os.path.dirname(file),) if os.path.isabs(file) else ()
    return tuple(dict.fromkeys((*own, *roots)))


@query
def locate(db: Database, file: str, dotted: str) -> FoundModule | None:
    """The file that a module's name means in `file`, with the runner-up if `m.po` and `m.diffeo` are side by side."""
    path, itself = dotted.replace(".", "/"), None
    for folder in folders(db, file):
        candidates = [os.path.join(folder, path + suffix) for suffix in SUFFIXES]
        present = [candidate for candidate in candidates if exists(db, candidate)]
        others = [candidate for candidate in present if candidate != file]
        if others:
            return FoundModule(others[0], others[1] if len(others) > 1 else None)
        itself = itself or (FoundModule(file) if present else None)
    return itself


@query(travels=True)
def find_module(db: Database, file: str, dotted: str) -> str | None:
    """The key of the file that the module `dotted` means in `file`."""
    found = locate(db, file, dotted)
    return None if found is None else found.file


@query(travels=True)
def scope(db: Database, file: str) -> Mapping[str, ImportBinding | DefinitionBinding]:
    """What each name (or dotted module) is bound to at the top of a file; a table, to be read by entry.

    A definition wins over an import of the same name, and a later import over an earlier one.
    """
    table: dict[str, ImportBinding | DefinitionBinding] = {}
    for item in imports(db, file):
        table.update(bindings(item))
    table.update(dict.fromkeys(names(db, file), DefinitionBinding()))
    return table


def bindings(item: nodes.FromImport | nodes.Import) -> Iterator[tuple[str, ImportBinding]]:
    """The names that an import binds, and to what. `import pkg.m` binds `pkg.m`."""
    if not is_written(item.module):
        return
    if isinstance(item, nodes.Import):
        yield item.alias or item.module, ImportBinding(item.module, None)
        return
    for imported in written_names(item):
        yield imported.alias or imported.name, ImportBinding(item.module, imported.name)


def meaning(db: Database, file: str, name: str) -> ImportBinding | DefinitionBinding | None:
    """What a name is bound to at the top of a file, if to anything."""
    return db.entry(scope, (file,), name)


def is_entry(file: str) -> bool:
    """Whether this is a pseudo file, such as an entry of a prompt, which may go on from others."""
    return file.startswith("<")


def preludes(db: Database, file: str) -> Iterator[str]:
    """The files whose names an entry of a prompt sees behind its own, the latest first.

    The input `("prelude", entry)` names the files that it goes on from; earlier entries among them have their own.
    """
    seen = {file}
    stack = [file]
    while stack:
        at = stack.pop()
        if at != file:
            yield at
        earlier: tuple[str, ...] = db.get_input(("prelude", at), ()) if is_entry(at) else ()
        fresh = [other for other in earlier if other not in seen]
        seen.update(fresh)
        stack += reversed(fresh)


def is_written(module: str) -> bool:
    """Whether a module's name is there in full: while it is typed it is not."""
    return all(module.split("."))


def written_names(item: nodes.FromImport) -> tuple[nodes.ImportedName, ...]:
    """The names of an import that are there."""
    return tuple(imported for imported in item.names if imported.name)


class Trail(Struct, frozen=True):
    """Where the search for a name went, file by file, and what it found. `circular`: it came back to where it was."""

    target: Target | None
    steps: tuple[DefinitionTarget, ...]
    circular: bool = False


@query
def trail(db: Database, file: str, name: str) -> Trail:
    """Follow a name through imports and re-exports to the file that defines it."""
    steps: dict[DefinitionTarget, None] = {}
    while True:
        here = DefinitionTarget(file, name)
        if here in steps:
            return Trail(None, tuple(steps), circular=True)
        steps[here] = None
        bound = meaning(db, file, name)
        if bound is None and is_entry(file):
            file = next((earlier for earlier in preludes(db, file) if meaning(db, earlier, name) is not None), file)
            bound = meaning(db, file, name)
        if bound is None:
            return Trail(None, tuple(steps))
        if isinstance(bound, DefinitionBinding):
            return Trail(DefinitionTarget(file, name), tuple(steps))
        module, original = bound.module, bound.name
        target = find_module(db, file, module)
        if original is not None and (target is None or meaning(db, target, original) is None):
            if target is not None:
                steps[DefinitionTarget(target, original)] = None
            module, original = f"{module}.{original}", None  # `from pkg import m` of a module in a folder
            target = find_module(db, file, module)
        if target is None or original is None:
            return Trail(None if target is None else ModuleTarget(target, module), tuple(steps))
        file, name = target, original


@query
def resolve(db: Database, file: str, name: str) -> Target | None:
    """What a name means at the top of a file: a definition, here or where it was imported from, or a module."""
    bound = meaning(db, file, name)
    if isinstance(bound, DefinitionBinding):
        return DefinitionTarget(file, name)
    if bound is None and not is_entry(file):
        return None
    return trail(db, file, name).target


@query
def resolve_member(db: Database, file: str, path: str, name: str) -> DefinitionTarget | None:
    """The definition that `path.name` means in a file that imports the module `path` (or has it under that name)."""
    module = resolve_module(db, file, path)
    target = None if module is None else resolve(db, module, name)
    return target if isinstance(target, DefinitionTarget) else None


@query
def resolve_module(db: Database, file: str, path: str) -> str | None:
    """The file of the module that `path` (`k`, `pkg.m`, or `b.a` where b imports a) means in a file."""
    parts = path.split(".")
    at: str | None = file
    while parts and at is not None:
        for length in range(len(parts), 0, -1):
            target = resolve(db, at, ".".join(parts[:length]))
            if isinstance(target, ModuleTarget):
                at, parts = target.file, parts[length:]
                break
        else:
            return None
    return at
