"""Which kind of file is read by what.

Owns `read`, `shape_of` and `values_of`, which answer with a mistake as a value, and `suggest` for names of files that
are not there. What a file holds is kept in memory under the digest of its content.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from msgspec import Struct

from potto.data import arrays, pixels
from potto.data.encodings import text_of
from potto.data.lists import nested
from potto.data.mistakes import NO_PACKAGE, UNKNOWN_KIND, UNREADABLE, DataMistake, DataRefused, quoted
from potto.data.parsed_files import Memory
from potto.data.tables import separated
from potto.data.values import Shape, Value, shape
from potto.digests import blake2b


class _Kind(Struct, frozen=True):
    """How a kind of file is read. head: its shape, where that takes less than its values, and the file is known to be
    sound without them."""

    value: Callable[[bytes], Value]
    head: Callable[[bytes], Shape | None] = lambda content: None


_PICTURE = _Kind(pixels.picture, pixels.picture_head)
_KINDS = {
    ".csv": _Kind(lambda content: separated(text_of(content), tabs=False)),
    ".tsv": _Kind(lambda content: separated(text_of(content), tabs=True)),
    ".npy": _Kind(arrays.array_file, arrays.array_head),
    ".npz": _Kind(arrays.table_file, arrays.table_head),
    ".json": _Kind(lambda content: nested(text_of(content))),
    ".png": _PICTURE,
    ".jpg": _PICTURE,
    ".jpeg": _PICTURE,
}
SUFFIXES = tuple(_KINDS)

_SHEETS = "save the sheet as a table in text, with the suffix .csv"
_PICTURES = "save the picture as PNG"
_TEXTS = "if it is a table in text, give it the suffix .csv"
_HINTS = {
    **dict.fromkeys((".xls", ".xlsx", ".ods", ".numbers"), _SHEETS),
    **dict.fromkeys((".gif", ".bmp", ".webp", ".tif", ".tiff", ".svg", ".heic"), _PICTURES),
    **dict.fromkeys(("", ".txt", ".dat", ".data", ".asc", ".tab"), _TEXTS),
    **dict.fromkeys((".pkl", ".pickle"), "a pickle can run any program when it is read: save arrays by `numpy.savez`"),
}

MEMORY = Memory()


def digest(content: bytes) -> str:
    """What tells one content from another."""
    return blake2b(content, digest_size=16).hexdigest()


def read(path: Path) -> bytes | DataMistake:
    """The content of a file."""
    try:
        if path.is_dir():
            return _unreadable(f"{quoted(path.name)} is a folder, not a file", "name a file within it")
        if path.exists() and not path.is_file():
            return _unreadable(f"{quoted(path.name)} is not an ordinary file", "copy what it gives into a file")
        return path.read_bytes()
    except FileNotFoundError:
        return _absent(path)
    except PermissionError:
        return _unreadable(
            f"the file {quoted(path.name)} cannot be read: permission denied", "ask for permission to read it"
        )
    except (OSError, ValueError) as error:
        said = error.strerror if isinstance(error, OSError) else str(error)
        return _unreadable(f"the file {quoted(path.name)} can't be read: {said}", "")


def _absent(path: Path) -> DataMistake:
    try:
        beside = sorted(entry.name for entry in path.parent.iterdir())
    except OSError:
        hint = "names of files count from the folder of the program"
        return _unreadable(f"there is no folder {quoted(str(path.parent))}", hint)
    meant = suggest(path, beside)
    near = " or ".join(f"`{name}`" for name in meant)
    hint = f"did you mean {near}?" if near else ""
    return _unreadable(f"there is no file {quoted(path.name)}", hint, meant)


def beside(folder: Path) -> tuple[str, ...]:
    """The names of the files of data in a folder, in order; none where it can't be read."""
    try:
        names = sorted(entry.name for entry in folder.iterdir())
    except OSError:
        return ()
    return tuple(name for name in names if Path(name).suffix.lower() in _KINDS)


def _unreadable(message: str, hint: str, meant: tuple[str, ...] = ()) -> DataMistake:
    return DataMistake(UNREADABLE, message, hint=hint, meant=meant)


def suggest(path: Path, siblings: Iterable[str]) -> tuple[str, ...]:
    """Names of files beside a missing one that may have been meant, the nearest first."""
    import difflib  # most programs name files that are there

    known: dict[str, str] = {}
    for name in siblings:
        if Path(name).suffix.lower() in _KINDS:
            known.setdefault(name.lower(), name)
    near = difflib.get_close_matches(path.name.lower(), known, n=3, cutoff=0.6)
    other = [name for name in known if Path(name).stem == path.stem.lower() and name not in near]
    return tuple(known[name] for name in [*near, *other][:3])


def shape_of(path: Path, content: bytes) -> Shape | DataMistake:
    """What kind of value a file holds. Arrays and pictures that are sound at sight are known by their heads, without
    numpy."""
    try:
        known = _kind(path).head(content)
    except DataRefused as refused:
        return refused.mistake
    if known is not None:
        return known
    found = values_of(path, content)
    return found if isinstance(found, DataMistake) else shape(found)


def values_of(path: Path, content: bytes) -> Value | DataMistake:
    """What a file holds."""
    key = f"{path.suffix.lower()} {digest(content)}"
    found = MEMORY.get(key)
    if found is not None:
        return found
    try:
        found = _kind(path).value(content)
    except DataRefused as refused:
        found = refused.mistake
    if not (isinstance(found, DataMistake) and found.code == NO_PACKAGE):  # which may have come by the next time
        MEMORY.put(key, found)
    return found


def _kind(path: Path) -> _Kind:
    suffix = path.suffix.lower()
    if suffix not in _KINDS:
        what = f"files with the suffix {suffix} can't be read" if suffix else "a file without a suffix can't be read"
        known = f"known are {', '.join(SUFFIXES)}"
        hint = f"{_HINTS[suffix]}; {known}" if suffix in _HINTS else known
        raise DataRefused(DataMistake(UNKNOWN_KIND, what, found=suffix, expected=", ".join(SUFFIXES), hint=hint))
    return _KINDS[suffix]
