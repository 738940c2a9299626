"""What code actions are made of: an offer is a title and a way to the change, which is made only when it is wanted.

Owns `PendingAction`, `At` (where actions are asked for) and helpers that all of them need.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from msgspec import Struct, field

from potto.checking.check import absolute, definition_diagnostics
from potto.diagnostics import Diagnostic
from potto.ide.actions.edits import applied
from potto.ide.model import ActionKind, Change, Edit
from potto.ide.names.places import ChunkAt, all_chunks, chunk_at, owner, text_of
from potto.modules import module_diagnostics, names, parsed
from potto.modules.lookup import scope
from potto.modules.misread import shift
from potto.query import Database
from potto.source import Span
from potto.syntax import node_at, nodes, parse_chunk
from potto.syntax.nodes import Node
from potto.types import check_statement


class PendingAction(Struct, frozen=True):
    """A code action that isn't carried out yet. `rename_at`: where the new name is in the text after the change."""

    title: str
    kind: ActionKind
    make: Callable[[], Change | None]
    diagnostic: Diagnostic | None = None
    preferred: bool = False
    rename_at: Callable[[], int | None] = field(default=lambda: None)


class At(Struct, frozen=True):
    """Where actions are asked for: the selection, and the chunk that it begins in."""

    db: Database
    file: str
    span: Span
    chunk: ChunkAt | None
    text: str

    @property
    def path(self) -> tuple[Node, ...]:
        """The nodes around the beginning of the selection, outermost first."""
        item = None if self.chunk is None else self.chunk.parsed(self.db).item
        if self.chunk is None or item is None:
            return ()
        return node_at(item, self.span.start - self.chunk.start)


def at(db: Database, file: str, span: Span) -> At:
    """The place of a selection."""
    return At(db, file, span, chunk_at(db, file, span.start), text_of(db, file))


def diagnostics_at(db: Database, file: str, span: Span) -> list[Diagnostic]:
    """What is said about the places that a selection touches, with absolute spans."""
    found = list(module_diagnostics(db, file))
    for chunk in all_chunks(db, file, span):
        read = parsed(db, chunk.text, chunk.diffeo)
        found += (shift(d, chunk.start) for d in read.diagnostics)
        if any(d.severity == "error" for d in read.diagnostics):
            continue  # the parser has spoken; what it guessed means nothing to the calculus
        item, name = chunk.parsed(db).item, owner(db, chunk)
        if name is not None and name in names(db, file):
            found += (absolute(db, file, d, chunk.start) for d in definition_diagnostics(db, file, name))
        elif isinstance(item, nodes.Print | nodes.For | nodes.ExpressionStatement):
            found += (absolute(db, file, d, chunk.start) for d in check_statement(db, file, item))
    return [d for d in dict.fromkeys(found) if d.span.start <= span.end and span.start <= d.span.end]


def taken_names(db: Database, chunk: ChunkAt) -> set[str]:
    """Every name with a meaning in a chunk or at the top of its file."""
    found = chunk.index(db)
    return {*scope(db, chunk.file), *(b.name for b in found.binders), *(o.name for o in found.occurrences)}


def fresh_name(db: Database, chunk: ChunkAt, stem: str) -> str:
    """A name that means nothing yet."""
    taken, number, name = taken_names(db, chunk), 1, stem
    while name in taken:
        number += 1
        name = f"{stem}{number}"
    return name


def bare(node: Any) -> Any:
    """A tree without places, parentheses and styles: equal for texts that mean the same."""
    if isinstance(node, nodes.Paren):
        return bare(node.inner)
    if isinstance(node, tuple):
        return tuple(bare(item) for item in node)
    if isinstance(node, Span):
        return None
    fields = getattr(type(node), "__match_args__", None)
    if fields is None:
        return node
    return (type(node).__name__, *(bare(getattr(node, name)) for name in fields if name not in ("style",)))


def reads(chunk: ChunkAt, edits: list[Edit]) -> Any:
    """The bare tree of a chunk after edits (relative to it); None if that has errors."""
    result = parse_chunk(applied(chunk.text, edits), chunk.diffeo)
    if any(d.severity == "error" for d in result.diagnostics):
        return None
    return bare(result.item)


ATOMS = (nodes.Number, nodes.Name, nodes.Member, nodes.Paren, nodes.Tuple, nodes.Bracket, nodes.ListLiteral)


def as_operand(text: str, node: nodes.Expr) -> str:
    """An expression's text so that it can stand anywhere."""
    called = isinstance(node, nodes.Apply) and node.parenthesized and isinstance(node.function, ATOMS)
    return text if isinstance(node, ATOMS) or called else f"({text})"
