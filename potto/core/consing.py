"""One object for equal terms, and what it is called in every run.

Owns `Base`, `make` and the table of the terms that are alive. A term stands in it under its type and its fields, where
subterms are told by identity; the digest of its content is only made when somebody asks for it.
"""

from __future__ import annotations

import threading
import weakref
from collections.abc import Iterator
from functools import singledispatch
from typing import Any, TypeVar

from msgspec import Struct
from msgspec.structs import force_setattr

from potto.digests import blake2b


class Base(Struct, frozen=True, eq=False, weakref=True):
    free: frozenset[str]
    _digest: bytes | None

    @property
    def digest(self) -> bytes:
        """Of the content, the same in every run; made when it is first asked for."""
        return self._digest or _digested(self)

    def __repr__(self) -> str:
        """The kind and the text, cut short: a shared term may be a small object and an endless text."""
        return f"<{type(self).__name__} {short_text(self)}>"


@singledispatch
def short_text(term: Base) -> str:
    """The beginning of a term's text. The printer, which knows the kinds of terms, says what that is."""
    return "…"


T = TypeVar("T", bound=Base)


def own_fields(kind: type[Base]) -> tuple[str, ...]:
    """The names of the fields that make a term of this kind what it is."""
    return kind.__struct_fields__[len(Base.__struct_fields__) :]


class _Entry(weakref.ref[Any]):
    """A term that is held weakly, and the key under which it stands."""

    __slots__ = ("key",)
    key: tuple[object, ...]


_table: dict[tuple[object, ...], _Entry] = {}
_lock = threading.RLock()  # a collection within it may end terms


def _end(entry: _Entry) -> None:
    with _lock:
        if _table.get(entry.key) is entry:
            del _table[entry.key]


def make(cls: type[T], free: frozenset[str], *fields: object) -> T:
    return made(cls, (cls, *fields), free, fields)


def made(cls: type[T], key: tuple[object, ...], free: frozenset[str], fields: tuple[object, ...]) -> T:
    """The one term of this key. Keys hold subterms, which live as long as the term and are told by identity."""
    entry = _table.get(key)
    found: T | None = None if entry is None else entry()
    if found is not None:
        return found
    with _lock:
        entry = _table.get(key)
        found = None if entry is None else entry()
        if found is None:
            found = cls(free, None, *fields)
            entry = _table[key] = _Entry(found, _end)
            entry.key = key
    return found


def _digested(term: Base) -> bytes:
    """The digest of a term, from those of its subterms. Does not recurse."""
    stack = [term]
    while stack:
        node = stack[-1]
        values = [getattr(node, name) for name in own_fields(type(node))]
        missing = [part for value in values for part in _parts(value) if part._digest is None]
        if missing:
            stack += missing
            continue
        stack.pop()
        fed = [type(node).__name__.encode()]
        for value in values:
            _feed(value, fed)
        force_setattr(node, "_digest", blake2b(b"\x00".join(fed), digest_size=16).digest())
    assert term._digest is not None
    return term._digest


def _parts(value: object) -> Iterator[Base]:
    """The terms in a field."""
    if isinstance(value, Base):
        yield value
    elif isinstance(value, tuple):
        for item in value:
            yield from _parts(item)


def _feed(value: object, into: list[bytes]) -> None:
    if isinstance(value, Base):
        into.append(value.digest)
    elif isinstance(value, tuple):
        into.append(b"(%d" % len(value))
        for item in value:
            _feed(item, into)
    elif isinstance(value, float):
        into.append(value.hex().encode())
    else:
        into.append(repr(value).encode())
