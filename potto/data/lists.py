"""JSON: a number, nested lists of numbers that fill a box, an object of these, or a list of objects, row by row.

Owns `nested`. Places are told by their path, `speed[3][0]`, counted from 0 as JSON's users do, and by their line.
"""

from __future__ import annotations

import json
import re
from array import array
from collections.abc import Sequence
from itertools import chain
from math import isfinite
from typing import Any

from msgspec import Struct

from potto.data.mistakes import MALFORMED, DataMistake, Refused, bad_row, counted, malformed, quoted
from potto.data.texts import identifiers
from potto.data.values import DEEPEST, Array, Number, Table, Value

Path = tuple[str | int, ...]

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{}:,]|[^\s\[\]{}:,"]+')
_DEEP = f"lists are nested more than {DEEPEST} deep"
_RECORDS = 'write an object of lists, as in {"x": [1, 2], "y": [3, 4]}'
_BESIDE = "lists beside each other are equally long, so that they make an array"
_ROWS = 'in a list of objects all have the same names, as in [{"x": 1, "y": 2}, {"x": 3, "y": 4}]'
_NAMES = {dict: "an object", list: "a list", str: "a text", bool: "true or false", type(None): "null"}


class _Text(Struct, frozen=True):
    """A JSON text. by_rows: it is a list of objects, read column by column."""

    whole: str
    by_rows: bool = False

    def placed(self, place: Path) -> Path:
        """Where in the text something is that is known by its column, then its row."""
        return (place[1], place[0], *place[2:]) if self.by_rows else place


def nested(text: str) -> Value:
    """What a JSON text holds."""
    try:
        data = json.loads(text, parse_int=float, object_pairs_hook=_object)
    except json.JSONDecodeError as error:
        if not text.strip():
            raise malformed("the file holds no values", hint="JSON is a number, a list or an object") from None
        message = f"line {error.lineno} is not JSON: {error.msg[:1].lower()}{error.msg[1:]}"
        place = (error.colno - 1, error.colno)
        raise Refused(DataMistake(MALFORMED, message, error.lineno, place=place)) from None
    except RecursionError:
        raise malformed(_DEEP) from None
    if isinstance(data, list) and data and isinstance(data[0], dict):
        return _by_rows(text, data)
    if not isinstance(data, dict):
        return _value(_Text(text), data, ())
    if not data:
        raise malformed("the file holds no values: its object is empty", hint=_RECORDS)
    return Table(tuple((name, _value(_Text(text), data[key], (key,))) for name, key in zip(identifiers([*data]), data)))


def _by_rows(text: str, rows: list[Any]) -> Table:
    """A list of objects with the same names: a table, row by row."""
    names = [*rows[0]]
    for at, row in enumerate(rows):
        if not isinstance(row, dict):
            raise _at(_Text(text), (at,), "this stands among objects", "…", "an object", _ROWS)
        if row.keys() != rows[0].keys():
            named, usual = (", ".join(map(quoted, each)) or "no names" for each in (row, rows[0]))
            raise _at(_Text(text), (at,), f"the object has {named}, and the first one {usual}", named, usual, _ROWS)
    if not names:
        raise malformed("the file holds no values: its objects are empty", hint=_ROWS)
    columns = ((field, name, [row[name] for row in rows]) for field, name in zip(identifiers(names), names))
    return Table(tuple((field, _value(_Text(text, True), data, (name,))) for field, name, data in columns))


def _object(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in found if keys.count(key) > 1)
        raise malformed(f"an object has the name {quoted(twice)} twice", found=twice, hint="give each list a name")
    return found


def _value(text: _Text, data: Any, path: Path) -> float | Array:
    """A number or an array: lists are opened level by level, and each level is of one kind."""
    dimensions: list[int] = []
    level = [data]
    while (kinds := set(map(type, level))) == {list}:
        lengths = set(map(len, level))
        if len(lengths) > 1:
            raise _ragged(text, level, dimensions, path)
        if len(dimensions) == DEEPEST:
            raise malformed(_DEEP)
        dimensions.append(lengths.pop())
        level = list(chain.from_iterable(level))
        if not level:
            raise _at(text, (*path, *_index(0, dimensions[:-1])), "the list is empty", "[]", "numbers", "")
    if kinds != {float}:
        raise _odd(text, level, dimensions, path)
    if not all(map(isfinite, level)):
        at = next(at for at, number in enumerate(level) if not isfinite(number))
        hint = "a number is at most 1.8e308; leave out what has no value"
        place = (*path, *_index(at, dimensions))
        raise _at(text, place, f"{level[at]} is not finite", str(level[at]), "a number", hint)
    return Array(tuple(dimensions), Number(), array("d", level)) if dimensions else level[0]


def _ragged(text: _Text, level: Sequence[Any], dimensions: Sequence[int], path: Path) -> Refused:
    at, length = next((at, len(entry)) for at, entry in enumerate(level) if len(entry) != len(level[0]))
    usual = counted(len(level[0]), "value")
    place = (*path, *_index(at, dimensions))
    message = f"the list has {length}, but those before it have {usual}"
    return _at(text, place, message, str(length), usual, _BESIDE)


def _odd(text: _Text, level: Sequence[Any], dimensions: Sequence[int], path: Path) -> Refused:
    """What is said of the first entry that is not a number, or is a list among numbers or a number among lists."""
    lists = isinstance(level[0], list)
    at = next(at for at, entry in enumerate(level) if not isinstance(entry, list if lists else float))
    entry, place = level[at], (*path, *_index(at, dimensions))
    if isinstance(entry, float):
        return _at(text, place, "a number stands among lists", f"{entry:g}", "a list", _BESIDE)
    if isinstance(entry, list):
        return _at(text, place, "a list stands among numbers", "[…]", "a number", _BESIDE)
    shown = {dict: "{…}", str: entry, bool: str(entry).lower()}.get(type(entry), "null")
    what = f"{quoted(entry)} is a text" if isinstance(entry, str) else f"this is {_NAMES[type(entry)]}"
    hint = _RECORDS if isinstance(entry, dict) else "only numbers can be read"
    return _at(text, place, f"{what}, not a number", shown, "a number", hint)


def _at(text: _Text, place: Path, message: str, found: str, expected: str, hint: str) -> Refused:
    place = text.placed(place)
    row = _line(text.whole, place)
    names = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place).removeprefix(".")
    where = f"line {row}, {quoted(names)}" if names else f"line {row}"
    column = next((key + 1 for key in reversed(place) if isinstance(key, int)), None)
    return bad_row(f"{where}: {message}", row, column, found, expected, hint)


def _index(at: int, dimensions: Sequence[int]) -> tuple[int, ...]:
    """The indices of the entry of a box that is the `at`-th in the order of the text."""
    found: list[int] = []
    for length in reversed(dimensions):
        at, rest = divmod(at, length)
        found.insert(0, rest)
    return tuple(found)


def _line(text: str, place: Path) -> int:
    """The line on which a value begins, by going through the text again."""
    at: list[str | int | None] = []  # None: the name of an entry is next
    for match in _TOKEN.finditer(text):
        token = match[0]
        if token in "]}":
            at.pop()
        elif token == ",":
            at[-1] = at[-1] + 1 if isinstance(at[-1], int) else None
        elif token != ":" and at and at[-1] is None:
            at[-1] = json.loads(token)
        elif token != ":":
            if tuple(at) == place:
                return text.count("\n", 0, match.start()) + 1
            if token in "[{":
                at.append(0 if token == "[" else None)
    return 1
