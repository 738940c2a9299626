"""JSON: numbers, lists that fill a box and objects, in each other as they come.

Owns `nested`. A box of objects with the same names is an object of boxes, so that a list of objects is read as the
columns of a table. What holds texts alone, or `null` somewhere, is left out, as in tables. Places are told by their
path, `speed[3][0]`, counted from 0 as JSON's users do, and by their line.
"""

from __future__ import annotations

import json
import re
from array import array
from collections.abc import Sequence
from contextlib import suppress
from itertools import chain
from math import isfinite
from typing import Any

import msgspec
from msgspec import Struct

from potto.data.encodings import identifiers
from potto.data.mistakes import MALFORMED, DataMistake, DataRefused, bad_row, counted, malformed, quoted
from potto.data.values import DEEPEST, NumberArray, RealNumber, Table, Value

Path = tuple[str | int, ...]

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{}:,]|[^\s\[\]{}:,"]+')
_SIGNED = re.compile(r"-0(?![.\deE])")
_DEEP = f"lists are nested more than {DEEPEST} deep"
_RECORDS = 'write an object of lists, as in {"x": [1, 2], "y": [3, 4]}'
_BESIDE = "lists beside each other are equally long, so that they make an array"
_ROWS = 'in a list of objects all have the same names, as in [{"x": 1, "y": 2}, {"x": 3, "y": 4}]'
_NAMES = {dict: "an object", list: "a list", str: "a text", bool: "true or false", type(None): "null"}
_MEANT = re.compile(r"\s*[+-]?[\d.,]*\d\s*(?:[eE][+-]?\d+)?\s*")  # as a number, though it stands in quotes


class _Box(Struct, frozen=True):
    """Values of one form within a JSON text, in the order of the text.

    steps: the way to them, each step into lists of a length or into objects under a name.
    """

    text: str
    entries: Sequence[Any]
    steps: Path = ()

    @property
    def dimensions(self) -> tuple[int, ...]:
        return tuple(step for step in self.steps if isinstance(step, int))

    def place(self, at: int) -> Path:
        """Where the entry stands that is the `at`-th."""
        found: list[str | int] = []
        for step in reversed(self.steps):
            at, inner = divmod(at, step) if isinstance(step, int) else (at, step)
            found.insert(0, inner)
        return tuple(found)

    def under(self, name: str) -> _Box:
        """What stands under a name in each of these objects."""
        return _Box(self.text, [entry[name] for entry in self.entries], (*self.steps, name))


def nested(text: str) -> Value:
    """What a JSON text holds."""
    quick = _quickly(text)
    if quick is not None:
        with suppress(OverflowError):  # of a whole number that no double is near
            return _value(_Box(text, [quick]))
    try:
        data = json.loads(text, parse_int=float, object_pairs_hook=_object)
    except json.JSONDecodeError as error:
        if not text.strip():
            raise malformed("the file holds no values", hint="JSON is a number, a list or an object") from None
        message = f"line {error.lineno} is not JSON: {error.msg[:1].lower()}{error.msg[1:]}"
        place = (error.colno - 1, error.colno)
        raise DataRefused(DataMistake(MALFORMED, message, error.lineno, place=place)) from None
    except RecursionError:
        raise malformed(_DEEP) from None
    return _value(_Box(text, [data]))


def _quickly(text: str) -> Any:
    """The same as by `json`, in a fifth of the time, with whole numbers as such; None for a text that is no JSON, may
    have a name twice, or has a zero whose sign would be lost."""
    if _SIGNED.search(text):
        return None
    try:
        found = msgspec.json.decode(text)
    except (msgspec.MsgspecError, UnicodeError, RecursionError):
        return None
    # There are at least as many colons as names, and no more names in objects: where these are equal, none is twice.
    colons, level = text.count(":"), [found]
    while level and colons > 0:
        objects = [entry for entry in level if type(entry) is dict]
        colons -= sum(map(len, objects))
        level = [*chain.from_iterable(entry for entry in level if type(entry) is list),
                 *chain.from_iterable(entry.values() for entry in objects)]  # fmt: skip
    return None if colons else found


def _value(box: _Box) -> Value:
    """A number, an array or a table: lists are opened level by level, and each level is of one kind."""
    while (kinds := set(map(type, box.entries))) == {list}:
        box = _opened(box)
    if kinds == {dict}:
        return _table(box)
    if int in kinds:
        entries = [float(entry) if type(entry) is int else entry for entry in box.entries]
        box, kinds = _Box(box.text, entries, box.steps), {*kinds, float} - {int}
    if kinds != {float}:
        raise _odd(box)
    numbers = box.entries
    if not all(map(isfinite, numbers)):
        at = next(at for at, number in enumerate(numbers) if not isfinite(number))
        hint = "a number is at most 1.8e308; leave out what has no value"
        raise _at(box, box.place(at), f"{numbers[at]} is not finite", str(numbers[at]), "a number", hint)
    return NumberArray(box.dimensions, RealNumber(), array("d", numbers)) if box.dimensions else float(numbers[0])


def _opened(box: _Box) -> _Box:
    """The entries of lists that are equally long."""
    lengths = set(map(len, box.entries))
    if len(lengths) > 1:
        raise _ragged(box)
    if len(box.dimensions) == DEEPEST:
        raise malformed(_DEEP)
    if lengths == {0}:
        raise _at(box, box.place(0), "the list is empty", "[]", "numbers", "")
    return _Box(box.text, list(chain.from_iterable(box.entries)), (*box.steps, *lengths))


def _table(box: _Box) -> Table:
    """Objects with the same names, as one object."""
    names = [*box.entries[0]]
    for at, entry in enumerate(box.entries):
        if entry.keys() != box.entries[0].keys():
            named, usual = (", ".join(map(quoted, each)) or "no names" for each in (entry, names))
            message = f"the object has {named}, and the first one {usual}"
            raise _at(box, box.place(at), message, named, usual, _ROWS)
    if not names:
        several, hint = ("objects are", _ROWS) if box.dimensions else ("object is", _RECORDS)
        raise malformed(f"the file holds no values: its {several} empty", hint=hint)
    fields = [(field, box.under(name)) for field, name in zip(identifiers(names), names)]
    texts = [field for field, under in fields if _of_texts(under.entries)]
    gaps = {} if "null" not in box.text else {
        field: _line(box.text, place) for field, under in fields if field not in texts and (place := _gap(under))
    }  # fmt: skip
    if len(texts) + len(gaps) == len(fields):
        texts, gaps = [], {}  # of which the first is told
    kept = ((field, _value(under)) for field, under in fields if field not in texts and field not in gaps)
    return Table(tuple(kept), tuple(texts), tuple(gaps.items()))


def _gap(box: _Box) -> Path | None:
    """Where the first `null` stands among values or in the lists that they are; what stands in objects is theirs."""
    for at, entry in enumerate(box.entries):
        inner = _gap_within(entry, DEEPEST)
        if inner is not None:
            return (*box.place(at), *inner)
    return None


def _gap_within(entry: Any, levels: int) -> Path | None:
    if entry is None:
        return ()
    if not isinstance(entry, list) or not levels:
        return None
    found = ((at, _gap_within(item, levels - 1)) for at, item in enumerate(entry))
    return next(((at, *inner) for at, inner in found if inner is not None), None)


def _of_texts(entries: Sequence[Any]) -> bool:
    """Whether values are texts, and no numbers in quotes, in whatever they stand in; some may be missing."""
    some, waiting = False, [*reversed(entries)]
    while waiting:
        entry = waiting.pop()
        if isinstance(entry, list | dict):
            waiting.extend(entry.values() if isinstance(entry, dict) else entry)
        elif isinstance(entry, str) and not _MEANT.fullmatch(entry):
            some = True
        elif entry is not None:
            return False
    return some


def _object(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in found if keys.count(key) > 1)
        raise malformed(f"an object has the name {quoted(twice)} twice", found=twice, hint="give each list a name")
    return found


def _ragged(box: _Box) -> DataRefused:
    first, *_ = lists = box.entries
    at, length = next((at, len(entry)) for at, entry in enumerate(lists) if len(entry) != len(first))
    usual = counted(len(first), "value")
    message = f"the list has {length}, but those before it have {usual}"
    return _at(box, box.place(at), message, str(length), usual, _BESIDE)


def _odd(box: _Box) -> DataRefused:
    """What is said of the first entry that is of another kind than those before it, or is not a number."""
    first, kinds = box.entries[0], (float, list, dict)
    usual = next((kind for kind in kinds if isinstance(first, kind)), float)
    at = next(at for at, entry in enumerate(box.entries) if not isinstance(entry, usual))
    entry, place = box.entries[at], box.place(at)
    if usual is dict:
        return _at(box, place, "this stands among objects", "…", "an object", _ROWS)
    if isinstance(entry, float):
        return _at(box, place, "a number stands among lists", f"{entry:g}", "a list", _BESIDE)
    if isinstance(entry, list):
        return _at(box, place, "a list stands among numbers", "[…]", "a number", _BESIDE)
    shown = {dict: "{…}", str: entry, bool: str(entry).lower()}.get(type(entry), "null")
    what = f"{quoted(entry)} is a text" if isinstance(entry, str) else f"this is {_NAMES[type(entry)]}"
    hint = _RECORDS if isinstance(entry, dict) else "only numbers can be read"
    return _at(box, place, f"{what}, not a number", shown, "a number", hint)


def _at(box: _Box, place: Path, message: str, found: str, expected: str, hint: str) -> DataRefused:
    row = _line(box.text, place)
    names = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place).removeprefix(".")
    where = f"line {row}, {quoted(names)}" if names else f"line {row}"
    column = next((key + 1 for key in reversed(place) if isinstance(key, int)), None)
    return bad_row(f"{where}: {message}", row, column, found, expected, hint)


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
