"""Who needs whom: files by their imports, definitions by their references.

Owns the import graph (`imported_files`, `import_group`, `import_cycle`) and the graph of definitions (`dependencies`,
`strongly_connected`, `is_recursive`). Definitions of different files can only need each other if the files import each
other, so the groups of all definitions are found once for a group of files, and read by entry.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from typing import TypeVar
from zlib import crc32

from potto.modules.free import Reference
from potto.modules.grouping import grouped
from potto.modules.lookup import (
    DefinitionTarget,
    ImportBinding,
    ModuleTarget,
    Target,
    bindings,
    find_module,
    resolve,
    resolve_member,
)
from potto.modules.texts import chunk_references, chunk_text, imports, is_diffeo, names
from potto.query import Database, query

N = TypeVar("N", bound=Hashable)
RUN, MOST_OF_RUN = 12, 32  # definitions in the mean, and at most
RUNS, MOST_RUNS = 8, 12
Run = tuple[str, ...]
_WORD = re.compile(r"[^\W\d]\w*")


@query(travels=True, cuts=True)
def imported_files(db: Database, file: str) -> tuple[str, ...]:
    """The files that a file imports, in order, each once."""
    found: dict[str, None] = {}
    for item in imports(db, file):
        target = find_module(db, file, item.module)
        if target is not None:
            found[target] = None
        for name, imported in bindings(item):
            module = resolve(db, file, name) if _may_be_module(db, file, target, imported) else None
            if isinstance(module, ModuleTarget):  # `from pkg import m`
                found[module.file] = None
    return tuple(found)


def _may_be_module(db: Database, file: str, target: str | None, imported: ImportBinding) -> bool:
    """Whether what is imported by its name from `target` can be a module: one in a folder of that name, or what
    `target` has imported itself. So that to follow imports, however far, no file is asked what it defines."""
    if imported.name is None:
        return False
    bound = () if target is None else imports(db, target)
    return any(name == imported.name for item in bound for name, _ in bindings(item)) or (
        find_module(db, file, f"{imported.module}.{imported.name}") is not None
    )


@query(travels=True, cuts=True)
def import_group(db: Database, file: str) -> tuple[str, ...]:
    """The files that import each other, this one included, sorted; alone if it is in no cycle."""
    for group in components((file,), lambda f: imported_files(db, f)):
        if file in group:
            return tuple(sorted(group))
    raise AssertionError("a file is in the component that it starts")


@query
def import_cycle(db: Database, file: str) -> tuple[str, ...]:
    """The shortest way from a file by imports back to itself, both ends included; empty if there is none."""
    group = set(import_group(db, file))
    before: dict[str, str] = {}
    queue = [file]
    for at in queue:
        for target in imported_files(db, at):
            if target == file and at != file:
                path = [file, at]
                while path[-1] != file:
                    path.append(before[path[-1]])
                return tuple(reversed(path))
            if target in group and target not in before and target != file:
                before[target] = at
                queue.append(target)
    return ()


@query(cuts=True)
def references(db: Database, file: str, name: str) -> tuple[Reference, ...]:
    """The names `(None, name)` and members `(path, name)` that a definition refers to, in order, each once."""
    text = chunk_text(db, file, name)
    return () if text is None else chunk_references(db, text, is_diffeo(file)).every


@query
def dependencies(db: Database, file: str, name: str) -> tuple[DefinitionTarget, ...]:
    """The definitions that a definition refers to directly, in the order of the text."""
    found = (refer(db, file, path, used) for path, used in references(db, file, name))
    return tuple(dict.fromkeys(target for target in found if isinstance(target, DefinitionTarget)))


def refer(db: Database, file: str, path: str | None, name: str) -> Target | None:
    """What a reference in a file means, with or without a module in front; of a field, what it is the field of."""
    if path is None:
        return resolve(db, file, name)
    return resolve_member(db, file, path, name) or owner(db, file, path)


def owner(db: Database, file: str, path: str) -> DefinitionTarget | None:
    """The definition that `path` begins with, in `origin.x`, which is not a member of a module."""
    found = resolve(db, file, path.partition(".")[0])
    return found if isinstance(found, DefinitionTarget) else None


@query
def strongly_connected(db: Database, file: str, name: str) -> tuple[DefinitionTarget, ...]:
    """The definitions that need each other with this one, itself included; itself alone if there are no others."""
    target = DefinitionTarget(file, name)
    return db.entry(_definition_groups, (import_group(db, file),), target) or (target,)


@query
def is_recursive(db: Database, file: str, name: str) -> bool:
    """Whether a definition needs itself, directly or through others."""
    return len(strongly_connected(db, file, name)) > 1 or DefinitionTarget(file, name) in dependencies(db, file, name)


@query(travels=True)
def _definition_groups(db: Database, files: tuple[str, ...]) -> Mapping[DefinitionTarget, tuple[DefinitionTarget, ...]]:
    """The groups of two or more definitions of `files` that need each other, under each of their members.

    In a file that imports none of them each goes by its own name. So they are looked for by words first: most cannot
    need each other by what is written, and of those no tree is made.
    """
    if len(files) == 1 and files[0] not in imported_files(db, files[0]):
        suspects = [DefinitionTarget(files[0], name) for name in _suspects(db, files[0])]
    else:
        suspects = [DefinitionTarget(file, name) for file in files for name in names(db, file)]
    place = {target: index for index, target in enumerate(suspects)}

    def needs(target: DefinitionTarget) -> Iterable[DefinitionTarget]:
        return (needed for needed in dependencies(db, target.file, target.name) if needed in place)

    table: dict[DefinitionTarget, tuple[DefinitionTarget, ...]] = {}
    for group in components(suspects, needs):
        if len(group) > 1:
            ordered = tuple(sorted(group, key=place.__getitem__))
            table.update(dict.fromkeys(group, ordered))
    return table


def _suspects(db: Database, file: str) -> list[str]:
    """The definitions of a file that mention each other in a circle, in the order of the text."""
    defined = names(db, file)
    mentioned = dict(item for some in name_runs(db, file) for item in _mentioned_by(db, file, some))
    groups = components(defined, mentioned.__getitem__)
    circles = {name for group in groups if len(group) > 1 for name in group}
    return [name for name in defined if name in circles]


@query(keep=2048)
def _mentioned(db: Database, file: str, run: Run) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Of some neighbouring definitions of a file the others whose names occur as words in their texts."""
    found, known = [], _names_in(db, file)
    for name in run:
        text = chunk_text(db, file, name)
        words = () if text is None else _WORD.findall(text)
        found.append((name, tuple(sorted(known.intersection(words) - {name}))))
    return tuple(found)


