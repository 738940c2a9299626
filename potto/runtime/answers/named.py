"""Records as answers: tuples that know the names of their parts, and are shown as programs write them.

Owns `Named`, which `named` makes by a type and `alike` of another one, and `WithFields` for answers that may be such.
What is evaluated is tuples; the type of an answer says which of them are records.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from potto.types.types import ArrayOf, TupleOf, Type


class Named(tuple[Any, ...]):
    """The parts of a record, by their places or by their names. `record` is empty for the columns of a file."""

    record: str
    fields: tuple[str, ...]

    def __new__(cls, record: str, fields: tuple[str, ...], parts: Iterable[Any]) -> Named:
        made = super().__new__(cls, parts)
        made.record, made.fields = record, fields
        return made

    def __getattr__(self, name: str) -> Any:
        if name in self.__dict__.get("fields", ()):
            return self[self.fields.index(name)]
        raise AttributeError(f"a record `{self.__dict__.get('record', '')}` has no field `{name}`")

    def __reduce__(self) -> tuple[Any, ...]:
        return Named, (self.record, self.fields, tuple(self))

    def __repr__(self) -> str:
        return self.written([repr(part) for part in self])

    def written(self, parts: Iterable[str]) -> str:
        """`Camera(eye=(0, 0, -5), focal=1.5)`, of its parts as texts."""
        return f"{self.record}({', '.join(f'{n}={part}' for n, part in zip(self.fields, parts, strict=True))})"


def alike(whole: tuple[Any, ...], parts: Iterable[Any]) -> tuple[Any, ...]:
    """Other parts with the names that a tuple has, if any."""
    return Named(whole.record, whole.fields, parts) if isinstance(whole, Named) else tuple(parts)


class WithFields:
    """An answer, whose parts can be taken by their names where it is a record."""

    __slots__ = ()

    def __getattr__(self, name: str) -> Any:
        own: tuple[str, ...] = getattr(type(self), "__struct_fields__", ())  # which an answer lacks while it is made
        parts = None if name.startswith("_") or name in own else self._parts
        if isinstance(parts, Named) and name in parts.fields:
            return self._part(parts.fields.index(name))
        of = f"a record `{parts.record}`" if isinstance(parts, Named) else "an answer"
        raise AttributeError(f"{of} has no attribute {name!r}", name=name, obj=self)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *getattr(self._parts, "fields", ())]


def named(value: Any, type: Type) -> Any:
    """A value of a type, with what is a record in it by its names; also one whose records are dicts."""
    if not has_records(type):
        return value
    if isinstance(value, dict) and isinstance(type, TupleOf) and type.record is not None:
        value = tuple([value[field] for field in type.record.fields])
    if isinstance(type, TupleOf) and isinstance(value, tuple) and len(value) == len(type.items):
        parts = [named(part, item) for part, item in zip(value, type.items, strict=True)]
        return tuple(parts) if type.record is None else Named(_called(type.record.name), type.record.fields, parts)
    if isinstance(type, ArrayOf) and isinstance(value, list):
        return [named(item, type.item) for item in value]
    return value


def has_records(type: Type) -> bool:
    """Whether what is of a type is a record, or has some in it."""
    match type:
        case TupleOf(items=items, record=record):
            return record is not None or any(map(has_records, items))
        case ArrayOf(item=item):
            return has_records(item)
        case _:
            return False


def _called(name: str) -> str:
    """What a program calls a record; the columns of a file have no name that it could write."""
    return name if name.isidentifier() else ""
