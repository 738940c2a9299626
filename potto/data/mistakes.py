"""What can be wrong with a file of data, as values.

Owns `DataMistake` and the codes. Within this package a mistake travels as the exception `DataRefused`; it leaves as a
value. Messages don't name the file: who asked knows it.
"""

from __future__ import annotations

from msgspec import Struct

UNREADABLE, UNKNOWN_KIND, BAD_ROW, NO_PACKAGE, MALFORMED = "P0801", "P0802", "P0803", "P0804", "P0805"

TITLES = {
    UNREADABLE: "a file of data that can't be read",
    UNKNOWN_KIND: "a data file of an unknown kind",
    BAD_ROW: "a row of a file of data that is not right",
    NO_PACKAGE: "a file of data that only a further package can read",
    MALFORMED: "a file of data that is malformed",
}

_SHOWN = 40


class DataMistake(Struct, frozen=True):
    """What is wrong, where, and what to do.

    row: the line of a text, or the first index of an array in numpy's files, both counted from 1.
    column: the column of a table, or of an array, counted from 1.
    place: from which character of that line to which, where it is less than all of it.
    found, expected: what stands there, and what ought to.
    meant: names of files beside a missing one that may have been meant.
    """

    code: str
    message: str
    row: int | None = None
    column: int | None = None
    found: str = ""
    expected: str = ""
    hint: str = ""
    meant: tuple[str, ...] = ()
    place: tuple[int, int] | None = None


class DataRefused(Exception):
    """A mistake on its way to whoever asked."""

    def __init__(self, mistake: DataMistake) -> None:
        self.mistake = mistake
        super().__init__(mistake.message)


def malformed(message: str, *, row: int | None = None, found: str = "", hint: str = "") -> DataRefused:
    """The file as a whole is not what its name says."""
    return DataRefused(DataMistake(MALFORMED, message, row, None, found, "", hint))


def bad_row(
    message: str, row: int | None, column: int | None, found: str, expected: str, hint: str,
    place: tuple[int, int] | None = None,
) -> DataRefused:  # fmt: skip
    """One place of the file is not right."""
    return DataRefused(DataMistake(BAD_ROW, message, row, column, found, expected, hint, (), place))


def quoted(text: str) -> str:
    """A piece of a file within a message: on one line, and not long."""
    plain = "".join(char if char.isprintable() else " " for char in text)
    return f"`{plain if len(plain) <= _SHOWN else plain[: _SHOWN - 1] + '…'}`"


def counted(number: int, thing: str) -> str:
    """`1 value`, `2 values`."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"
