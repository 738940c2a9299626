"""What can be folded: definitions, brackets over several lines, comments, the imports. Owns `folding_ranges`."""

from __future__ import annotations

from potto.ide.model import Fold
from potto.ide.names.places import ChunkAt, all_chunks, line_start, text_of
from potto.query import Database, query
from potto.source import Span
from potto.syntax import nodes, walk

_IMPORTS = ("from", "import", "#", "\ufeff")
_FOLDED = (nodes.Integral, nodes.Let, nodes.Lambda, nodes.If, nodes.ListLiteral, nodes.Tuple, nodes.Apply, nodes.Paren)


def folding_ranges(db: Database, file: str) -> tuple[Fold, ...]:
    """The folds of a file, in order; each covers two lines or more, and no two begin on the same line."""
    text = text_of(db, file)
    found: list[Fold] = []
    imports: list[Span] = []
    for chunk in all_chunks(db, file):
        if "\n" in chunk.text:
            found += (Fold(chunk.absolute(f.span), f.kind) for f in chunk_folds(db, chunk.text, chunk.diffeo))
        if chunk.text.startswith(_IMPORTS):
            sketch = chunk.sketch(db)
            if sketch.kind == "import":
                imports.append(chunk.absolute(sketch.span))
    if imports:
        found.append(Fold(imports[0].cover(imports[-1]), "imports"))
    kept: dict[int, Fold] = {}
    for fold in sorted(found, key=lambda f: (f.span.start, -f.span.end)):
        line = line_start(text, fold.span.start)
        if line not in kept and text.find("\n", fold.span.start, fold.span.end) >= 0:
            kept[line] = fold
    return tuple(kept.values())


@query(keep=8192)
def chunk_folds(db: Database, text: str, diffeo: bool) -> tuple[Fold, ...]:
    """The folds of a chunk's text."""
    chunk = ChunkAt("", 0, text, diffeo)
    return (*_in_chunk(db, chunk), *_comments(db, chunk))


def _in_chunk(db: Database, chunk: ChunkAt) -> list[Fold]:
    item = chunk.parsed(db).item
    if item is None or isinstance(item, nodes.FromImport | nodes.Import):
        return []
    found = [Fold(chunk.absolute(item.span), "region")]
    for node in walk(item):
        if isinstance(node, _FOLDED) and "\n" in chunk.text[node.span.start : node.span.end]:
            found.append(Fold(chunk.absolute(node.span), "region"))
    return found


def _comments(db: Database, chunk: ChunkAt) -> list[Fold]:
    """Comments on lines of their own that follow one another."""
    found: list[Fold] = []
    block: Span | None = None
    for comment in chunk.parsed(db).comments:
        if not comment.own_line:
            continue
        if block is not None and chunk.text[block.end : comment.span.start].count("\n") == 1:
            block = block.cover(comment.span)
            continue
        if block is not None:
            found.append(Fold(chunk.absolute(block), "comment"))
        block = comment.span
    if block is not None:
        found.append(Fold(chunk.absolute(block), "comment"))
    return found
