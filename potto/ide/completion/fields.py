"""Completion of the parts of a value: the fields of a record, `0`, `1`, … of a tuple, `x`, `y`, `z` of a vector."""

from __future__ import annotations

from collections.abc import Iterator

from potto.ide.completion.place import Place
from potto.ide.hover.local_names import local_type
from potto.ide.model import Completion
from potto.ide.names.places import Site
from potto.ide.names.symbols import LocalSymbol
from potto.modules.graph import owner
from potto.query import Database
from potto.types import Real, TupleOf, Type, format_type, interface
from potto.types.types import resolve
from potto.types.vectors import AXES, place_in

MOST = 12  # numbered parts that are proposed


def field_items(db: Database, site: Site, place: Place, start: int) -> Iterator[Completion]:
    """What can stand behind `u.`, where `u` is a local name or a definition. start: of what is in front of the dot."""
    type = _whole(db, site, place, start)
    for name in place.path.split(".")[1:]:
        type = None if type is None else part_of(type, name)
    if isinstance(type, TupleOf):
        for number, (name, part) in enumerate(_named(type)):
            detail = format_type(part)
            yield Completion(name, "field", place.span, name, f"{number:03}", detail=detail)


def _whole(db: Database, site: Site, place: Place, start: int) -> Type | None:
    """The type of what the path begins with."""
    head, chunk = place.path.partition(".")[0], site.chunk
    if chunk is not None:
        for number, binder in chunk.index(db).visible(start - chunk.start):
            if binder.name == head:
                return resolve(local_type(db, LocalSymbol(chunk, number, binder)))
    target = owner(db, site.file, head)
    return None if target is None else resolve(interface(db, target.file, target.name).type)


def part_of(type: Type, name: str) -> Type | None:
    """The type of a part."""
    found = resolve(type)
    place = place_in(found, name)
    if not isinstance(found, TupleOf) or place is None or place >= len(found.items):
        return None
    return resolve(found.items[place])


def _named(type: TupleOf) -> Iterator[tuple[str, Type]]:
    """The parts by their names; of a vector the axes first."""
    if type.record is not None:
        yield from zip(type.record.fields, type.items)
        return
    if len(type.items) <= len(AXES) and all(isinstance(resolve(item), Real) for item in type.items):
        yield from zip(AXES, type.items)
    for number, item in enumerate(type.items[:MOST]):
        yield str(number), item
