"""Records as answers: tuples that know the names of their parts, and are shown as programs write them.

Owns `Named`, which `records` makes by a type and `alike` of another one, and `WithFields` for answers that may be such.
What is evaluated is tuples.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


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
