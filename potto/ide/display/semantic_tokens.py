"""Semantic tokens: every word with what it means. Owns `semantic_tokens`.

Modifiers say what matters here: `integration` for variables of integration, `plain` for parameters that must not vary,
`diffeo` for diffeomorphisms, `defaultLibrary` for builtins, `readonly` for what is never assigned (all names).
"""

from __future__ import annotations

from collections.abc import Iterator

from potto.ide.model import SemanticToken
from potto.ide.names.descriptions import written_kind
from potto.ide.names.index import BoundName, Occurrence
from potto.ide.names.keywords import SPECIALS, TYPES
from potto.ide.names.parts import is_part, occurrences
from potto.ide.names.places import ChunkAt, all_chunks, owner
from potto.ide.names.symbols import (
    BuiltinSymbol,
    DefinitionSymbol,
    LocalSymbol,
    MeasureSymbol,
    ModuleSymbol,
    PartSymbol,
    meaning_of,
    placeless,
)
from potto.modules import is_diffeo
from potto.query import Database, query
from potto.source import Span
from potto.syntax import live_expressions, tokenize
from potto.types import Function, interface, typed_names

_OPERATORS = frozenset({"BINOP", "SIGN", "STAR", "ARROW", "TILDE", "QMARK", "EQ", "LAMBDA", "DOTDOT"})
_WORDS = frozenset(
    {"DEF", "FOR", "IN", "IF", "THEN", "ELSE", "LET", "NOT", "INTEGRAL", "SUM", "DIFFEO", "DIFFEODEF", "FROM", "IMPORT",
     "AS", "INVERSE", "WHERE", "D", "PRINT", "FOLD", "WITH", "RECORDDEF"}
)  # fmt: skip


def semantic_tokens(db: Database, file: str, span: Span | None = None) -> tuple[SemanticToken, ...]:
    """The coloured words of a file, or of what touches a span, in order and without overlaps."""
    found: list[SemanticToken] = []
    for chunk in all_chunks(db, file, span):
        name = owner(db, chunk)
        words = loose_words(db, file, chunk.text) if name is None else definition_words(db, file, name)
        for start, end, type, modifiers in words:
            place = Span(chunk.start + start, chunk.start + end)
            if span is None or (place.start < span.end and span.start < place.end):
                found.append(SemanticToken(place, type, modifiers))
    return tuple(found)


Word = tuple[int, int, str, tuple[str, ...]]


@query
def definition_words(db: Database, file: str, name: str) -> tuple[Word, ...]:
    """The coloured words of a definition, relative to its chunk. After an edit elsewhere they come from memory."""
    chunk = placeless(db, file, name)
    return () if chunk is None else tuple(_coloured(db, chunk, name))


@query(keep=8192)
def loose_words(db: Database, file: str, text: str) -> tuple[Word, ...]:
    """The coloured words of a statement, an import, a comment, or a definition that doesn't count."""
    return tuple(_coloured(db, ChunkAt(file, 0, text, is_diffeo(file))))


def _coloured(db: Database, chunk: ChunkAt, name: str | None = None) -> list[Word]:
    names: dict[int, Word] = {}
    plain = frozenset() if name is None else frozenset(interface(db, chunk.file, name).plain)
    functions = frozenset() if name is None else functions_in(db, chunk.file, name)
    for occurrence in occurrences(db, chunk):
        coloured = _name(db, chunk, occurrence, plain, functions)
        if coloured is not None:
            names[occurrence.span.start] = (occurrence.span.start, occurrence.span.end, *coloured)
    merged = sorted((*plain_words(db, chunk.text, chunk.diffeo), *names.values()), key=lambda word: (word[0], word[1]))
    out: list[Word] = []
    for word in merged:
        if out and word[0] < out[-1][1]:
            if word[0] in names:
                out[-1] = names[word[0]]
            continue
        out.append(word)
    return out


@query(keep=8192)
def plain_words(db: Database, text: str, diffeo: bool) -> tuple[Word, ...]:
    """The words of a chunk that are not names; a live expression in its comments is coloured as code."""
    live = live_expressions(text) if "#>" in text else ()
    found: list[Word] = []
    for token in tokenize(text, diffeo):
        if token.kind != "COMMENT":
            found += _word(token.kind, token.text, token.start)
        elif any(asked.span.start <= token.start < asked.span.end for asked in live):
            head = len(token.text) - len(token.text[2:].lstrip())
            found.append((token.start, token.start + head, "comment", ("documentation",)))
        else:
            found.append((token.start, token.start + len(token.text.rstrip("\r")), "comment", ()))
    for asked in live:
        for inner in tokenize(asked.text):
            found += _word(inner.kind, inner.text, asked.text_span.start + inner.start)
    return tuple(sorted(found))


def _word(kind: str, text: str, start: int) -> Iterator[Word]:
    end = start + len(text)
    if "\n" in text or not text:
        return
    if kind in _WORDS or text in ("and", "or", "print"):
        yield start, end, "keyword", ()
    elif kind in _OPERATORS:
        yield start, end, "operator", ()
    elif kind == "NUMBER":
        yield start, end, "number", ()
    elif text in TYPES:  # a name that is called so is taken for what it means
        yield start, end, "type", ("defaultLibrary",)


def _name(
    db: Database, chunk: ChunkAt, occurrence: Occurrence, plain: frozenset[str], functions: frozenset[int]
) -> tuple[str, tuple[str, ...]] | None:
    if occurrence.role == "keyword" or is_part(db, chunk.file, occurrence):
        return "property", ()
    symbol = meaning_of(db, chunk, occurrence)
    made: tuple[str, ...] = ("declaration",) if occurrence.role in ("bind", "define", "alias") else ()
    match symbol:
        case LocalSymbol(where) if where.sketch(db).record:
            return "property", made
        case LocalSymbol(_, _, binder):
            return _local(binder, made, plain, functions)
        case DefinitionSymbol(file, name):
            kind = written_kind(db, file, name)
            made = (*made, "definition") if occurrence.role == "define" else made
            if kind == "record":
                return "type", made
            if kind == "diffeo":
                return "function", (*made, "readonly", "diffeo")
            return ("variable" if kind == "constant" else "function"), (*made, "readonly")
        case ModuleSymbol():
            return "namespace", made
        case BuiltinSymbol(name):
            constant = name in SPECIALS and "->" not in SPECIALS[name].type
            return ("variable" if constant else "function"), ("readonly", "defaultLibrary")
        case MeasureSymbol():
            return "type", ("defaultLibrary",)
        case PartSymbol():
            return "property", ()
        case None:
            return _unknown(occurrence)


def _unknown(occurrence: Occurrence) -> tuple[str, tuple[str, ...]] | None:
    return ("namespace", ()) if occurrence.role in ("module", "path") else ("variable", ())


def _local(
    binder: BoundName, made: tuple[str, ...], plain: frozenset[str], functions: frozenset[int]
) -> tuple[str, tuple[str, ...]]:
    if binder.kind in ("variable", "index"):
        return "variable", (*made, "readonly", *(("integration",) if binder.kind == "variable" else ()))
    if binder.kind != "parameter":
        return "variable", (*made, "readonly")
    type = "function" if binder.span.start in functions else "parameter"
    return type, (*made, "readonly", *(("plain",) if binder.name in plain else ()))


@query
def functions_in(db: Database, file: str, name: str) -> frozenset[int]:
    """Where a definition binds names that are functions."""
    return frozenset(t.span.start for t in typed_names(db, file, name) if isinstance(t.type, Function))
