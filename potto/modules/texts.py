"""Files to chunks to definitions: what is where, at the grain of a definition.

Inputs: `("file", key)`, the text on disk (None: no such file; an `Unreadable` otherwise), and `("overlay", key)`, the
text of an open editor, which wins. A key is a normalized absolute path or a pseudo name such as `<In 3>`.

A file is read in pieces of some dozens of chunks; an edit changes one or two of them. `layout`, which puts them
together, runs at every edit of its file; what others read are projections of it that stand still: the table `texts`,
read by entry, so that an edit of one definition is no change to what is read of another, and `outline`.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import accumulate
from typing import Literal

from msgspec import Struct
from msgspec.structs import replace

from potto.modules.free import References, references_in
from potto.modules.grouping import grouped
from potto.query import Database, Parted, query
from potto.source import SourceText, Span
from potto.syntax import Chunk, ParsedChunk, defined_name, nodes, parse_chunk, split
from potto.syntax import pieces as cut

Importing = nodes.FromImport | nodes.Import
GROUP, MOST_OF_GROUP = 8, 24  # pieces in the mean, and at most


class Unreadable(Struct, frozen=True):
    """A file that is there but has no text for us. `offset` counts bytes (for "not text")."""

    reason: Literal["folder", "not a file", "not text", "too large", "no access"]
    detail: str = ""
    offset: int = 0


ChunkRef = Chunk


class StatementRef(Struct, frozen=True):
    """A top-level statement of a script; its spans are relative to `start`. broken: the parser had to guess at it."""

    start: int
    statement: nodes.Print | nodes.For | nodes.ExpressionStatement
    broken: bool = False


class Head(Struct, frozen=True):
    """What others need to know of a chunk without its tree. `importing` has spans relative to the chunk."""

    kind: Literal["blank", "import", "definition", "statement", "broken"]
    name: str | None = None
    name_span: Span | None = None
    importing: Importing | None = None


class DefinitionPlace(Struct, frozen=True):
    """The chunk that defines a name; `span` is the name's, relative to the chunk."""

    start: int
    span: Span


class Piece(Struct, frozen=True):
    """Some neighbouring chunks by what they are; all positions are relative to the piece. The last place of a name is
    that of the chunk in `texts`."""

    text: str
    chunks: tuple[ChunkRef, ...]
    texts: Mapping[str, str]
    places: Mapping[str, tuple[DefinitionPlace, ...]]
    imports: tuple[ChunkRef, ...]
    statements: tuple[ChunkRef, ...]
    definitions: int
    nameless: bool


class FileLayout(Struct, frozen=True):
    """A file in pieces, the place where each starts, and the piece that has the definition of a name which counts."""

    pieces: tuple[Piece, ...]
    starts: tuple[int, ...]
    place: Mapping[str, int]


def is_diffeo(file: str) -> bool:
    """Whether the file's definitions are diffeomorphisms."""
    return file.endswith(".diffeo")


@query
def content(db: Database, file: str) -> str | Unreadable | None:
    """The text that counts: an open editor's, else that on disk."""
    return _content(db, file)


def _content(db: Database, file: str) -> str | Unreadable | None:
    overlay: str | None = db.get_input(("overlay", file))
    if overlay is not None:
        return overlay
    on_disk: str | Unreadable | None = db.get_input(("file", file))
    return on_disk


@query
def source(db: Database, file: str) -> SourceText | None:
    """The text of a file, or None if there is none to be had."""
    text = content(db, file)
    return SourceText(file, text) if isinstance(text, str) else None


@query(travels=True, cuts=True)
def problem(db: Database, file: str) -> Unreadable | None:
    """Why a file that is there has no text. Stands still while the text is edited."""
    text = content(db, file)
    return text if isinstance(text, Unreadable) else None


@query(travels=True, cuts=True)
def exists(db: Database, file: str) -> bool:
    """Whether there is such a file that an import could mean. Mostly there is none, so nothing is kept but this."""
    text = _content(db, file)
    return isinstance(text, str) or (isinstance(text, Unreadable) and text.reason not in ("folder", "not a file"))


@query
def pieces(db: Database, file: str) -> tuple[str, ...]:
    """The text of a file in pieces, mostly the same ones as before an edit."""
    text = content(db, file)
    return cut(text, db.former(pieces, (file,)) or ()) if isinstance(text, str) else ()


@query
def groups_of_pieces(db: Database, file: str) -> tuple[tuple[str, ...], ...]:
    """The pieces of a file in groups, mostly the same ones as before an edit."""
    found = pieces(db, file)
    return tuple(grouped(found, list(map(hash, found)), GROUP, MOST_OF_GROUP))


