"""Imports put in order: sorted, joined by module, without those that are not used. Owns `organizations`."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import takewhile

from potto.ide.actions.edits import minimal, one_file
from potto.ide.actions.imports import import_chunks, is_import
from potto.ide.actions.offers import At, PendingAction
from potto.ide.model import Change
from potto.ide.names.places import ChunkAt, all_chunks
from potto.modules import names
from potto.modules.usage import unused_imports
from potto.query import Database
from potto.source import Span
from potto.syntax import format_source, nodes


def organizations(place: At) -> Iterator[PendingAction]:
    """What can be done about the imports of the file."""
    if not import_chunks(place.db, place.file):
        return
    sorted_only = organized(place.db, place.file, place.text, drop=False)
    if sorted_only is not None:
        yield PendingAction(
            "Sort the imports", "source.organizeImports", lambda: organized(place.db, place.file, place.text, False)
        )
    unused = unused_imports(place.db, place.file) - set(names(place.db, place.file))
    if unused:
        yield PendingAction(
            "Remove all unused imports", "source.fixAll", lambda: organized(place.db, place.file, place.text, True)
        )


def organized(db: Database, file: str, text: str, drop: bool) -> Change | None:
    """The imports at the head of a file in order; None if they are. Imports further down stay where they are."""
    head = _head(db, file)
    if not head or any(chunk.parsed(db).diagnostics for chunk in head):
        return None
    gone = unused_imports(db, file) - set(names(db, file)) if drop else frozenset[str]()
    start, end = head[0].start, head[-1].start + len(head[-1].text)
    old = text[start:end]
    lines = _lines(db, head, gone)
    new = format_source("\n".join(lines)).rstrip("\n") if lines else ""
    if "\r\n" in old:
        new = new.replace("\n", "\r\n")
    return None if old == new else one_file(file, *minimal(old, new, start))


def _head(db: Database, file: str) -> list[ChunkAt]:
    """The imports that follow one another, from the first one."""
    found = import_chunks(db, file)
    around = all_chunks(db, file, Span(found[0].start, found[-1].start)) if found else ()
    return list(takewhile(lambda chunk: is_import(db, chunk), around))


def _lines(db: Database, head: list[ChunkAt], gone: frozenset[str]) -> list[str]:
    whole: dict[str, tuple[str, str]] = {}  # imports of modules, and those with comments, as they are written
    joined: dict[str, dict[str, None]] = {}
    for chunk in head:
        parsed = chunk.parsed(db)
        item = parsed.item
        if isinstance(item, nodes.Import):
            bound = item.alias or item.module
            if bound not in gone:
                whole[chunk.text] = (item.module, bound)
        elif isinstance(item, nodes.FromImport) and parsed.comments:
            whole[chunk.text] = (item.module, "")
        elif isinstance(item, nodes.FromImport):
            kept = joined.setdefault(item.module, {})
            for name in item.names:
                if (name.alias or name.name) not in gone:
                    kept[f"{name.name} as {name.alias}" if name.alias else name.name] = None
    lines = [((module, 0, bound), text) for text, (module, bound) in whole.items()]
    for module, kept in joined.items():
        if kept:
            lines.append(((module, 1, ""), f"from {module} import {', '.join(sorted(kept, key=str.casefold))}"))
    return [text for _, text in sorted(lines)]
