"""Terms, and values made of them, as bytes and back: what is found out about a program can be kept.

Owns `packed` and `unpacked`, and `keep` and `recall`, by which values go to the store and come back. Bytes hold data:
numbers, strings, tuples, lists, sets, dictionaries, kinds of diagnostics by their codes, structs of Potto by the names
of their classes, and terms, each distinct subterm once. What comes back is equal, floats to the last bit; terms are the
very objects that there are in this process.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from typing import Any

from msgspec import Struct, msgpack

from potto import store
from potto.core.consing import Base, own_fields
from potto.core.rebuilding import rebuilt
from potto.core.walking import unknown
from potto.diagnostics import KINDS, Kind

_TUPLE, _LIST, _SET, _DICT, _TERM, _STRUCT, _KIND, _FRACTION, _INTEGER = range(9)
_PLAIN = frozenset((type(None), bool, float, str, bytes))
_LARGEST = 2**63


def packed(value: object) -> bytes:
    """A value as bytes. Raises TypeError where something in it is no data (a function, an array)."""
    writer = _Writer()
    root = writer.value(value)
    return msgpack.encode([writer.kinds, writer.rows, root])


def unpacked(data: bytes) -> Any:
    """The value that `packed` has made bytes of, by the same version of Potto. Raises ValueError where it has not."""
    try:
        kinds, rows, root = msgpack.decode(data)
        reader = _Reader([_named(name) for name in kinds])
        for row in rows:
            reader.terms.append(rebuilt(reader.kinds[row[0]], tuple(map(reader.value, row[1:]))))
        return reader.value(root)
    except Exception as error:  # bytes of others may lead to any
        raise ValueError(f"these bytes are not a value: {error}") from None


def keep(kind: str, key: bytes, value: object) -> None:
    """Keep a value on disk under a key; one that is no data is not kept."""
    if store.is_on():
        with suppress(TypeError, RecursionError):
            store.put(kind, key, packed(value))


def recall(kind: str, key: bytes) -> Any:
    """The value that was kept under a key; None if there is none."""
    data = store.get(kind, key)
    try:
        return None if data is None else unpacked(data)
    except ValueError:
        return None


class _Writer:
    """Writes one value: names of classes and rows of terms, told by their numbers."""

    def __init__(self) -> None:
        self.kinds: list[str] = []
        self.rows: list[list[Any]] = []
        self.shapes: dict[type, tuple[int, tuple[str, ...]]] = {}
        self.terms: dict[Any, int] = {}

    def kind(self, cls: type) -> int:
        name = f"{cls.__module__}:{cls.__qualname__}"
        try:
            found: object = _named(name)
        except (LookupError, AttributeError, ImportError):
            found = None
        if found is not cls:
            raise TypeError(f"{name} is not found by its name")
        self.kinds.append(name)
        return len(self.kinds) - 1

    def term(self, term: Any) -> list[Any]:
        """A term by its number, after those of its subterms."""
        number = self.terms.get(term)
        if number is None:
            for node in unknown(term, self.terms):
                self.rows.append(self.fields(node))
                number = self.terms[node] = len(self.terms)
        return [_TERM, number]

    def fields(self, value: Any) -> list[Any]:
        cls = type(value)
        shape = self.shapes.get(cls)
        if shape is None:
            names = own_fields(cls) if issubclass(cls, Base) else cls.__struct_fields__
            shape = self.shapes[cls] = self.kind(cls), names
        number, names = shape
        return [number, *[self.value(getattr(value, name)) for name in names]]

    def value(self, value: Any) -> Any:
        cls = type(value)
        if cls in _PLAIN:
            return value
        if cls is tuple:
            return [_TUPLE, *[item if type(item) in _PLAIN else self.value(item) for item in value]]
        if issubclass(cls, Base):
            return self.term(value)
        if cls is int:
            return value if -_LARGEST <= value < _LARGEST else [_INTEGER, str(value)]
        if cls is list:
            return [_LIST, *map(self.value, value)]
        if cls is Kind:
            return [_KIND, value.code]
        if issubclass(cls, Struct):
            return [_STRUCT, *self.fields(value)]
        if cls is frozenset:
            return [_SET, *map(self.value, value)]
        if cls is dict:
            return [_DICT, *(self.value(part) for pair in value.items() for part in pair)]
        if cls is Fraction:
            return [_FRACTION, str(value)]
        raise TypeError(f"{cls.__qualname__} is no data")


class _Reader:
    """Reads one value. The first of each list says what it is."""

    def __init__(self, kinds: Sequence[type]) -> None:
        self.kinds = kinds
        self.terms: list[Any] = []
        self.read: tuple[Callable[[list[Any]], Any], ...] = (
            lambda parts: tuple(map(self.value, parts)),
            lambda parts: list(map(self.value, parts)),
            lambda parts: frozenset(map(self.value, parts)),
            lambda parts: dict(zip(map(self.value, parts[::2]), map(self.value, parts[1::2]), strict=True)),
            lambda parts: self.terms[parts[0]],
            lambda parts: self.kinds[parts[0]](*map(self.value, parts[1:])),
            lambda parts: KINDS[parts[0]],
            lambda parts: Fraction(parts[0]),
            lambda parts: int(parts[0]),
        )

    def value(self, value: Any) -> Any:
        return self.read[value[0]](value[1:]) if type(value) is list else value


@lru_cache(maxsize=1024)
def _named(name: str) -> type[Struct]:
    """The struct of Potto of this name. Raises LookupError, AttributeError or ImportError if there is none."""
    module, _, path = name.partition(":")
    if not module.startswith("potto."):
        raise LookupError(f"{name} is none of ours")
    found: Any = importlib.import_module(module)
    for part in path.split("."):
        found = getattr(found, part)
    if not (isinstance(found, type) and issubclass(found, Struct)):
        raise LookupError(f"{name} is no struct")
    return found
