"""Terms, and values made of them, as bytes and back: what is found out about a program can be kept.

Owns `packed` and `unpacked`, and `keep` and `recall`, by which values go to the store and come back. Bytes hold data:
numbers, strings, tuples, lists, sets, dictionaries, kinds of diagnostics by their codes, structs, dataclasses and
named tuples of Potto by the names of their classes, and terms, each distinct subterm once. What comes back is equal,
floats to the last bit; terms, and symbols that are `found_by` a function, are the very objects that there are in this
process.
"""

from __future__ import annotations

import copyreg
import importlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import is_dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from msgspec import Struct, msgpack

from potto import store
from potto.core.consing import Base, own_fields
from potto.core.rebuilding import rebuilt
from potto.core.walking import unknown
from potto.diagnostics import KINDS, Kind

_TUPLE, _LIST, _SET, _DICT, _TERM, _STRUCT, _KIND, _FRACTION, _INTEGER, _FOUND = range(10)
_PLAIN = frozenset((type(None), bool, float, str, bytes))
_LARGEST = 2**63
_finders = set[Callable[..., Any]]()


def found_by(function: Callable[..., Any]) -> None:
    """Let what is pickled as a call of this function, as `copyreg` knows, be packed: symbols that are told by identity.
    Its module and name lead to it."""
    _finders.add(function)


def packed(value: object) -> bytes:
    """A value as bytes. Raises TypeError where something in it is not data (a function, an array)."""
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
    """Keep a value on disk under a key; one that is not data is not kept."""
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
        self.finders: dict[Callable[..., Any], int] = {}
        self.terms: dict[Any, int] = {}

    def kind(self, found: Callable[..., Any]) -> int:
        """The number of a class, or of a function that finds symbols, under its name."""
        name = f"{found.__module__}:{found.__qualname__}"
        try:
            named: object = _named(name)
        except (LookupError, AttributeError, ImportError):
            named = None
        if named is not found:
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
            shape = self.shapes[cls] = self.kind(cls), _fields(cls)
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
        if cls in self.shapes or _is_data(cls):
            return [_STRUCT, *self.fields(value)]
        if cls is frozenset:
            return [_SET, *map(self.value, value)]
        if cls is dict:
            return [_DICT, *(self.value(part) for pair in value.items() for part in pair)]
        if cls is Fraction:
            return [_FRACTION, str(value)]
        return self.symbol(value)

    def symbol(self, value: Any) -> list[Any]:
        """What is found by a function, by the arguments that lead to it."""
        told: Any = copyreg.dispatch_table.get(type(value))
        finder, arguments, *_ = (None, ()) if told is None else told(value)
        if finder not in _finders:
            raise TypeError(f"{type(value).__qualname__} is not data")
        if finder not in self.finders:
            self.finders[finder] = self.kind(finder)
        return [_FOUND, self.finders[finder], *map(self.value, arguments)]


class _Reader:
    """Reads one value. The first of each list says what it is."""

    def __init__(self, kinds: Sequence[Callable[..., Any]]) -> None:
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
            lambda parts: self.kinds[parts[0]](*map(self.value, parts[1:])),
        )

    def value(self, value: Any) -> Any:
        return self.read[value[0]](value[1:]) if type(value) is list else value


def _is_data(cls: type) -> bool:
    """Whether values of a class are made of its fields, and compared by them."""
    if issubclass(cls, Struct | tuple):
        return cls is not tuple
    return is_dataclass(cls) and cls.__eq__ is not object.__eq__


def _fields(cls: Any) -> tuple[str, ...]:
    """The names of the fields that make a value of this class what it is."""
    if issubclass(cls, Base):
        return own_fields(cls)
    found: tuple[str, ...] = (
        cls.__struct_fields__
        if issubclass(cls, Struct)
        else cls._fields
        if issubclass(cls, tuple)
        else cls.__match_args__
    )
    return found


@lru_cache(maxsize=1024)
def _named(name: str) -> Callable[..., Any]:
    """The class of Potto's data, or the function that finds symbols, of this name. Raises LookupError, AttributeError
    or ImportError if there is none."""
    module, _, path = name.partition(":")
    if not module.startswith("potto."):
        raise LookupError(f"{name} is none of ours")
    found: Any = importlib.import_module(module)
    for part in path.split("."):
        found = getattr(found, part)
    if _is_data(found) if isinstance(found, type) else found in _finders:
        return found  # type: ignore[no-any-return]
    raise LookupError(f"{name} is not data")
