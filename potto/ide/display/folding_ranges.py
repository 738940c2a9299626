"""What can be folded: definitions, brackets over several lines, comments, the imports. Owns `folding_ranges`."""

from __future__ import annotations

from potto.ide.model import Foldable
from potto.ide.names.places import ChunkAt, line_start, pieces_of, text_of
from potto.modules import is_diffeo
from potto.modules.texts import import_starts, imports, piece
from potto.query import Database, query
from potto.source import NOWHERE, Span
from potto.syntax import nodes, walk

_FOLDED = (nodes.Integral, nodes.Let, nodes.Lambda, nodes.If, nodes.ListLiteral, nodes.Tuple, nodes.Apply, nodes.Paren)


def folding_ranges(db: Database, file: str) -> tuple[Foldable, ...]:
    """The folds of a file in order. Each covers at least two lines, and no two begin on the same line."""
    found = list(import_folds(db, file))
    for at in pieces_of(db, file):
        found += [Foldable(fold.span.shift(at.start), fold.kind) for fold in piece_folds(db, at.text, is_diffeo(file))]
    return tuple(sorted(found, key=lambda fold: fold.span.start))


def import_folds(db: Database, file: str) -> tuple[Foldable, ...]:
    """The fold of the imports, if they are on several lines."""
    spans = [item.span.shift(start) for start, item in zip(import_starts(db, file), imports(db, file))]
    whole = spans[0].cover(spans[-1]) if spans else NOWHERE
    text = text_of(db, file)
    return (Foldable(whole, "imports"),) if "\n" in text[whole.start : whole.end] else ()


@query(keep=1024)
def piece_folds(db: Database, text: str, diffeo: bool) -> tuple[Foldable, ...]:
    """The folds of a piece of a file, relative to it."""
    found: list[Foldable] = []
    for chunk in piece(db, text, diffeo).chunks:
        if "\n" in chunk.text:
            found += [Foldable(f.span.shift(chunk.start), f.kind) for f in chunk_folds(db, chunk.text, diffeo)]
    kept: dict[int, Foldable] = {}
    for fold in sorted(found, key=lambda f: (f.span.start, -f.span.end)):
        line = line_start(text, fold.span.start)
        if line not in kept and text.find("\n", fold.span.start, fold.span.end) >= 0:
            kept[line] = fold
    return tuple(kept.values())


@query(keep=8192)
def chunk_folds(db: Database, text: str, diffeo: bool) -> tuple[Foldable, ...]:
    """The folds of a chunk's text."""
    chunk = ChunkAt("", 0, text, diffeo)
    return (*_in_chunk(db, chunk), *_comments(db, chunk))


def _in_chunk(db: Database, chunk: ChunkAt) -> list[Foldable]:
    item = chunk.parsed(db).item
    if item is None or isinstance(item, nodes.FromImport | nodes.Import):
        return []
    found = [Foldable(chunk.absolute(item.span), "region")]
    for node in walk(item):
        if isinstance(node, _FOLDED) and "\n" in chunk.text[node.span.start : node.span.end]:
            found.append(Foldable(chunk.absolute(node.span), "region"))
    return found


def _comments(db: Database, chunk: ChunkAt) -> list[Foldable]:
    """Comments on lines of their own that follow one another."""
    found: list[Foldable] = []
    block: Span | None = None
    for comment in chunk.parsed(db).comments:
        if not comment.own_line:
            continue
        if block is not None and chunk.text[block.end : comment.span.start].count("\n") == 1:
            block = block.cover(comment.span)
            continue
        if block is not None:
            found.append(Foldable(chunk.absolute(block), "comment"))
        block = comment.span
    if block is not None:
        found.append(Foldable(chunk.absolute(block), "comment"))
    return found
