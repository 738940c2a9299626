"""Completion of the parts of a value: the fields of a record, `0`, `1`, … of a tuple, `x`, `y`, `z` of a vector.

Owns `part_items`, for what follows a dot, and `changed_items`, for what follows `with`. What stands in front may be any
expression; it is read by itself, as what is being typed behind it may not be read yet.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from potto.ide.completion.place import CompletionPlace, operand_start
from potto.ide.hover.local_names import local_type
from potto.ide.model import Completion
from potto.ide.names.places import Site
from potto.ide.names.symbols import LocalSymbol
from potto.query import Database
from potto.source import Span
from potto.syntax import parse_expression
from potto.types import Real, TupleOf, Type, format_type, infer_expression
from potto.types.types import AXES, resolve

MOST = 12  # numbered parts that are proposed
_WITH = re.compile(r"\bwith\s+(?=\w*$|\(|\w+\s*=)")
_GIVEN = re.compile(r"(?:^|[(,])\s*([^\W\d]\w*)\s*=(?!=)")


def part_items(db: Database, site: Site, place: CompletionPlace) -> Iterator[Completion]:
    """What can stand behind `u.`."""
    type = _before(db, site, place.span.start - 1)
    if isinstance(type, TupleOf):
        for number, (name, part) in enumerate(_named(type)):
            detail = format_type(part)
            yield Completion(name, "field", place.span, name, f"{number:03}", detail=detail)


def changed_items(db: Database, site: Site, place: CompletionPlace) -> Iterator[Completion]:
    """The fields of a record that can stand after `with`, except for those already given."""
    found = changed_at(site.text, place.span.start)
    if found is None or found[2]:
        return
    type = _before(db, site, found[0])
    if isinstance(type, TupleOf) and type.record is not None:
        for number, (name, item) in enumerate(zip(type.record.fields, type.items)):
            if name not in found[1]:
                text, detail = f"{name} = ", format_type(item)
                yield Completion(name, "field", place.span, text, f"{number:03}", name, detail=detail)


def changed_at(text: str, offset: int) -> tuple[int, tuple[str, ...], str] | None:
    """The `with` that an offset follows: where the record before it ends, the fields given so far, and the one whose
    value is being written."""
    line = text[text.rfind("\n", 0, offset) + 1 : offset]
    for found in reversed(list(_WITH.finditer(line))):
        rest = line[found.end() :]
        inner = rest[1:] if rest.startswith("(") else rest
        depth = lowest = last = 0
        for place, char in enumerate(inner):
            depth += (char in "([") - (char in ")]")
            lowest = min(lowest, depth)
            last = place + 1 if char == "," and depth == 0 else last
        if lowest < 0 or depth > 0 or (not rest.startswith("(") and last):
            continue  # closed, or within something else
        given = tuple(_GIVEN.findall(_flat(inner)))
        current = _GIVEN.match(inner[last:])
        end = offset - len(line) + len(line[: found.start()].rstrip())
        return end, given, "" if current is None else current[1]
    return None


def _flat(text: str) -> str:
    """A text without what stands in brackets."""
    out, depth = "", 0
    for char in text:
        depth += (char in "([") - (char in ")]")
        out += char if depth == 0 else ""
    return out


def whole_type(db: Database, site: Site, span: Span) -> Type | None:
    """The type of an expression that stands at a place, with the local names that it uses."""
    written = parse_expression(site.text[span.start : span.end])
    if written.diagnostics:
        return None
    locals: list[tuple[str, Type]] = []
    words = set(re.findall(r"[^\W\d]\w*", site.text[span.start : span.end]))
    if site.chunk is not None:
        chunk = site.chunk
        for number, binder in chunk.index(db).visible(span.start - chunk.start):
            if binder.name in words:
                locals.append((binder.name, local_type(db, LocalSymbol(chunk, number, binder))))
    return resolve(infer_expression(db, site.file, written.expr, tuple(locals)).type)


def _before(db: Database, site: Site, end: int) -> Type | None:
    start = operand_start(site.text, end)
    return None if start is None else whole_type(db, site, Span(start, end))


def _named(type: TupleOf) -> Iterator[tuple[str, Type]]:
    """The parts by their names; of a vector the axes first."""
    if type.record is not None:
        yield from zip(type.record.fields, type.items)
        return
    if len(type.items) <= len(AXES) and all(isinstance(resolve(item), Real) for item in type.items):
        yield from zip(AXES, type.items)
    for number, item in enumerate(type.items[:MOST]):
        yield str(number), item