@query
def chunks(db: Database, file: str) -> tuple[ChunkRef, ...]:
    """The chunks of a file, in order, with their absolute starts. They move at every edit: what looks at all of a file
    after each key goes piece by piece instead."""
    found = layout(db, file)
    return tuple([at(chunk, start) for piece, start in zip(found.pieces, found.starts) for chunk in piece.chunks])


def at(chunk: ChunkRef, start: int) -> ChunkRef:
    """A chunk of a piece that starts somewhere in a file."""
    return Chunk(start + chunk.start, chunk.text)


@query(keep=512)
def parsed(db: Database, text: str, diffeo: bool) -> ParsedChunk:
    """The tree of a chunk's text. Keyed by the text alone: an undo parses nothing."""
    return parse_chunk(text, diffeo)


@query(keep=4096)
def head(db: Database, text: str, diffeo: bool) -> Head:
    """What a chunk is and what it names. Small, so that more of them are kept than of trees."""
    described = _described(text)
    if described is not None:
        return described
    item = parsed(db, text, diffeo).item
    match item:
        case None:
            return Head("blank")
        case nodes.Definition() | nodes.DiffeoDefinition() | nodes.RecordDefinition():
            return Head("definition", item.name, item.name_span)
        case nodes.FromImport() | nodes.Import():
            return Head("import", importing=item)
        case nodes.BrokenItem():
            return Head("broken", item.name, item.span)
        case _:
            return Head("statement")


def _described(text: str) -> Head | None:
    """What a chunk is if its first line says so, as mostly: that takes no tree, and no longer than to look it up."""
    defined = defined_name(text)
    return None if defined is None else Head("definition", *defined)


@query(keep=2048)
def chunk_references(db: Database, text: str, diffeo: bool) -> References:
    """What a chunk refers to. Keyed by the text alone: who is analysed again has not to be walked through again."""
    item = parsed(db, text, diffeo).item
    return References() if item is None else references_in(item)


class FileOutline(Struct, frozen=True):
    """What of a file's layout no body edit and no move changes. `nameless`: a broken chunk might define anything."""

    names: tuple[str, ...]
    nameless: bool


@query(keep=512)
def piece(db: Database, text: str, diffeo: bool) -> Piece:
    """What a piece of a file holds."""
    definitions, nameless = 0, False
    texts: dict[str, str] = {}
    places: dict[str, tuple[DefinitionPlace, ...]] = {}
    imports: list[ChunkRef] = []
    statements: list[ChunkRef] = []
    found = split(text)
    for chunk in found:
        described = _described(chunk.text) or head(db, chunk.text, diffeo)
        if described.name is not None and described.name_span is not None:
            name = described.name
            texts[name] = chunk.text
            definitions += 1
            places[name] = (*places.get(name, ()), DefinitionPlace(chunk.start, described.name_span))
        elif described.kind == "import":
            imports.append(chunk)
        elif described.kind == "statement":
            statements.append(chunk)
        elif described.kind == "broken":
            nameless = True
    return Piece(text, found, texts, places, tuple(imports), tuple(statements), definitions, nameless)


@query(keep=128)
def _group(db: Database, group: tuple[str, ...], diffeo: bool) -> tuple[Piece, ...]:
    """What a group of pieces holds."""
    return tuple([piece(db, text, diffeo) for text in group])


@query
def layout(db: Database, file: str) -> FileLayout:
    """What is where in a file. Read the projections below instead, they stand still."""
    diffeo = is_diffeo(file)
    found = tuple([one for group in groups_of_pieces(db, file) for one in _group(db, group, diffeo)])
    starts = accumulate([len(one.text) for one in found[:-1]], initial=0) if found else ()
    return FileLayout(found, tuple(starts), _place(found, db.former(layout, (file,))))


def _place(found: tuple[Piece, ...], former: FileLayout | None) -> Mapping[str, int]:
    """The piece that has the definition of each name, which most edits leave as it was."""
    if former is not None and len(former.pieces) == len(found):
        pairs = zip(found, former.pieces)
        if all(one is old or tuple(one.texts) == tuple(old.texts) for one, old in pairs):
            return former.place
    place: dict[str, int] = {}
    for number, one in enumerate(found):
        place.update(dict.fromkeys(one.texts, number))
    return place


@query(travels=True)
def texts(db: Database, file: str) -> Parted:
    """The chunk that defines each name; a table, to be read by entry."""
    found = layout(db, file)
    return Parted(tuple([one.texts for one in found.pieces]), found.place)


@query(travels=True, cuts=True)
def outline(db: Database, file: str) -> FileOutline:
    """What a file defines, without places."""
    found = layout(db, file)
    return FileOutline(tuple(found.place), any(piece.nameless for piece in found.pieces))


@query(travels=True)
def names(db: Database, file: str) -> tuple[str, ...]:
    """What the file defines, in order, also where the definition is broken."""
    return outline(db, file).names


