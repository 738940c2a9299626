"""Where an offset of a file is: its chunk, its node, its word.

Owns the conversion from absolute offsets to what is memoized relative to chunks, and back.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Collection, Iterator
from typing import Literal

from msgspec import Struct

from potto.ide.names.index import NameIndex, index
from potto.modules import ChunkRef, chunk_start, chunks, is_diffeo, parsed, source
from potto.modules.texts import at, defined_twice, layout, piece
from potto.query import Database, query
from potto.source import NOWHERE, Span
from potto.syntax import ParsedChunk, nodes


class Sketch(Struct, frozen=True):
    """What a chunk is, the name that it defines, and where the name and the whole are, relative to the chunk."""

    kind: Literal["definition", "import", "statement", "other"]
    span: Span = NOWHERE
    name: str | None = None
    name_span: Span = NOWHERE
    record: bool = False


@query(keep=16384)
def sketch(db: Database, text: str, diffeo: bool) -> Sketch:
    """A chunk in outline. Questions about whole files ask this of every chunk: trees are large, and soon forgotten."""
    match parsed(db, text, diffeo).item:
        case (nodes.Definition() | nodes.DiffeoDefinition()) as item:
            return Sketch("definition", item.span, item.name, item.name_span)
        case nodes.RecordDefinition() as item:
            return Sketch("definition", item.span, item.name, item.name_span, record=True)
        case (nodes.Import() | nodes.FromImport()) as item:
            return Sketch("import", item.span)
        case (nodes.Print() | nodes.For() | nodes.ExpressionStatement()) as item:
            return Sketch("statement", item.span)
        case _:
            return Sketch("other")


class ChunkAt(Struct, frozen=True):
    """A chunk of a file with what is known about it; `start` is its place in the file."""

    file: str
    start: int
    text: str
    diffeo: bool

    def parsed(self, db: Database) -> ParsedChunk:
        """Its tree."""
        return parsed(db, self.text, self.diffeo)

    def sketch(self, db: Database) -> Sketch:
        """What it is, without its tree."""
        return sketch(db, self.text, self.diffeo)

    def index(self, db: Database) -> NameIndex:
        """Its names."""
        return index(db, self.text, self.diffeo)

    def absolute(self, span: Span) -> Span:
        """A place in it as a place in the file."""
        return span.shift(self.start)


def owner(db: Database, chunk: ChunkAt) -> str | None:
    """The name that a chunk defines, if it is the definition that counts."""
    name = chunk.sketch(db).name
    return name if name is not None and chunk_start(db, chunk.file, name) == chunk.start else None


def text_of(db: Database, file: str) -> str:
    """The text of a file; of one that cannot be read, nothing."""
    found = source(db, file)
    return "" if found is None else found.text


def chunk_at(db: Database, file: str, offset: int) -> ChunkAt | None:
    """The chunk that contains an offset, or ends before it; None in front of the first one."""
    found = layout(db, file)
    for place in reversed(range(bisect_right(found.starts, offset))):
        start, inside = found.starts[place], found.pieces[place].chunks
        number = bisect_right(inside, offset - start, key=_start)
        if number:
            return chunk_of(file, at(inside[number - 1], start))
    return None


def _start(chunk: ChunkRef) -> int:
    return chunk.start


def writing_at(db: Database, file: str, offset: int) -> tuple[ChunkAt, int] | None:
    """The chunk that continues if something is typed at an offset, and the place in it (its end, if only blanks
    follow).

    None at the beginning of a line after a chunk: something new starts there.
    """
    chunk = chunk_at(db, file, offset)
    if chunk is None:
        return None
    end = chunk.start + len(chunk.text)
    if offset <= end:
        return chunk, offset - chunk.start
    text = text_of(db, file)
    new_line = line_start(text, offset) > end
    if new_line and (line_start(text, offset) == offset or chunk.parsed(db).item is None):
        return None
    return chunk, len(chunk.text)


class Site(Struct, frozen=True):
    """Where something is being typed: `offset` in `text`, seen from the names of `file`.

    `chunk` contains or precedes the offset; `writing` is what continues if something is typed here, and the place in
    it.
    """

    file: str
    text: str
    offset: int
    chunk: ChunkAt | None
    writing: tuple[ChunkAt, int] | None


def site_at(db: Database, file: str, offset: int) -> Site:
    """A place in a file."""
    text = text_of(db, file)
    offset = min(max(offset, 0), len(text))
    return Site(file, text, offset, chunk_at(db, file, offset), writing_at(db, file, offset))


def site_after(file: str, before: str) -> Site:
    """The end of a text that belongs to no file, as at a prompt."""
    chunk = ChunkAt(file, 0, before, False)
    return Site(file, before, len(before), chunk, (chunk, len(before)))


def chunk_of(file: str, chunk: ChunkRef) -> ChunkAt:
    """A chunk with its file."""
    return ChunkAt(file, chunk.start, chunk.text, is_diffeo(file))


def all_chunks(db: Database, file: str, span: Span | None = None) -> tuple[ChunkAt, ...]:
    """The chunks of a file, or those that touch a span."""
    if span is None:
        return tuple(chunk_of(file, chunk) for chunk in chunks(db, file))
    found, first = layout(db, file), chunk_at(db, file, span.start)
    least = 0 if first is None else first.start
    touched = range(max(bisect_right(found.starts, least) - 1, 0), bisect_right(found.starts, span.end))
    near = (at(chunk, found.starts[place]) for place in touched for chunk in found.pieces[place].chunks)
    return tuple(chunk_of(file, chunk) for chunk in near if least <= chunk.start <= span.end)


def chunks_with(db: Database, file: str, words: Collection[str]) -> Iterator[ChunkAt]:
    """The chunks of a file in whose text one of some words occurs, as a word or within one. Its pieces are looked
    through first: of a long file few have it."""
    found, diffeo = layout(db, file), is_diffeo(file)
    for one, start in zip(found.pieces, found.starts):
        if any(word in one.text for word in words):
            for chunk in one.chunks:
                if any(word in chunk.text for word in words):
                    yield ChunkAt(file, start + chunk.start, chunk.text, diffeo)


class PieceAt(Struct, frozen=True):
    """A piece of a file, see `potto.syntax.chunks`; `start` is its place in the file.

    `hidden`: names that it defines in vain, since they are defined again further on. Questions about whole files are
    asked piece by piece, without the place: after a key all but one are answered from memory.
    """

    file: str
    start: int
    text: str
    hidden: tuple[str, ...] = ()

    @property
    def span(self) -> Span:
        """Where it is in the file."""
        return Span(self.start, self.start + len(self.text))

    def chunks(self, db: Database) -> Iterator[tuple[ChunkAt, str | None]]:
        """Its chunks, seen from its start, each with the name that it defines."""
        found = piece(db, self.text, is_diffeo(self.file))
        for chunk in found.chunks:
            at = ChunkAt(self.file, chunk.start, chunk.text, is_diffeo(self.file))
            name = at.sketch(db).name
            counts = name is not None and name not in self.hidden and found.places[name][-1].start == chunk.start
            yield at, name if counts else None


def pieces_of(db: Database, file: str) -> tuple[PieceAt, ...]:
    """The pieces of a file, in order."""
    found = layout(db, file)
    again = defined_twice(db, file)
    made = []
    for number, (one, start) in enumerate(zip(found.pieces, found.starts)):
        hidden = tuple([name for name in again if name in one.texts and found.place[name] != number])
        made.append(PieceAt(file, start, one.text, hidden))
    return tuple(made)


def word_at(text: str, offset: int) -> Span:
    """The word that an offset touches; empty if there is none."""
    start = end = offset
    while start > 0 and (text[start - 1].isalnum() or text[start - 1] == "_"):
        start -= 1
    while end < len(text) and (text[end].isalnum() or text[end] == "_"):
        end += 1
    return Span(start, end)


def line_start(text: str, offset: int) -> int:
    """Where the line of an offset begins."""
    start = text.rfind("\n", 0, offset) + 1
    return text.rfind("\r", start, offset) + 1 or start


def line_end(text: str, offset: int) -> int:
    """Where the line of an offset ends."""
    end = text.find("\n", offset)
    end = len(text) if end < 0 else end
    stop = text.find("\r", offset, end)
    return end if stop < 0 else stop