@query(keep=512)
def _mentioned_by(db: Database, file: str, some: tuple[Run, ...]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """The same of some neighbouring runs."""
    return tuple([item for run in some for item in _mentioned(db, file, run)])


@query
def _names_in(db: Database, file: str) -> frozenset[str]:
    return frozenset(names(db, file))


@query(cuts=True)
def name_runs(db: Database, file: str) -> tuple[tuple[Run, ...], ...]:
    """The names of a file in runs, and these in runs of runs."""
    in_runs = tuple(runs(names(db, file)))
    ends = [_hash(run[-1]) // RUN for run in in_runs]  # where one ends that is often a multiple of it
    return tuple(grouped(in_runs, ends, RUNS, MOST_RUNS))


def runs(names: tuple[str, ...]) -> Iterator[Run]:
    """Names in runs of a few."""
    return grouped(names, list(map(_hash, names)), RUN, MOST_OF_RUN)


def _hash(name: str) -> int:
    return crc32(name.encode("utf-8", "surrogatepass"))


def components(starts: Iterable[N], needs: Callable[[N], Iterable[N]]) -> list[list[N]]:
    """The strongly connected components of what is reached from `starts`, needed ones first (Tarjan, iterative)."""
    number: dict[N, int] = {}
    low: dict[N, int] = {}
    open_: dict[N, None] = {}
    found: list[list[N]] = []
    for start in starts:
        if start in number:
            continue
        number[start] = low[start] = len(number)
        open_[start] = None
        work = [(start, iter(needs(start)))]
        while work:
            node, rest = work[-1]
            for target in rest:
                if target not in number:
                    number[target] = low[target] = len(number)
                    open_[target] = None
                    work.append((target, iter(needs(target))))
                    break
                if target in open_:
                    low[node] = min(low[node], number[target])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == number[node]:
                    found.append(_close(open_, node))
    return found


def _close(open_: dict[N, None], node: N) -> list[N]:
    group: list[N] = []
    while not group or group[-1] != node:
        group.append(open_.popitem()[0])
    return group
