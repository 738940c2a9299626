"""Which names a file uses: in its definitions and statements, in live expressions; and which of its imports are used,
here or by other files.

Another file may take a name from here that is only imported here: it is passed on. That is asked of the workspace, and
only for names that would be reported otherwise.
"""

from __future__ import annotations

import re

from potto.modules.free import Reference, references_in
from potto.modules.lookup import bindings
from potto.modules.texts import chunk_references, imports, is_diffeo, layout, parsed, piece, pieces
from potto.modules.workspace import is_reexported
from potto.query import Database, query
from potto.syntax import live_expressions, parse_expression

_WORD = re.compile(r"[^\W\d]\w*(?:\.[^\W\d]\w*)*")


@query
def unused_imports(db: Database, file: str) -> frozenset[str]:
    """The names that a file imports and neither uses nor passes on. A file of imports alone passes on all of them."""
    imported = {name for item in imports(db, file) for name, _ in bindings(item)}
    if not imported or not _has_content(db, file):
        return frozenset()
    return frozenset(name for name in imported - used_imports(db, file) if not is_reexported(db, file, name))


@query
def used_imports(db: Database, file: str) -> frozenset[str]:
    """The imported names that occur in a file, also as the module in front of a member."""
    imported = {name for item in imports(db, file) for name, _ in bindings(item)}
    found: set[str] = set()
    for text in pieces(db, file):
        if len(found) == len(imported):
            break
        found |= imported & occurring_in_piece(db, text, is_diffeo(file))
    return frozenset(found)


def used_names(db: Database, file: str) -> frozenset[str]:
    """The names that occur in a file and are not bound where they stand."""
    return frozenset().union(*[occurring_in_piece(db, text, is_diffeo(file)) for text in pieces(db, file)])


@query(keep=512)
def occurring_in_piece(db: Database, text: str, diffeo: bool) -> frozenset[str]:
    """The same as `occurring_names`, of all chunks of a piece."""
    return frozenset().union(*[occurring_names(db, chunk.text, diffeo) for chunk in piece(db, text, diffeo).chunks])


@query(keep=2048)
def occurring_names(db: Database, text: str, diffeo: bool) -> frozenset[str]:
    """The free names of a chunk, and its modules with all that is in front of a dot in them."""
    found: set[str] = set()
    _collect(chunk_references(db, text, diffeo).every, found)
    if "#>" in text:
        for live in live_expressions(text):
            found |= names_in(live.text)
    if any(diagnostic.severity == "error" for diagnostic in parsed(db, text, diffeo).diagnostics):
        for word in _WORD.findall(text):  # half-written: what the tree has lost may be used all the same
            found.update(_heads(word))
    return frozenset(found)


def names_in(expression: str) -> frozenset[str]:
    """The same of an expression."""
    found: set[str] = set()
    _collect(references_in(parse_expression(expression).expr).every, found)
    return frozenset(found)


def _collect(references: tuple[Reference, ...], found: set[str]) -> None:
    for path, name in references:
        if path is None:
            found.add(name)
        else:
            found.update(_heads(path))


def _heads(path: str) -> list[str]:
    """`a.b.c`: a, a.b, a.b.c."""
    parts = path.split(".")
    return [".".join(parts[: length + 1]) for length in range(len(parts))]


def _has_content(db: Database, file: str) -> bool:
    return any(piece.texts or piece.statements or piece.nameless for piece in layout(db, file).pieces)
