"""The type of `load("heights.csv")`: that of what the file holds; and what is wrong with a file of data."""

from __future__ import annotations

import re

from potto.data.mistakes import TITLES, DataMistake
from potto.data.values import SEPARATOR, NumberRow, RecordColumns, Shape, Sizes
from potto.diagnostics import Diagnostic, Related, declare
from potto.modules.data import data_file, path_of
from potto.modules.texts import source
from potto.reports.near import instead
from potto.source import Span
from potto.syntax import nodes
from potto.types import kinds
from potto.types.context import Inference
from potto.types.types import REAL, UNKNOWN, ArrayOf, Count, RecordName, TupleOf, Type

TEXTS = (".csv", ".tsv", ".json")
KINDS = {code: declare(code, title) for code, title in TITLES.items()}


def loaded(inference: Inference, node: nodes.Apply) -> Type:
    """The type of what a file holds."""
    given = node.arguments[0].value if len(node.arguments) == 1 else None
    if not isinstance(given, nodes.Text):
        meant = f"{given.path}.{given.name}" if isinstance(given, nodes.Member) else "heights.csv"
        help = f'write the name of a file between quotes: `load("{meant}")`'
        place, label = node.span, f"{len(node.arguments)} given"
        if given is not None:
            place, label = given.span, "not a name in quotes"
        inference.report(kinds.MISMATCH(place, "`load` takes the name of a file", label=label, help=help))
        return UNKNOWN
    found = data_file(inference.outside.db, inference.outside.file, given.text)
    if isinstance(found, DataMistake):
        inference.report(_wrong(found, given, _within(inference, found, given.text)))
        return UNKNOWN
    return type_of(found.shape, path_of(inference.outside.file, given.text))


def type_of(shape: Shape, path: str, name: str = "") -> Type:
    """The type of a kind of value: the columns of a table are a record's fields. name: of the record, if that is not
    the file's."""
    if isinstance(shape, RecordColumns):
        name = name or path.replace("\\", "/").rpartition("/")[2]
        record = RecordName(path, name, tuple(field for field, _ in shape.fields), shape.texts, shape.gaps)
        items = (type_of(item, path, f"{name}{SEPARATOR}{field}") for field, item in shape.fields)
        return TupleOf(tuple(items), record=record)
    if not isinstance(shape, Sizes):
        return REAL
    found: Type = TupleOf((REAL,) * shape.item.length) if isinstance(shape.item, NumberRow) else REAL
    for size in reversed(shape.dimensions):
        found = ArrayOf(Count(size), found)
    return found


def _within(inference: Inference, mistake: DataMistake, written: str) -> tuple[Related, ...]:
    """The place in the file of data, where that is a text."""
    if mistake.row is None or not written.lower().endswith(TEXTS):
        return ()
    path = path_of(inference.outside.file, written)
    text = source(inference.outside.db, path)
    if text is None or mistake.row > len(text.line_starts):
        return ()
    start = text.line_starts[mistake.row - 1]
    line = text.text[start:].split("\n", 1)[0].rstrip("\r")
    first, last = mistake.place or (len(line) - len(line.lstrip()), len(line.rstrip()))
    message = f"expected {mistake.expected}" if mistake.expected else "here"
    return (Related(Span(start + first, start + last), message, path, ""),)


def _wrong(mistake: DataMistake, text: nodes.Text, related: tuple[Related, ...]) -> Diagnostic:
    where = "" if mistake.row is None else f"row {mistake.row}"
    if mistake.column is not None:
        where += f"{', ' if where else ''}column {mistake.column}"
    message = mistake.message if mistake.row is None else f"{text.text}: {mistake.message}"
    folder = text.text[: len(text.text) - len(re.split(r"[/\\]", text.text)[-1])]
    return KINDS[mistake.code](
        text.span, message, label=where or "named here", related=related, help=mistake.hint,
        suggestions=instead(Span(text.span.start + 1, text.span.end - 1), [folder + name for name in mistake.meant]),
    )  # fmt: skip
