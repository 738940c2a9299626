"""Writing imports: where one goes, and how it joins those that are there.

Owns `import_edit` and `exports`, the names that the workspace has to offer.
"""

from __future__ import annotations

from collections.abc import Iterable

from potto.ide.model import Edit
from potto.ide.names.places import ChunkAt, all_chunks, chunks_with, text_of
from potto.modules import find_module, names
from potto.modules.workspace import files, module_name
from potto.query import Database, query
from potto.source import Span
from potto.syntax import nodes


@query
def exports(db: Database) -> tuple[tuple[str, str, str], ...]:
    """All definitions of the workspace, sorted: the name in small letters, the name, its file."""
    found = ((name.casefold(), name, file) for file in files(db) for name in names(db, file))
    return tuple(sorted(found))


def import_edit(db: Database, file: str, target: str, name: str) -> Edit | None:
    """The edit that imports a definition of the file `target`; None if `file` cannot write that."""
    module = module_name(db, file, target)
    if module is None:
        return None
    for chunk in reversed(import_chunks(db, file)):
        item = chunk.parsed(db).item
        if isinstance(item, nodes.FromImport) and item.names and find_module(db, file, item.module) == target:
            if any(imported.name == name and imported.alias is None for imported in item.names):
                return None
            end = chunk.start + item.names[-1].span.end
            return Edit(Span(end, end), f", {name}")
    return new_line(db, file, f"from {module} import {name}")


def new_line(db: Database, file: str, line: str) -> Edit:
    """The edit that adds a line to the imports: after the last one, else at the top, behind the file's comment."""
    text = text_of(db, file)
    end_of_line = "\r\n" if "\r\n" in text else "\n"
    written = import_chunks(db, file)
    if written:
        last = written[-1]
        end = last.start + len(last.text)
        return Edit(Span(end, end), end_of_line + line)
    every = all_chunks(db, file)
    head = every[0] if every and every[0].parsed(db).item is None and len(every) > 1 else None
    if head is not None and "#>" not in head.text:
        end = head.start + len(head.text)
        return Edit(Span(end, end), f"{end_of_line}{end_of_line}{line}")
    start = len(text) - len(text.removeprefix("\ufeff"))
    return Edit(Span(start, start), f"{line}{end_of_line}{end_of_line if every else ''}")


def import_chunks(db: Database, file: str) -> list[ChunkAt]:
    """The chunks that are imports, in order."""
    return [chunk for chunk in chunks_with(db, file, ("import",)) if is_import(db, chunk)]


def is_import(db: Database, chunk: ChunkAt) -> bool:
    """Whether a chunk is an import."""
    return isinstance(chunk.parsed(db).item, nodes.FromImport | nodes.Import)


def importable(db: Database, file: str, word: str, hidden: Iterable[str], most: int) -> list[tuple[str, str]]:
    """The definitions of other files whose names hold a word, and are not among `hidden`: `(name, file)`."""
    wanted, out = word.casefold(), []
    known = set(hidden)
    for folded, name, target in exports(db):
        if wanted in folded and target != file and name not in known:
            out.append((not folded.startswith(wanted), name, target))
    return [(name, target) for _, name, target in sorted(out)[:most]]