def chunk_text(db: Database, file: str, name: str) -> str | None:
    """The text of the chunk that defines `name`; the last one if there are several."""
    return db.entry(texts, (file,), name)


def chunk_start(db: Database, file: str, name: str) -> int:
    """Where the chunk that defines `name` starts. Whoever shows spans adds it; no memoized value should read it."""
    found = layout(db, file)
    place = found.place.get(name)
    return 0 if place is None else found.starts[place] + found.pieces[place].places[name][-1].start


def places(db: Database, file: str, name: str) -> tuple[DefinitionPlace, ...]:
    """Where a name is defined in a file, each time; absolute."""
    found = layout(db, file)
    return tuple(
        [
            DefinitionPlace(start + place.start, place.span)
            for piece, start in zip(found.pieces, found.starts)
            for place in piece.places.get(name, ())
        ]
    )


def defined_twice(db: Database, file: str) -> tuple[str, ...]:
    """The names that a file defines more than once, in order."""
    found = layout(db, file)
    defined = sum([piece.definitions for piece in found.pieces])
    return () if defined == len(found.place) else tuple([n for n in found.place if len(places(db, file, n)) > 1])


@query
def definition(db: Database, file: str, name: str) -> nodes.Definition | nodes.DiffeoDefinition | None:
    """The definition of a name in a file (the last one if there are several), its spans relative to its chunk.

    None if there is none, and for one whose head cannot be read (`names` has it all the same).
    """
    text = chunk_text(db, file, name)
    item = None if text is None else parsed(db, text, is_diffeo(file)).item
    if isinstance(item, nodes.RecordDefinition):
        return _maker(item)
    return item if isinstance(item, (nodes.Definition, nodes.DiffeoDefinition)) else None


def _maker(item: nodes.RecordDefinition) -> nodes.Definition:
    """A record as the function of its fields that its name stands for; what it gives is called as it is."""
    fields = tuple(nodes.Parameter(f.span, f.name, f.annotation and _starred(f.annotation)) for f in item.fields)
    values = tuple(nodes.Name(field.span, field.name) for field in fields)
    made = nodes.NamedType(item.name_span, item.name)
    return nodes.Definition(
        item.span, item.name, item.name_span, (fields,), made, (), nodes.Tuple(item.span, values), True
    )


def _starred(annotation: nodes.TypeExpr) -> nodes.TypeExpr:
    """The type of a field as that of a parameter: a record also holds what varies."""
    match annotation:
        case nodes.RealType():
            return replace(annotation, star=True)
        case nodes.TupleType(items=items):
            return replace(annotation, items=tuple(map(_starred, items)))
        case nodes.ArrayType(item=item):
            return replace(annotation, item=_starred(item))
        case _:
            return annotation


@query
def statements(db: Database, file: str) -> tuple[StatementRef, ...]:
    """The top-level statements of a script, in order."""
    found: list[StatementRef] = []
    whole = layout(db, file)
    for piece, start in zip(whole.pieces, whole.starts):
        for chunk in piece.statements:
            read = parsed(db, chunk.text, is_diffeo(file))
            if isinstance(read.item, (nodes.Print, nodes.For, nodes.ExpressionStatement)):
                broken = any(d.severity == "error" for d in read.diagnostics)
                found.append(StatementRef(start + chunk.start, read.item, broken))
    return tuple(found)


@query(cuts=True)
def imports(db: Database, file: str) -> tuple[Importing, ...]:
    """The imports of a file in order, their spans relative to their chunks: moving them changes nothing."""
    items = (head(db, text, is_diffeo(file)).importing for text in import_texts(db, file))
    return tuple(item for item in items if item is not None)


@query(travels=True, cuts=True)
def import_texts(db: Database, file: str) -> tuple[str, ...]:
    """The chunks of a file that import. Only pieces with a word for it are cut into chunks: of the files that others
    import from, however far, mostly the beginnings are read."""
    diffeo = is_diffeo(file)
    return tuple([text for group in groups_of_pieces(db, file) for text in _import_texts(db, group, diffeo)])


@query(keep=128)
def _import_texts(db: Database, group: tuple[str, ...], diffeo: bool) -> tuple[str, ...]:
    """The chunks of a group of pieces that import. Each has one of the words as its first, however broken it is."""
    importing = [text for text in group if "import" in text or "from" in text]
    return tuple([chunk.text for text in importing for chunk in piece(db, text, diffeo).imports])


def import_starts(db: Database, file: str) -> tuple[int, ...]:
    """Where the chunks of `imports` start."""
    found = layout(db, file)
    return tuple([start + one.start for piece, start in zip(found.pieces, found.starts) for one in piece.imports])
