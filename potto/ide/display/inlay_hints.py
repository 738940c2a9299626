"""Inlay hints: types of parameters and local names, and the coordinates that complete a condition.

Owns `inlay_hints` and `resolve_inlay_hint`.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec.structs import replace

from potto.ide.hover.derivatives import ConditionInfo, condition_infos, condition_markdown, fence
from potto.ide.model import Edit, InlayHint
from potto.ide.names.places import ChunkAt, PieceAt, pieces_of
from potto.ide.names.symbols import parameters, placeless
from potto.modules import DefinitionTarget
from potto.modules import resolve as target_of
from potto.query import Database, query
from potto.source import Span
from potto.syntax import nodes, walk
from potto.types import (
    ArrayOf,
    Diffeo,
    Function,
    Real,
    TupleOf,
    Type,
    TypeVariable,
    Unknown,
    format_type,
    groups_of,
    interface,
    result_of,
    typed_names,
)
from potto.types.types import Count, RecordName, resolve

LONG = 60  # characters of a type beyond which a hint shows its beginning


def inlay_hints(db: Database, file: str, span: Span) -> tuple[InlayHint, ...]:
    """The hints of the places in a span, in order."""
    found: list[InlayHint] = []
    for at in pieces_of(db, file):
        if at.span.touches(span):
            moved = (_moved(hint, at.start) for hint in piece_hints(db, file, at.text, at.hidden))
            found += [hint for hint in moved if span.start <= hint.offset <= span.end]
    return tuple(found)


@query(keep=1024)
def piece_hints(db: Database, file: str, text: str, hidden: tuple[str, ...]) -> tuple[InlayHint, ...]:
    """The hints of a piece of a file, relative to it."""
    return tuple(
        [
            _moved(hint, chunk.start)
            for chunk, name in PieceAt(file, 0, text, hidden).chunks(db)
            if name is not None
            for hint in definition_hints(db, file, name)
        ]
    )


def _moved(hint: InlayHint, start: int) -> InlayHint:
    edits = tuple([Edit(edit.span.shift(start), edit.text) for edit in hint.edits])
    return replace(hint, offset=hint.offset + start, edits=edits)


@query
def definition_hints(db: Database, file: str, name: str) -> tuple[InlayHint, ...]:
    """The hints of a definition, relative to its chunk."""
    chunk = placeless(db, file, name)
    if chunk is None:
        return ()
    found = [*_types(db, chunk, name), *_result(db, chunk, name), *_conditions(db, chunk, name)]
    return tuple(sorted(found, key=lambda hint: hint.offset))


def _types(db: Database, chunk: ChunkAt, name: str) -> Iterator[InlayHint]:
    written = {p.span.start: p for group in parameters(db, chunk.file, name) for p in group}
    heads = _head_parameters(db, chunk)
    public = {p.name: p.type for group in groups_of(interface(db, chunk.file, name).type) for p in group if p.name}
    binders = {binder.span.start: binder for binder in chunk.index(db).binders}
    for typed in typed_names(db, chunk.file, name):
        binder = binders.get(typed.span.start)
        if binder is None or binder.kind not in ("parameter", "local", "loop"):
            continue
        parameter = written.get(typed.span.start)
        if parameter is not None and parameter.annotation is not None:
            continue
        type = public.get(typed.name, typed.type) if parameter is not None else typed.type
        if isinstance(type, Unknown | TypeVariable) or (binder.kind == "parameter" and parameter is None):
            continue
        if binder.kind != "parameter" and isinstance(type, Real) and not type.variables:
            continue  # a plain number: nothing to say
        text = format_type(type)
        label = f": {text if len(text) <= LONG else text[: LONG - 1] + '…'}"
        edit = Edit(Span(binder.span.end, binder.span.end), f": {text}")
        edits = (edit,) if typed.span.start in heads and _writable(db, chunk.file, type) else ()
        yield InlayHint(binder.span.end, label, "type", edits=edits, data=("type", f"{typed.name} : {text}"))


def _writable(db: Database, file: str, type: Type) -> bool:
    """Whether a type can be written in a file as it is shown: a type that may be any can't, nor can what varies."""
    match resolve(type):
        case Real(variables=variables):
            return not variables
        case TupleOf(record=RecordName() as record):
            meant = target_of(db, file, record.name) == DefinitionTarget(record.file, record.name)
            return meant and not record.dual
        case TupleOf(items=items):
            return all(_writable(db, file, item) for item in items)
        case ArrayOf(size, item):  # a size by its name may be that of another array
            return isinstance(resolve(size), Count) and _writable(db, file, item)
        case Function(parameters=parameters, result=result):
            return all(_writable(db, file, p.type) for p in parameters) and _writable(db, file, result)
        case Diffeo():
            return True
        case _:
            return False


def _head_parameters(db: Database, chunk: ChunkAt) -> frozenset[int]:
    """The parameters that may be annotated: those of a `def`."""
    item = chunk.parsed(db).item
    groups = item.groups if isinstance(item, nodes.Definition) and item.keyword else ()
    return frozenset(p.span.start for group in groups for p in group)


def _result(db: Database, chunk: ChunkAt, name: str) -> Iterator[InlayHint]:
    """The type of a definition's result, behind its head."""
    item = chunk.parsed(db).item
    if not isinstance(item, nodes.Definition) or item.result is not None:
        return
    found = interface(db, chunk.file, name)
    shown = result_of(found.type) if item.groups else found.type
    if isinstance(shown, Unknown):
        return
    text = format_type(shown)
    label = text if len(text) <= LONG else text[: LONG - 1] + "…"
    if item.groups and item.keyword:
        last = item.groups[-1]
        end = chunk.text.find(")", last[-1].span.end if last else item.name_span.end)
        if end >= 0:
            writable = _writable(db, chunk.file, shown)
            edits = (Edit(Span(end + 1, end + 1), f" -> {text}"),) if writable else ()
            yield InlayHint(end + 1, f"-> {label}", "type", True, True, edits=edits, data=("type", f"{name} : {text}"))
    elif not item.groups:
        yield InlayHint(item.name_span.end, f": {label}", "type", data=("type", f"{name} : {text}"))


def _conditions(db: Database, chunk: ChunkAt, name: str) -> Iterator[InlayHint]:
    """The coordinates that a condition leaves out, where they would be written."""
    item = chunk.parsed(db).item
    inline = {n.span: n for n in ([] if item is None else walk(item)) if isinstance(n, nodes.InlineDiffeo)}
    seen: set[int] = set()
    for number, info in enumerate(condition_infos(db, chunk.file, name)):
        if not info.missing or info.calls or info.problem:
            continue
        node = inline.get(info.span)
        end = info.span.end if node is None else node.components[-1].span.end
        if end in seen:
            continue
        seen.add(end)
        missing = f", {', '.join(info.missing)}"
        edits = () if node is None else (Edit(Span(end, end), missing),)
        data = ("condition", chunk.file, name, str(number))
        yield InlayHint(
            end, missing if node is not None else f" diffeo(…{missing})", "parameter", edits=edits, data=data
        )


def resolve_inlay_hint(db: Database, hint: InlayHint) -> InlayHint:
    """A hint with what it says when the mouse is on it."""
    match hint.data:
        case ("type", text):
            return replace(hint, tooltip=fence(text))
        case ("condition", file, name, number):
            found: tuple[ConditionInfo, ...] = condition_infos(db, file, name)
            place = int(number)
            return replace(hint, tooltip=condition_markdown(found[place])) if place < len(found) else hint
        case _:
            return hint
