"""What one process has made and the next one can use: bytes on disk, kept by the digest of what they were made from.

Owns the store: `get(kind, key)` and `put(kind, key, data)`; `kind` says what the bytes are and names a folder, `key`
holds all that they depend on except for Potto itself, whose digest is added here. Knows nothing of what it keeps.

Some of it is machine code, so nobody but the user may be able to write into the folder; where others can, nothing is
read nor written and `complaint()` says why. An entry is its bytes behind a digest of its name and of them: what is
truncated, damaged or somebody else's counts as not there, and is written anew. Nothing is unpickled. Entries are put
in place in one step, so that any number of processes can share a store. It is bounded: the longest unused go first.

`POTTO_CACHE` is the folder to use instead of `potto` in the user's cache folder, or `off` to keep nothing;
`POTTO_CACHE_MB` is the bound in megabytes (256 if it is not set). A store that cannot be written costs time, nothing
else.
"""

from __future__ import annotations

import os
import re
import stat
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import lru_cache
from typing import TYPE_CHECKING

from msgspec import Struct

from potto.digests import blake2b

if TYPE_CHECKING:
    from pathlib import Path

DEFAULT_MB = 256
_FOLDER = "store"
_MAGIC = b"potto-1\n"
_DIGEST = 32  # bytes
_HEAD = len(_MAGIC) + _DIGEST
_KIND = re.compile(r"[a-z][a-z-]{0,30}")
_NAME = re.compile(r"[0-9a-f]{64}")
_TEMPORARY = ".new-"
# How many kilobytes were written since entries were counted the last time, a byte each: appending is one step.
_WRITTEN = "written"
# Entries are counted, and the oldest deleted, whenever this part of the bound was written; no sooner, for that lists
# the whole folder (25,000 entries of 10 kB: 0.1 s).
_SLACK = 8
_READ = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
_WRITE = os.O_WRONLY | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
_USED = 3600.0  # seconds: that an entry was used is noted no more often
_ABANDONED = 3600.0  # seconds after which nobody still writes a temporary file


class KeptKind(Struct, frozen=True):
    """How much of one kind is kept."""

    name: str
    entries: int
    size: int  # bytes, of the files


class StoreReport(Struct, frozen=True):
    """What is kept. folder: None if the store is turned off; complaint: why nothing is kept although it is on."""

    folder: Path | None
    kinds: tuple[KeptKind, ...]
    bound: int  # bytes
    complaint: str | None

    @property
    def size(self) -> int:
        """Bytes of all kinds."""
        return sum(kind.size for kind in self.kinds)


def cache_folder() -> Path | None:
    """Where Potto keeps what it can make again; None where `POTTO_CACHE` is `off`."""
    from pathlib import Path  # which an answer from the store does without

    found = _base()
    return None if found is None else Path(found)


def is_on() -> bool:
    """Whether anything is to be kept."""
    return _base() is not None


