"""Numpy's files: one array (NPY), or a zip file of several (NPZ).

Owns `array_head`, `table_head` for shapes, read without numpy where no number can be nan or infinite, and `array_file`,
`table_file` for values. An NPY file whose elements have named parts is a table of these. Nothing is unpickled.
"""

from __future__ import annotations

import ast
import io
import re
import sys
from collections.abc import Callable, Iterator
from math import prod
from typing import TYPE_CHECKING, TypeVar

from msgspec import Struct

from potto.data.encodings import identifiers
from potto.data.mistakes import DataRefused, bad_row, counted, malformed, quoted
from potto.data.values import DEEPEST, NumberArray, RealNumber, RecordColumns, Sizes, Table

if TYPE_CHECKING:
    from zipfile import ZipFile, ZipInfo

_MAGIC = b"\x93NUMPY"
_PICKLE = b"\x80"
_LONGEST = 10_000  # what numpy, too, takes for the longest head
_REAL = re.compile(r"[<>|=]?(?:b1|[iu][1248]|f(?:2|4|8|12|16))")
_ODD = {"c": "complex numbers", "U": "texts", "S": "texts", "M": "dates", "m": "durations", "V": "records"}
# The byte of sign and exponent that nan and infinities have, and few other numbers, by the size of a number.
_LARGE = {"f2": bytes((*range(0x7C, 0x80), *range(0xFC, 0x100))), "f4": b"\x7f\xff", "f8": b"\x7f\xff"}
_SAVE = "save it as an array of real numbers: `numpy.save(path, array.astype(float))`"
_SAVE_MANY = "save arrays of real numbers by their names: `numpy.savez(path, x=x, y=y)`"
_T = TypeVar("_T")


class _Part(Struct, frozen=True):
    """What each element holds under a name, or without one: numbers of a type, so many in each direction."""

    name: str
    dtype: str
    dimensions: tuple[int, ...] = ()

    @property
    def bytes(self) -> int:
        return prod(self.dimensions) * int(self.dtype.lstrip("<>|=")[1:])


class _Head(Struct, frozen=True):
    """What the head of an array says, and where its numbers start."""

    parts: tuple[_Part, ...]
    fortran: bool
    dimensions: tuple[int, ...]
    start: int

    @property
    def end(self) -> int:
        """How many bytes the array has, its head included."""
        return self.start + prod(self.dimensions) * sum(part.bytes for part in self.parts)

    @property
    def named(self) -> bool:
        return bool(self.parts[0].name)


def array_head(content: bytes) -> RealNumber | Sizes | RecordColumns | None:
    """The shape of an NPY file; None where its numbers have to be looked at."""
    head = _checked(content, len(content))
    if not _surely_finite(head, content):
        return None
    if not head.named:
        return _shape(head.dimensions)
    names = identifiers([part.name for part in head.parts])
    shapes = (_shape((*head.dimensions, *part.dimensions)) for part in head.parts)
    return RecordColumns(tuple(zip(names, shapes)))


def array_file(content: bytes) -> float | NumberArray | Table:
    """The value of an NPY file."""
    head = _checked(content, len(content))
    if not head.named:
        return _array(head, content)
    names = identifiers([part.name for part in head.parts])
    return Table(tuple((name, _array(head, content, part.name)) for name, part in zip(names, head.parts)))


def table_head(content: bytes) -> RecordColumns | None:
    """The shape of an NPZ file; None where its numbers have to be looked at."""

    def head(archive: ZipFile, entry: ZipInfo) -> RealNumber | Sizes | None:
        found = archive.read(entry)
        known = _without_names(_checked(found, len(found)))
        return _shape(known.dimensions) if _surely_finite(known, found) else None

    fields = tuple(_entries(content, head))
    finite = tuple((name, shape) for name, shape in fields if shape is not None)
    return RecordColumns(finite) if len(finite) == len(fields) else None


def table_file(content: bytes) -> Table:
    """The value of an NPZ file."""

    def value(archive: ZipFile, entry: ZipInfo) -> float | NumberArray:
        found = archive.read(entry)
        return _array(_without_names(_checked(found, len(found))), found)

    return Table(tuple(_entries(content, value)))


