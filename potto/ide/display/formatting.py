"""Formatting as small edits, so that cursors, folds and breakpoints stay where they are.

Owns `format_document`, `format_range` and `format_on_type`. The layout is that of `potto.syntax.format_source`.
"""

from __future__ import annotations

from potto.ide.actions.edits import minimal
from potto.ide.model import Edit
from potto.ide.names.places import ChunkAt, all_chunks, chunk_at, line_end, line_start, pieces_of, text_of
from potto.modules import is_diffeo
from potto.modules.texts import piece
from potto.query import Database, query
from potto.source import Span
from potto.syntax import format_source, nodes

_INDENT = "    "
_MOST_BLANK_LINES = 2


def format_document(db: Database, file: str) -> tuple[Edit, ...]:
    """The edits that lay out a file."""
    whole = format_at_once(db, file)
    if whole is not None:
        return whole
    found: list[Edit] = []
    for number, at in enumerate(pieces := pieces_of(db, file), 1):
        edits = piece_edits(db, at.text, is_diffeo(file), number == 1, number == len(pieces))
        found += [Edit(edit.span.shift(at.start), edit.text) for edit in edits]
    return tuple(found)


def format_at_once(db: Database, file: str) -> tuple[Edit, ...] | None:
    """The edits of a file in which every line moves, or that is blank; None for any other file."""
    text = text_of(db, file)
    if "\r" not in text and not text.startswith("\ufeff") and not text.isspace():
        return None
    mark = len(text) - len(text.removeprefix("\ufeff"))
    return minimal(text[mark:], format_source(text, is_diffeo(file)), mark)


@query(keep=1024)
def piece_edits(db: Database, text: str, diffeo: bool, first: bool, last: bool) -> tuple[Edit, ...]:
    """The edits that format a piece of a file, relative to it: its chunks, and the blank lines after each."""
    edits: list[Edit] = []
    chunks = piece(db, text, diffeo).chunks
    if first and chunks:
        edits += _gap(text, 0, chunks[0].start, "")
    for number, chunk in enumerate(chunks, 1):
        found, end = chunk_edits(db, chunk.text, diffeo), chunk.start + len(chunk.text)
        edits += [Edit(edit.span.shift(chunk.start), edit.text) for edit in found]
        if last and number == len(chunks):
            edits += _gap(text, end, len(text), "\n")
        else:
            after = chunks[number].start if number < len(chunks) else len(text)
            blank_lines = text.count("\n", end, after) - 1
            edits += _gap(text, end, after, "\n" * (1 + min(max(blank_lines, 0), _MOST_BLANK_LINES)))
    return tuple(edits)


def _gap(text: str, start: int, end: int, wanted: str) -> tuple[Edit, ...]:
    """What stands between two chunks, as it should be."""
    return () if text[start:end] == wanted else (Edit(Span(start, end), wanted),)


@query(keep=4096)
def laid_out(db: Database, text: str, diffeo: bool) -> str:
    """The formatted text of a chunk. It is kept, so that formatting a file again costs only what has changed."""
    return format_source(text, diffeo).rstrip("\r\n")


@query(keep=4096)
def chunk_edits(db: Database, text: str, diffeo: bool) -> tuple[Edit, ...]:
    """The edits that lay out a chunk's text, relative to it."""
    return minimal(text, laid_out(db, text, diffeo))


def format_range(db: Database, file: str, span: Span) -> tuple[Edit, ...]:
    """The edits that lay out the definitions that a span touches."""
    edits: list[Edit] = []
    for chunk in all_chunks(db, file, span):
        if chunk.start <= span.end and span.start <= chunk.start + len(chunk.text):
            edits += _chunk(db, chunk)
    return tuple(edits)


def _chunk(db: Database, chunk: ChunkAt) -> tuple[Edit, ...]:
    found = chunk_edits(db, chunk.text, chunk.diffeo)
    return tuple([Edit(chunk.absolute(edit.span), edit.text) for edit in found]) if found else ()


def format_on_type(db: Database, file: str, offset: int, typed: str) -> tuple[Edit, ...]:
    """What to change when a line's end or a closing bracket has just been typed in front of `offset`.

    A new line gets the indentation of a block where a head or an open bracket asks for one; the line above it is laid
    out where its definition can be read. A closing bracket goes where the line that opened it begins.
    """
    text = text_of(db, file)
    offset = min(offset, len(text))
    if typed == "\n":
        return _new_line(db, file, text, offset)
    if typed in (")", "]"):
        return _closer(text, offset, typed)
    return ()


def _new_line(db: Database, file: str, text: str, offset: int) -> tuple[Edit, ...]:
    start = line_start(text, offset)
    blanks = text[start : line_end(text, start)]
    if blanks.strip() or start == 0:
        return ()
    chunk = chunk_at(db, file, start - 1)
    if chunk is None:
        return ()
    above = Span(line_start(text, start - 1), start)
    before = text[above.start : above.end].rstrip("\r\n")
    edits = [e for e in _chunk(db, chunk) if above.start <= e.span.start and e.span.end < above.end]
    wanted = _indent_after(db, chunk, before, start)
    if wanted is not None and wanted != blanks:
        edits.append(Edit(Span(start, start + len(blanks)), wanted))
    return tuple(edits)


def _indent_after(db: Database, chunk: ChunkAt, line: str, start: int) -> str | None:
    """The indentation of the line after `line`; None to leave it as the editor has it."""
    code = line.partition("#")[0].rstrip()
    if not code.strip():
        return None
    own = code[: len(code) - len(code.lstrip())]
    item = chunk.parsed(db).item
    opened = code.count("(") + code.count("[") - code.count(")") - code.count("]")
    if opened > 0:
        return own + _INDENT
    headed = isinstance(item, nodes.Definition) and item.keyword and len(own) == 0 and code.startswith("def")
    body_on_line = isinstance(item, nodes.Definition) and item.body.span.start < start - chunk.start - 1
    body_on_line = body_on_line and isinstance(item, nodes.Definition) and len(item.body.span) > 0
    if (headed and not body_on_line) or (code.lstrip().startswith("for ") and code.endswith(":")):
        return own + _INDENT
    return None


def _closer(text: str, offset: int, typed: str) -> tuple[Edit, ...]:
    """A closing bracket alone on its line goes under the line that opened it."""
    start = line_start(text, offset)
    if text[start : offset - 1].strip() or text[offset - 1 : offset] != typed:
        return ()
    depth = 0
    for position in range(offset - 2, -1, -1):
        char = text[position]
        if char in ")]":
            depth += 1
        elif char in "([":
            if depth == 0:
                line = text[line_start(text, position) : position]
                wanted = line[: len(line) - len(line.lstrip())]
                blanks = text[start : offset - 1]
                return () if wanted == blanks or not wanted else (Edit(Span(start, offset - 1), wanted),)
            depth -= 1
    return ()


__all__ = ["format_document", "format_on_type", "format_range"]