def _base() -> str | None:
    own = os.environ.get("POTTO_CACHE")
    if own:
        return None if own.lower() == "off" else own
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or os.path.expanduser("~\\AppData\\Local")
    elif sys.platform == "darwin":
        base = os.path.expanduser("~/Library/Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return os.path.join(base, "potto")


def get(kind: str, key: bytes) -> bytes | None:
    """The bytes that were put under a key; None if there are none, or none that are whole."""
    folder, name = _folder(), _name(kind, key)
    if folder is None:
        return None
    path = f"{folder}{os.sep}{kind}{os.sep}{name}"
    try:
        with open(os.open(path, _READ), "rb") as file:
            status = os.fstat(file.fileno())
            content = file.read() if stat.S_ISREG(status.st_mode) and status.st_size <= bound() else b""
    except OSError:
        return None
    data = content[_HEAD:]
    if content[:_HEAD] != _head(name, data):
        return None
    if time.time() - status.st_mtime > _USED:
        with suppress(OSError):
            os.utime(path)
    return data


def put(kind: str, key: bytes, data: bytes) -> None:
    """Keep bytes under a key, as far as there is a store and they are no more than its slack."""
    folder, name = _folder(), _name(kind, key)
    if folder is None or len(data) > bound() // _SLACK:
        return
    place = os.path.join(folder, kind)
    temporary = os.path.join(place, f"{_TEMPORARY}{os.getpid()}-{threading.get_ident()}-{name[:16]}")
    try:
        with suppress(FileExistsError):
            os.mkdir(place, 0o700)
        try:
            with open(os.open(temporary, _WRITE | os.O_EXCL, 0o600), "wb") as file:
                file.write(_head(name, data) + data)
            _replace(temporary, os.path.join(place, name))
        finally:
            with suppress(FileNotFoundError):
                os.unlink(temporary)
        if _note_written(folder, len(data)) > bound() // _SLACK:
            _trim(folder)
    except OSError:
        return


def complaint() -> str | None:
    """Why nothing is kept although the store is on: a sentence for the user, with what to do. None where all is well.

    A folder that cannot be made or written is no reason to complain.
    """
    folder = _base()
    return None if folder is None else _judged(os.path.join(folder, _FOLDER))[1]


def refused() -> str | None:
    """The complaint, if anything was asked of the store in this process."""
    return complaint() if _judged.cache_info().currsize else None


def report() -> StoreReport:
    """What is kept now."""
    base = cache_folder()
    if base is None:
        return StoreReport(None, (), bound(), None)
    folder, sizes = os.path.join(base, _FOLDER), dict[str, list[int]]()
    for kind, _, status in _entries(folder):
        sizes.setdefault(kind, []).append(status.st_size)
    kinds = tuple(KeptKind(kind, len(found), sum(found)) for kind, found in sorted(sizes.items()))
    return StoreReport(base, kinds, bound(), complaint() or _not_written(folder))


def clear() -> None:
    """Delete all entries, of other versions of Potto, too; nothing that is not ours."""
    folder = _folder()
    if folder is None:
        return
    for _, path, _ in list(_entries(folder)):
        with suppress(OSError):
            os.unlink(path)
    _delete_abandoned(folder, 0.0)
    with suppress(OSError):
        os.unlink(os.path.join(folder, _WRITTEN))


def bound() -> int:
    """The most bytes that are kept: `POTTO_CACHE_MB`, where that is a number."""
    try:
        return max(1, int(float(os.environ.get("POTTO_CACHE_MB", "")) * 1e6))
    except (ValueError, OverflowError):
        return DEFAULT_MB * 1_000_000


@lru_cache(maxsize=1)
def program() -> bytes:
    """A digest of Potto: its files, and the Python that runs it."""
    return digest_of([os.path.dirname(os.path.abspath(__file__))])


def digest_of(folders: Iterable[str]) -> bytes:
    """A digest of programs in folders: the names, sizes and times of their files, and the Python that runs them."""
    digest = blake2b(sys.version.encode(), digest_size=16)
    for folder in folders:
        for name, status in _sources(folder):
            digest.update(f"{name}:{status.st_size}:{status.st_mtime_ns}\n".encode())
    return digest.digest()


def _sources(folder: str) -> Iterator[tuple[str, os.stat_result]]:
    with os.scandir(folder) as listed:
        found = sorted(listed, key=lambda entry: entry.name)
    for entry in found:
        if entry.name.endswith((".py", ".lark", ".so", ".pyd")):
            yield entry.path, entry.stat()
        elif entry.is_dir() and entry.name != "__pycache__":
            yield from _sources(entry.path)


# Entries


def _name(kind: str, key: bytes) -> str:
    """The name of an entry's file. Raises ValueError for a kind that could not be the name of a folder."""
    if not _KIND.fullmatch(kind):
        raise ValueError(f"{kind!r} is not a kind of entry: small letters and hyphens")
    digest = blake2b(program(), digest_size=_DIGEST)
    digest.update(kind.encode() + b"\0")
    digest.update(key)
    return digest.hexdigest()


def _head(name: str, data: bytes) -> bytes:
    """What stands before the data. The name is part of it: an entry under another one's name is not taken for it."""
    digest = blake2b(name.encode(), digest_size=_DIGEST)
    digest.update(data)
    return _MAGIC + digest.digest()


def _replace(temporary: str, path: str) -> None:
    try:
        os.replace(temporary, path)
    except OSError:
        if not os.path.isdir(path) or os.path.islink(path):
            raise
        os.rmdir(path)  # somebody's, and empty; else that entry is not kept
        os.replace(temporary, path)


def _entries(folder: str) -> Iterator[tuple[str, str, os.stat_result]]:
    """Kind, path and status of everything kept, by whatever version."""
    for kind, listed in _listed(folder):
        for entry in listed:
            if _NAME.fullmatch(entry.name):
                with suppress(OSError):
                    yield kind, entry.path, entry.stat(follow_symlinks=False)


def _within(folder: str) -> list[tuple[str, os.stat_result]]:
    """The folders of kinds, and what stands for one."""
    with suppress(OSError), os.scandir(folder) as kinds:
        return [(kind.path, kind.stat()) for kind in kinds if _KIND.fullmatch(kind.name) and kind.is_dir()]
    return []


def _listed(folder: str) -> Iterator[tuple[str, list[os.DirEntry[str]]]]:
    """The folders of kinds, each with what is in it."""
    with suppress(OSError), os.scandir(folder) as kinds:
        for kind in kinds:
            if _KIND.fullmatch(kind.name) and kind.is_dir(follow_symlinks=False):
                with suppress(OSError), os.scandir(kind.path) as listed:
                    yield kind.name, list(listed)


# The bound


def _note_written(folder: str, size: int) -> int:
    """Count what was written since the last trim; about how many bytes that are."""
    counter = os.open(os.path.join(folder, _WRITTEN), _WRITE | os.O_APPEND, 0o600)
    try:
        os.write(counter, b"." * (1 + size // 1000))
        return os.fstat(counter).st_size * 1000
    finally:
        os.close(counter)


def _trim(folder: str) -> None:
    """Delete the longest unused entries until there is room for what may be written before the next trim."""
    with suppress(OSError):
        os.truncate(os.path.join(folder, _WRITTEN), 0)
    found = sorted(_entries(folder), key=lambda entry: entry[2].st_mtime)
    excess = sum(status.st_size for _, _, status in found) - (bound() - bound() // _SLACK)
    for _, path, status in found:
        if excess <= 0:
            break
        with suppress(OSError):
            os.unlink(path)
        excess -= status.st_size
    _delete_abandoned(folder, _ABANDONED)


def _delete_abandoned(folder: str, age: float) -> None:
    """Delete what processes were about to write that have ended since."""
    before = time.time() - age
    for _, listed in _listed(folder):
        for entry in listed:
            with suppress(OSError):
                if entry.name.startswith(_TEMPORARY) and entry.stat(follow_symlinks=False).st_mtime <= before:
                    os.unlink(entry.path)


# The folder


def _folder() -> str | None:
    """The folder of entries, if there is one that can be trusted."""
    base = _base()
    return None if base is None else _judged(os.path.join(base, _FOLDER))[0]


@lru_cache(maxsize=8)
def _judged(folder: str) -> tuple[str | None, str | None]:
    """A folder, made if it is not there, or why it is not to be used (None where that need not be told).

    Looked at once in a process: it is the user's own from then on.
    """
    folder = os.path.abspath(folder)
    shared = sys.platform != "win32"  # where a user's folders are the user's own
    try:
        others = _open_around(folder) if shared else None
        if others is None:  # where it would be refused, nothing is made
            os.makedirs(os.path.dirname(folder), mode=0o700, exist_ok=True)
            with suppress(FileExistsError):
                os.mkdir(folder, 0o700)
            if not stat.S_ISDIR(os.lstat(folder).st_mode):
                return (
                    None,
                    f"nothing is kept between runs: {folder} is not a folder; delete it, or set POTTO_CACHE=off",
                )
            others = _open_within(folder) if shared else None
    except OSError:
        return None, None
    if others is None:
        return folder, None
    advice = f"chmod go-w {others}" if os.stat(others).st_uid == os.getuid() else "set POTTO_CACHE to a folder of yours"
    return None, f"nothing is kept between runs: others can write to {others}; {advice}, or set POTTO_CACHE=off"


def _not_written(folder: str) -> str | None:
    """A sentence for who asks, where there is nothing wrong with a folder but that it cannot be written."""
    if os.access(folder, os.W_OK):
        return None
    return f"nothing is kept between runs: {folder} cannot be made or written"


def _open_within(folder: str) -> str | None:
    """The folder, of this one and those in it, that is somebody else's or that others can write."""
    for path, status in ((folder, os.stat(folder)), *_within(folder)):
        if status.st_uid != os.getuid() or status.st_mode & 0o022:
            return path
    return None


def _open_around(folder: str) -> str | None:
    """The folder around this one by which somebody else could put another in its place.

    What others can write must be sticky, as /tmp is; its group is the user alone on most systems.
    """
    around = os.path.realpath(folder)
    while (parent := os.path.dirname(around)) != around:
        around = parent
        with suppress(FileNotFoundError):  # what is to be made will be the user's own
            mode = os.stat(around).st_mode
            if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
                return around
    return None
