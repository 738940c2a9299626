"""Completion of modules, of the names in them, and of what follows `m.`."""

from __future__ import annotations

import os.path
from collections.abc import Iterator

from msgspec.structs import replace

from potto.ide.completion.parts_of_values import part_items
from potto.ide.completion.place import CompletionPlace
from potto.ide.model import Completion
from potto.ide.names.descriptions import written_kind
from potto.ide.names.places import Site
from potto.modules import DefinitionTarget, ModuleTarget, find_module, names, resolve, resolve_module
from potto.modules.graph import owner
from potto.modules.lookup import bindings, folders
from potto.modules.texts import imports
from potto.modules.workspace import files, module_name
from potto.query import Database, query
from potto.syntax import nodes


@query
def modules_for(db: Database, file: str) -> tuple[tuple[str, str], ...]:
    """The modules that a file can import: how it would write them, and their files."""
    found: dict[str, str] = {}
    for folder in folders(db, file):
        listed: tuple[str, ...] = db.get_input(("folder", folder), ())
        for name in listed:
            stem, suffix = os.path.splitext(name)
            target = None if name.endswith("/") else find_module(db, file, stem)
            if suffix and target is not None and target != file:
                found.setdefault(stem, target)
    for target in files(db):
        dotted = None if target == file else module_name(db, file, target)
        if dotted is not None:
            found.setdefault(dotted, target)
    return tuple(sorted(found.items()))


def module_items(db: Database, file: str, place: CompletionPlace) -> Iterator[Completion]:
    """Modules, after `from` or `import`."""
    for dotted, target in modules_for(db, file):
        yield Completion(dotted, "module", place.span, dotted, dotted, data=("module", target, dotted))


def name_items(db: Database, site: Site, place: CompletionPlace) -> Iterator[Completion]:
    """The names of a module, after `from m import`; those that are imported already are left out."""
    file = site.file
    module = find_module(db, file, place.path)
    taken = _taken(db, site, place)
    if module is not None:
        for item in _names_of(db, module, place):
            if item.label not in taken:
                yield item
    prefix = place.path + "."
    for dotted, target in modules_for(db, file):  # `from pkg import m`
        if dotted.startswith(prefix) and "." not in dotted[len(prefix) :]:
            name = dotted[len(prefix) :]
            yield Completion(name, "module", place.span, name, name, data=("module", target, dotted))


def member_items(db: Database, site: Site, place: CompletionPlace) -> Iterator[Completion]:
    """What follows `m.`: the names of the module, and the modules of a package that is imported."""
    file, chunk = site.file, site.chunk
    head = place.path.partition(".")[0]
    start = place.span.start - len(place.path) - 1  # of the path: what is being typed behind it may not be read yet
    local = chunk is not None and any(b.name == head for _, b in chunk.index(db).visible(start - chunk.start))
    if local or (resolve_module(db, file, place.path) is None and owner(db, file, head) is not None):
        yield from part_items(db, site, place)
        return
    module = resolve_module(db, file, place.path)
    if module is not None:
        yield from _names_of(db, module, place)
    elif resolve(db, file, head) is None:
        yield from _not_imported(db, file, place)
    prefix = place.path + "."
    for item in imports(db, file):
        if isinstance(item, nodes.Import) and item.alias is None and item.module.startswith(prefix):
            name = item.module[len(prefix) :].partition(".")[0]
            yield Completion(name, "module", place.span, name, name)


def _not_imported(db: Database, file: str, place: CompletionPlace) -> Iterator[Completion]:
    """The names of a module that is written without being imported: to take one imports it."""
    module = find_module(db, file, place.path)
    for item in () if module is None or module == file else _names_of(db, module, place):
        match item.data:
            case ("definition", target, name):
                data = ("import", file, target, name, place.path)
                yield replace(item, description=f"import {place.path}", data=data)
            case _:
                pass


def _names_of(db: Database, module: str, place: CompletionPlace) -> Iterator[Completion]:
    for name in names(db, module):
        kind = written_kind(db, module, name)
        yield Completion(name, kind, place.span, name, "0" + name, data=("definition", module, name))
    for item in imports(db, module):  # what it passes on
        for bound, imported in bindings(item):
            target = resolve(db, module, bound)
            if imported.name is not None and isinstance(target, DefinitionTarget):
                kind = written_kind(db, target.file, target.name)
                found = Completion(bound, kind, place.span, bound, "1" + bound)
                yield replace(found, data=("definition", target.file, target.name), description=item.module)
            elif isinstance(target, ModuleTarget) and "." not in bound:
                yield Completion(bound, "module", place.span, bound, "1" + bound)


def _taken(db: Database, site: Site, place: CompletionPlace) -> set[str]:
    chunk = site.chunk
    item = None if chunk is None else chunk.parsed(db).item
    if chunk is None or not isinstance(item, nodes.FromImport):
        return set()
    here = place.span.start - chunk.start
    return {n.name for n in item.names if not n.name_span.start <= here <= n.name_span.end}