def _surely_finite(head: _Head, content: bytes) -> bool:
    """Whether no number of an array can be nan or infinite, by one of its bytes: 1 ns a number."""
    offset, width = head.start, sum(part.bytes for part in head.parts)
    for part in head.parts:
        kind, size = part.dtype.lstrip("<>|="), part.bytes // prod(part.dimensions)
        if kind.startswith("f"):
            big = part.dtype.startswith(">") or (part.dtype.startswith("=") and sys.byteorder == "big")
            firsts = range(offset + (0 if big else size - 1), offset + part.bytes, size)
            tops = (content[first : head.end : width] for first in firsts)
            if kind not in _LARGE or any(byte in top for top in tops for byte in _LARGE[kind]):
                return False
        offset += part.bytes
    return True


def _without_names(head: _Head) -> _Head:
    if head.named:
        raise malformed(f"the array holds {_ODD['V']}, not real numbers", hint=_SAVE_MANY)
    return head


def _entries(content: bytes, read: Callable[[ZipFile, ZipInfo], _T]) -> Iterator[tuple[str, _T]]:
    import zipfile  # 3 ms, and most files are none
    import zlib

    broken = (zipfile.BadZipFile, ValueError, OSError, NotImplementedError)
    try:
        archive = zipfile.ZipFile(io.BytesIO(content))
        entries = archive.infolist()
    except broken as error:
        raise malformed(f"the file is not an NPZ file: {_said(error)}", hint=_SAVE_MANY) from None
    if not entries:
        raise malformed("the file holds no arrays", hint=_SAVE_MANY)
    for entry in entries:
        if not entry.filename.endswith(".npy"):
            raise malformed(f"{quoted(entry.filename)} within the file is not an array", hint=_SAVE_MANY)
    names = [entry.filename.removesuffix(".npy") for entry in entries]
    for written, name, entry in zip(names, identifiers(names), entries):
        try:
            yield name, read(archive, entry)
        except DataRefused as refused:
            raise _within(written, refused) from None
        except (*broken, zlib.error, EOFError, RuntimeError) as error:
            raise malformed(f"the array {quoted(written)} can't be read: {_said(error)}", hint=_SAVE_MANY) from None


def _within(name: str, refused: DataRefused) -> DataRefused:
    mistake = refused.mistake
    message = f"{quoted(name)}: {mistake.message}"
    if mistake.row is not None:
        return bad_row(message, mistake.row, mistake.column, mistake.found, mistake.expected, mistake.hint)
    return malformed(message, found=mistake.found, hint=mistake.hint)


def _said(error: Exception) -> str:
    """What a library says about bytes, as the end of a sentence."""
    said = str(error) or type(error).__name__
    return said[:1].lower() + said[1:]


def _checked(content: bytes, length: int) -> _Head:
    """The head of an array of real numbers that is `length` bytes long, or has that many at least."""
    head = _head(content)
    if head.end > length:
        message = f"the file ends too early: it has {length} bytes where its head promises {head.end}"
        raise malformed(message, hint="write the file again")
    if len(head.dimensions) > DEEPEST:
        raise malformed(f"the array has {len(head.dimensions)} dimensions; the most is {DEEPEST}")
    if 0 in head.dimensions:
        raise malformed(f"the array holds no values: its shape is {head.dimensions}")
    return head


