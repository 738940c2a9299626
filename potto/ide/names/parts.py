"""The names of parts of values, `c.focal` and `c with focal = 2`: where they stand, and what they are parts of.

Owns `occurrences`, `split` and `part_at`. That `front.eye.x` begins with a definition and not with a module is known to
files only, so that the index of a chunk has `front.eye` in one; what it is a part of is known to types only.
"""

from __future__ import annotations

from collections.abc import Iterator

from potto.ide.names.index import Occurrence
from potto.ide.names.places import ChunkAt, owner
from potto.modules import resolve_module
from potto.modules.graph import owner as defines
from potto.query import Database
from potto.source import Span
from potto.syntax import live_expressions, nodes, parse_expression
from potto.types.context import NamedPart
from potto.types.queries import statement_parts, typed_parts


def occurrences(db: Database, chunk: ChunkAt) -> Iterator[Occurrence]:
    """The names of a chunk, each part of a value by itself."""
    for occurrence in chunk.index(db).occurrences:
        yield from split(db, chunk.file, occurrence)


def split(db: Database, file: str, occurrence: Occurrence) -> tuple[Occurrence, ...]:
    """`front.eye` as `front` and `eye`, where `front` is a definition; anything else as it is."""
    if occurrence.role != "path" or "." not in occurrence.name or not begins_with_value(db, file, occurrence.name):
        return (occurrence,)
    head, *rest = occurrence.name.split(".")
    at = occurrence.span.start
    found = [Occurrence(Span(at, at + len(head)), head, "path")]
    for name in rest:
        at = found[-1].span.end + 1
        found.append(Occurrence(Span(at, at + len(name)), name, "field"))
    return tuple(found)


def begins_with_value(db: Database, file: str, path: str) -> bool:
    """Whether what stands in front of a dot is not a module but a definition, or part of one."""
    return resolve_module(db, file, path) is None and defines(db, file, path.partition(".")[0]) is not None


def is_part(db: Database, file: str, occurrence: Occurrence) -> bool:
    """Whether an occurrence is the name of a part of a value."""
    if occurrence.role == "member":
        return occurrence.binder < 0 and begins_with_value(db, file, occurrence.path)
    return occurrence.role == "field"


def part_at(db: Database, chunk: ChunkAt, span: Span) -> NamedPart | None:
    """What the types know of the name of a part at a place of a chunk."""
    return next((part for part in _parts(db, chunk) if part.span == span), None)


def _parts(db: Database, chunk: ChunkAt) -> Iterator[NamedPart]:
    name, item = owner(db, chunk), chunk.parsed(db).item
    if name is not None:
        yield from typed_parts(db, chunk.file, name)
    elif isinstance(item, nodes.Print | nodes.For | nodes.ExpressionStatement):
        yield from statement_parts(db, chunk.file, item)
    for live in live_expressions(chunk.text) if "#>" in chunk.text else ():
        expr = parse_expression(live.text).expr
        for part in statement_parts(db, chunk.file, nodes.ExpressionStatement(expr.span, expr)):
            yield NamedPart(part.span.shift(live.text_span.start), part.name, part.whole, part.type)
