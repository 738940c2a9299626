"""Tables as text: numbers in rows, separated by commas, semicolons, tabs, bars or blanks.

Owns `separated`. There are two ways through a file that give the same: a fast one for plain rows, many at a time,
which gives up on whatever it is not sure of, and a careful one, which tells what is wrong.
"""

from __future__ import annotations

import csv
import re
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice
from math import isfinite

from msgspec import Struct

from potto.data.encodings import identifiers
from potto.data.mistakes import DataRefused, bad_row, counted, malformed, quoted
from potto.data.values import NumberArray, RealNumber, Table

WHITE = " "  # any blanks and tabs
DELIMITERS = ("\t", ";", "|", ",", WHITE)  # between equals the earlier one
MISSING = frozenset({"", "-", "--", "?", ".", "na", "n/a", "#n/a", "nan", "nil", "none", "null", "missing"})
_SAMPLE = 20  # lines by which the delimiter is told
_BATCH = 500  # rows that are texts at the same time; of more, the garbage collector takes notice: twice the time
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_INFINITE = re.compile(r"[+-]?inf(?:inity)?", re.IGNORECASE)
_THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}(?:[,.' ][0-9]{3})+(?:[.,][0-9]+)?")
_MEANT = re.compile(r"[+-]?[\d.,'_ ]*\d[\d.,'_ ]*(?:[eE][+-]?\d+)?")  # as a number, whoever reads it
_WORD = re.compile(r'"([^"]*)"|(\S+)')


class _Layout(Struct, frozen=True):
    """How a file is written: what separates, whether commas are points, and what the columns are called, if at all."""

    delimiter: str
    comma: bool
    names: tuple[str, ...]
    width: int
    origin: int  # the line of the first record, which the others are held against

    def column(self, at: int) -> str:
        name = self.names[at].strip() if self.names else ""
        return f"column {quoted(name)}" if name else f"column {at + 1}"


def separated(text: str, tabs: bool) -> NumberArray | Table:
    """What a table holds: named columns below a header, otherwise one array. `tabs`: nothing else separates."""
    lines = text.split("\n")
    delimiter = "\t" if tabs else _delimiter(lines)
    row, first = next(_records(lines, delimiter), (0, []))
    if not first:
        raise malformed("the file holds no values", hint="a table has numbers in rows, one row a line")
    names = tuple(first) if _is_header(first, delimiter != ",") else ()
    kept = _kept(lines[row - (not names) :], delimiter, comments="#" in text)
    body = "\n".join(kept)
    comma = delimiter != "," and "," in body and "." not in body
    layout = _Layout(delimiter, comma, names, len(first), row)
    plain = '"' not in text and "_" not in body and body.isascii()
    columns = _fast(body.replace(",", ".").split("\n") if comma else kept, layout) if plain and kept else None
    texts: frozenset[int] = frozenset()
    gaps: dict[int, int] = {}
    if columns is None:
        texts = _of_texts(lines, layout)
        columns, gaps = _careful(lines, layout, texts)
    return _value(layout, columns, texts, gaps)


def _value(
    layout: _Layout, columns: Sequence[array[float]], texts: frozenset[int], gaps: Mapping[int, int]
) -> NumberArray | Table:
    length = max(map(len, columns))
    if not length:
        raise malformed("the file has a header and no rows", hint="a table has numbers in rows below its header")
    if layout.names:
        names = identifiers(layout.names)
        kept = (
            (name, NumberArray((length,), RealNumber(), columns[at]))
            for at, name in enumerate(names)
            if at not in texts and at not in gaps
        )
        named = [at for at in range(layout.width) if layout.names[at].strip()]
        lacking = tuple((names[at], gaps[at]) for at in named if at in gaps)
        return Table(tuple(kept), tuple(names[at] for at in named if at in texts), lacking)
    if layout.width == 1:
        return NumberArray((length,), RealNumber(), columns[0])
    flat = array("d", bytes(8 * length * layout.width))
    for at, column in enumerate(columns):
        flat[at :: layout.width] = column
    return NumberArray((length, layout.width), RealNumber(), flat)


def _is_idle(line: str, delimiter: str) -> bool:
    """Whether a line is blank or a comment."""
    rest = line.strip(_blank(delimiter))
    return not rest or rest.startswith("#")


def _blank(delimiter: str) -> str:
    """What a blank line is made of. With tabs between values, one of tabs alone is a row without any."""
    return " " if delimiter == "\t" else " \t"


def _kept(lines: Sequence[str], delimiter: str, comments: bool) -> list[str]:
    """Lines that are neither blank nor comments, of which there may be some or not."""
    if comments:
        return [line for line in lines if not _is_idle(line, delimiter)]
    blank = _blank(delimiter)
    return [line for line in lines if line.strip(blank)]


def _records(lines: Sequence[str], delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """The rows as texts, each with the line on which it begins: quoted texts may run over several."""
    if delimiter == WHITE:
        for number, line in enumerate(lines, 1):
            if not _is_idle(line, delimiter):
                yield number, _words(line)
        return
    begun = 0

    def fed() -> Iterator[str]:
        nonlocal begun
        for number, line in enumerate(lines, 1):
            if begun or not _is_idle(line, delimiter):
                begun = begun or number
                yield line + "\n"

    try:
        for record in csv.reader(fed(), delimiter=delimiter, skipinitialspace=True, strict=True):
            row, begun = begun, 0
            yield row, record
    except csv.Error as error:
        after = "expected after" in str(error)
        how = "ends within a value" if after else "is not closed"
        hint = 'a quote within quotes is written `""`'
        raise malformed(f"a quote on line {begun} {how}", row=begun, hint=hint) from None


def _words(line: str) -> list[str]:
    return [inner or plain for inner, plain in _WORD.findall(line)] if '"' in line else line.split()


def _delimiter(lines: Sequence[str]) -> str:
    """What separates the values of the first lines: what gives all of them equally many, and the most numbers."""
    sample = list(islice((line for line in lines if not _is_idle(line, WHITE)), _SAMPLE))
    split = {delimiter: _split(sample, delimiter) for delimiter in DELIMITERS}
    even = [d for d, rows in split.items() if len({len(row) for row in rows}) == 1 < len(rows[0])]
    if even:
        return max(even, key=lambda delimiter: _share(split[delimiter], delimiter != ","))
    most = max(DELIMITERS, key=lambda delimiter: sum(len(row) > 1 for row in split[delimiter]))
    return most if 2 * sum(len(row) > 1 for row in split[most]) > len(sample) else ","


def _split(sample: Iterable[str], delimiter: str) -> list[list[str]]:
    if delimiter == WHITE:
        return [_words(line) for line in sample]
    rows = csv.reader((line + "\n" for line in sample), delimiter=delimiter, skipinitialspace=True)
    try:
        return list(rows)
    except csv.Error:
        return []


def _share(rows: Sequence[Sequence[str]], comma: bool) -> float:
    """Which part of the values are numbers; a first row counts only if there is no other."""
    values = list(chain.from_iterable(rows[1:] or rows))
    return sum(_is_number(value, comma) for value in values) / len(values)


def _is_number(text: str, comma: bool) -> bool:
    text = text.strip()
    return bool(_NUMBER.fullmatch(text.replace(",", ".", 1) if comma else text) or _INFINITE.fullmatch(text))


def _is_header(first: Sequence[str], comma: bool) -> bool:
    """Whether a first row holds names. One of numbers that lacks some does not."""
    numbers = [_is_number(text, comma) for text in first]
    missing = [text.strip().lower() in MISSING for text in first]
    return not all(number or lacking for number, lacking in zip(numbers, missing))


def _fast(lines: Sequence[str], layout: _Layout) -> list[array[float]] | None:
    """The columns of plain rows: no quotes, no comments, nothing that `float` takes and we don't. None if in doubt."""
    columns = [array("d") for _ in range(layout.width)]
    for start in range(0, len(lines), _BATCH):
        batch = lines[start : start + _BATCH]
        white = layout.delimiter == WHITE
        rows = [line.split() for line in batch] if white else list(
            csv.reader(batch, delimiter=layout.delimiter, skipinitialspace=True, quoting=csv.QUOTE_NONE)
        )  # fmt: skip
        if set(map(len, rows)) != {layout.width}:
            return None
        try:
            for column, texts in zip(columns, zip(*rows)):
                column.extend(map(float, texts))
        except ValueError:
            return None
    return columns if all(all(map(isfinite, column)) for column in columns) else None


def _of_texts(lines: Sequence[str], layout: _Layout) -> frozenset[int]:
    """The columns below a header of which no value is a number, or meant as one: names, dates, labels. Not all.

    One without a name and without any value is left by a separator at the end of each line.
    """
    if not layout.names:
        return frozenset()
    of_texts, lacking, empty = (set(range(layout.width)) for _ in range(3))
    for _, record in islice(_records(lines, layout.delimiter), 1, None):
        for at in list(of_texts) if len(record) == layout.width else ():
            text = record[at].strip()
            if text:
                empty.discard(at)
            if _is_number(text, layout.comma) or _MEANT.fullmatch(text):
                of_texts.remove(at)
            elif text.lower() not in MISSING:
                lacking.discard(at)
    found = of_texts - lacking | {at for at in of_texts & empty if not layout.names[at].strip()}
    return frozenset(found) if len(found) < layout.width else frozenset()


def _careful(
    lines: Sequence[str], layout: _Layout, texts: frozenset[int], strict: bool = False
) -> tuple[list[array[float]], dict[int, int]]:
    """The columns, those of texts empty, and which of them lack values, with the first line without one: what nobody
    reads may have gaps. strict: nothing may; so it is without names to read by, and where every column has some."""
    columns, gaps = [array("d") for _ in range(layout.width)], dict[int, int]()
    strict = strict or not layout.names
    for row, record in islice(_records(lines, layout.delimiter), bool(layout.names), None):
        if len(record) != layout.width:
            raise _ragged(layout, row, len(record))
        for at, (column, text) in enumerate(zip(columns, record)):
            if not strict and at not in texts and text.strip().lower() in MISSING:
                gaps.setdefault(at, row)
            if at not in texts and at not in gaps:
                column.append(_number(layout, row, at, text.strip(), lines[row - 1]))
    full = layout.width - len(texts) - len(gaps)
    return (columns, gaps) if full or not gaps else _careful(lines, layout, texts, strict=True)


def _ragged(layout: _Layout, row: int, length: int) -> DataRefused:
    names = f"the header has {counted(layout.width, 'name')}"
    usual = names if layout.names else f"line {layout.origin} has {layout.width}"
    hint = "every row has one value for each column; the separator was read off the first lines"
    if layout.delimiter == ",":
        hint = "every row has one value for each column; if commas are decimal points here, separate values by `;`"
    expected = counted(layout.width, "value")
    return bad_row(f"line {row} has {counted(length, 'value')}, but {usual}", row, None, str(length), expected, hint)


def _number(layout: _Layout, row: int, at: int, text: str, line: str) -> float:
    plain = text.replace(",", ".", 1) if layout.comma else text
    value = float(plain) if _NUMBER.fullmatch(plain) else None
    if value is not None and isfinite(value):
        return value
    where, found = f"line {row}, {layout.column(at)}", quoted(text)
    if text.lower() in MISSING:
        what = f"there is no value, only {found}" if text else "there is no value"
        hint = "leave rows that lack a value out of the file, or write a number there"
    elif value is not None or _INFINITE.fullmatch(text):
        what, hint = f"{found} is not finite", "a number is at most 1.8e308; leave the row out of the file"
    elif _THOUSANDS.fullmatch(text):
        what, hint = f"{found} is not a number", "write numbers without separators of thousands, with a decimal point"
    else:
        what, hint = f"{found} is text, not a number", "write a number there, or leave the row out"
    raise bad_row(f"{where}: {what}", row, at + 1, text, "a number", hint, _place(line, layout.delimiter, at))


def _place(line: str, delimiter: str, at: int) -> tuple[int, int] | None:
    """Where the value of a column stands in a line; None in a row that runs over several."""
    if delimiter == WHITE:
        found = [word.span() for word in _WORD.finditer(line)]
    else:
        outside = [n for n, char in enumerate(line) if char == delimiter and line.count('"', 0, n) % 2 == 0]
        found = list(zip([0, *(n + 1 for n in outside)], [*outside, len(line)]))
    if at >= len(found):
        return None
    start, end = found[at]
    text = line[start:end]
    first = start + len(text) - len(text.lstrip())
    return first, max(first, start + len(text.rstrip()))