def _head(content: bytes) -> _Head:
    if not content:
        raise malformed("the file is empty", hint=_SAVE)
    if content.startswith(_PICKLE):
        raise _pickled()
    if not content.startswith(_MAGIC) or len(content) < 12:
        raise malformed("the file is not an NPY file: it does not start like one", hint=_SAVE)
    if content[6] not in (1, 2, 3):
        raise malformed(f"the file is of version {content[6]} of NPY, which is not known", hint=_SAVE)
    wide = 2 if content[6] == 1 else 4
    start = 8 + wide + int.from_bytes(content[8 : 8 + wide], "little")
    broken = malformed("the head of the NPY file is broken", hint="write the file again")
    if start > _LONGEST + 12:
        raise malformed(f"the head of the NPY file is too long: {counted(start, 'byte')}", hint=_SAVE)
    try:
        head = ast.literal_eval(content[8 + wide : start].decode("latin-1" if content[6] < 3 else "utf-8").strip())
        dtype, fortran, dimensions = head["descr"], head["fortran_order"], head["shape"]
    except (ValueError, SyntaxError, TypeError, KeyError, MemoryError, RecursionError):
        raise broken from None
    if not isinstance(dimensions, tuple) or not all(type(n) is int and n >= 0 for n in dimensions):
        raise broken
    if len(content) < start or type(fortran) is not bool:
        raise broken
    return _Head(_parts(dtype), fortran, dimensions, start)


def _parts(dtype: object) -> tuple[_Part, ...]:
    """What the elements are made of, if that is real numbers."""
    if not isinstance(dtype, list) or not dtype:
        return (_Part("", _real(dtype)),)
    found = []
    for name, kind, *shape in dtype:
        dimensions = shape[0] if shape else ()
        if not isinstance(name, str) or not name or not isinstance(dimensions, tuple):
            raise malformed(f"the array holds {_ODD['V']} whose parts have no names", hint=_SAVE)
        try:
            found.append(_Part(name, _real(kind), dimensions))
        except DataRefused as refused:
            raise _within(name, refused) from None
    return tuple(found)


def _real(dtype: object) -> str:
    """The type of the entries, if they are real numbers."""
    if isinstance(dtype, str) and _REAL.fullmatch(dtype):
        return dtype
    kind = dtype.lstrip("<>|=")[:1] if isinstance(dtype, str) else "V"
    if kind == "O":
        raise _pickled()
    found = _ODD.get(kind, "values of an unknown kind")
    raise malformed(f"the array holds {found}, not real numbers", found=str(dtype), hint=_SAVE)


def _pickled() -> DataRefused:
    message = "the file holds Python objects (a pickle); it is not read, since reading it could run any program"
    return malformed(message, found="pickle", hint=_SAVE)


def _shape(dimensions: tuple[int, ...]) -> RealNumber | Sizes:
    return Sizes(dimensions) if dimensions else RealNumber()


def _array(head: _Head, content: bytes, name: str = "") -> float | NumberArray:
    """The numbers of a file, or those that its elements hold under a name."""
    import numpy as np

    try:
        dtypes = [np.dtype((part.dtype, part.dimensions)) for part in head.parts]
    except TypeError:
        kinds = ", ".join(part.dtype for part in head.parts)
        raise malformed(f"numbers of the type {kinds} are not known on this machine", hint=_SAVE) from None
    dtype = np.dtype([(part.name, own) for part, own in zip(head.parts, dtypes)]) if head.named else dtypes[0]
    read = np.frombuffer(content, dtype, prod(head.dimensions), head.start)
    with np.errstate(over="ignore", invalid="ignore"):
        shaped = read.reshape(head.dimensions, order="F" if head.fortran else "C")
        shaped = shaped[name] if name else shaped
        found = np.require(shaped, np.float64, ["C", "A"])  # heads of files need not leave the numbers aligned
    if not np.isfinite(found).all():
        at = np.argwhere(~np.isfinite(found.reshape(shaped.shape)))[0].tolist() if shaped.shape else []
        refused = _infinite(tuple(at), str(found.reshape(shaped.shape)[tuple(at)]))
        raise _within(name, refused) if name else refused
    return NumberArray(shaped.shape, RealNumber(), found) if shaped.shape else float(found.reshape(()))


def _infinite(at: tuple[int, ...], found: str) -> DataRefused:
    row, column = (*(index + 1 for index in at[:2]), None, None)[:2]
    ways = ("the number", f"row {row}", f"row {row}, column {column}")
    where = ways[len(at)] if len(at) < len(ways) else f"entry {list(at)}, counted from 0"
    hint = "leave out what has no finite value before the array is saved"
    return bad_row(f"{where}: {found} is not finite", row, column, found, "a number", hint)
