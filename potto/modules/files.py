"""Files on disk, and in open editors, as inputs of the database.

Owns `Files`: loading, what is wrong with a file that is not text, the workspace's roots, unsaved texts, and noticing
what changed on disk. Queries never read the disk. They read the inputs `("file", key)`, `("overlay", key)`,
`("folder", path)`, `("data", path)`, which is what a file of data holds, and `("workspace",)`; an input that was never
set is loaded once, at its first reading (`Database.on_missing_input`), which is sound because nothing can have read it
before. From then on only `refresh` changes it, also for files that were not there: that is how a lookup finds out that
a candidate has appeared.

Durability: texts on disk 1, open files 0, so that typing verifies nothing of files that are not open.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Hashable, Iterable
from pathlib import Path

from msgspec import Struct

from potto.data.mistakes import DataMistake
from potto.modules.data import DataFile
from potto.modules.folders import Programs, list_folder
from potto.modules.lookup import SUFFIXES
from potto.modules.texts import Unreadable
from potto.query import Database

MAX_BYTES = 16_000_000
DISK, OPEN = 1, 0
Stamp = tuple[int, int, int] | None


class ReadFile(Struct, frozen=True):
    """A file as it was read, and how to see that it changed since."""

    content: str | Unreadable | None
    stamp: Stamp


def load(path: str) -> ReadFile:
    """Read a file. What keeps it from being a text is told as a value."""
    try:
        status = os.stat(path)
    except (FileNotFoundError, NotADirectoryError):
        return ReadFile(None, None)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        return ReadFile(Unreadable("no access", _reason(error)), None)
    stamp = (status.st_mtime_ns, status.st_size, status.st_ino)
    if stat.S_ISDIR(status.st_mode):
        return ReadFile(Unreadable("folder"), stamp)
    if not stat.S_ISREG(status.st_mode):  # reading a pipe or a device might never end
        return ReadFile(Unreadable("not a file"), stamp)
    if status.st_size > MAX_BYTES:
        return ReadFile(Unreadable("too large", f"{status.st_size:,} bytes"), stamp)
    try:
        with open(path, "rb") as file:
            data = file.read(status.st_size + 1)  # not the most that is allowed: so much memory would be asked for
            if len(data) > status.st_size:  # it has grown since
                data += file.read(MAX_BYTES)
    except OSError as error:
        return ReadFile(Unreadable("no access", _reason(error)), stamp)
    return ReadFile(decode(data), stamp)


def load_data(path: str) -> tuple[DataFile | DataMistake, Stamp]:
    """What a file of data holds, or what is wrong with it."""
    from potto.data.files import digest, read, shape_of

    stamp = stamp_of(path)
    content = read(Path(path))
    if isinstance(content, DataMistake):
        return content, stamp
    shape = shape_of(Path(path), content)
    return (shape if isinstance(shape, DataMistake) else DataFile(path, digest(content), shape)), stamp


def stamp_of(path: str) -> Stamp:
    """What tells whether a file has changed; None where there is none."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def decode(data: bytes) -> str | Unreadable:
    """The text of a file's bytes: UTF-8, with or without a byte order mark (which is not part of the text)."""
    for mark, name in ((b"\xff\xfe", "UTF-16"), (b"\xfe\xff", "UTF-16")):
        if data.startswith(mark):
            return Unreadable("not text", f"it begins like a file in {name}", 0)
    head = 3 if data.startswith(b"\xef\xbb\xbf") else 0
    try:
        return data[head:].decode("utf-8")
    except UnicodeDecodeError as error:
        return Unreadable("not text", f"the byte 0x{data[head + error.start]:02x}", head + error.start)


class Files:
    """The files of one database. Every method may be called from any thread."""

    def __init__(self, db: Database, roots: Iterable[str | os.PathLike[str]] = ()) -> None:
        self.db = db
        self._stamps: dict[str, Stamp] = {}
        self._data_stamps: dict[str, Stamp] = {}
        self._found = Programs()
        db.on_missing_input = self._load_input
        self.set_roots(roots)

    @staticmethod
    def key(path: str | os.PathLike[str]) -> str:
        """How the database calls a file: its normalized absolute path; a pseudo name such as `<text>` stays."""
        name = os.fspath(path)
        return name if name.startswith("<") else os.path.abspath(name)

    @property
    def roots(self) -> tuple[str, ...]:
        """The folders in which modules are looked for after the importing file's own."""
        found: tuple[str, ...] = self.db.get_input(("roots",), ())
        return found

    def set_roots(self, roots: Iterable[str | os.PathLike[str]]) -> None:
        """Set the workspace's folders. What is in them is listed when it is first asked for."""
        with self.db.evaluating():
            self.db.set_input(("roots",), tuple(dict.fromkeys(self.key(root) for root in roots)), DISK)
            if self.db.has_input(("workspace",)):
                self._list_workspace()

    def open(self, path: str | os.PathLike[str], text: str | None = None) -> str:
        """The key of a file whose text is at hand from now on: `text` if given (an editor's), else as on disk."""
        key = self.key(path)
        if text is not None:
            self.set_text(key, text)
        else:
            self.db.get_input(("file", key))
        return key

    def set_text(self, key: str, text: str) -> None:
        """The text of an open editor or of a pseudo file. It wins over the disk until `close`."""
        with self.db.evaluating():
            appears = self.db.has_input(("workspace",)) and self.db.get_input(("overlay", key)) is None
            self.db.set_input(("overlay", key), text, OPEN)
            if appears:
                self._list_workspace()

    def close(self, key: str) -> None:
        """The editor is closed: what is on disk counts again, as it is now."""
        self.db.set_input(("overlay", key), None, DISK)
        self.refresh((key,))

    def refresh(self, keys: Iterable[str] | None = None) -> tuple[str, ...]:
        """Look at the disk again, at all that was ever asked for or just at `keys`; the files that changed.

        The disk is read without holding the database. Of two threads that refresh at once the slower may bring the
        older text; its stamp then tells the next refresh so.
        """
        seen = dict.fromkeys(self._seen())
        wanted = seen if keys is None else [key for key in dict.fromkeys(keys) if key in seen]
        changed = [(key, fresh) for key in wanted if (fresh := self._look_again(key)) is not None]
        fresh_data = [(key, load_data(key)) for key in self._data_that_changed(keys)]
        with self.db.evaluating():
            differ = [key for key, fresh in changed if self.db.set_input(("file", key), fresh.content, DISK)]
            self._stamps.update((key, fresh.stamp) for key, fresh in changed)
            for path, (held, stamp) in fresh_data:
                self._data_stamps[path] = stamp
                if self.db.set_input(("data", path), held, DISK):
                    differ.append(path)
            for key in self.db.input_keys() if keys is None else ():
                if isinstance(key, tuple) and key[0] == "folder":
                    self.db.set_input(key, list_folder(key[1]), DISK)
            if keys is None and self.db.has_input(("workspace",)):
                self._list_workspace()
        return tuple(dict.fromkeys(differ))  # data that a message has shown is a file as well

    def all_files(self) -> tuple[str, ...]:
        """The programs under the roots (see `folders` for which), and those that are open, sorted."""
        found: tuple[str, ...] = self.db.get_input(("workspace",), ())
        return found

    def _seen(self) -> list[str]:
        keys = self.db.input_keys()
        return [key[1] for key in keys if isinstance(key, tuple) and key[0] == "file" and os.path.isabs(key[1])]

    def data_files(self) -> tuple[str, ...]:
        """The files of data that programs have asked for."""
        return tuple(self._data_stamps)

    def _data_that_changed(self, keys: Iterable[str] | None) -> list[str]:
        wanted = self._data_stamps if keys is None else [key for key in keys if key in self._data_stamps]
        return [key for key in wanted if stamp_of(key) != self._data_stamps[key]]

    def _look_again(self, key: str) -> ReadFile | None:
        """The file as it is now if it is not as it was."""
        try:
            status = os.stat(key)
            stamp: Stamp = (status.st_mtime_ns, status.st_size, status.st_ino)
        except (OSError, ValueError):
            stamp = None
        return load(key) if stamp is None or stamp != self._stamps.get(key, (0, 0, 0)) else None

    def _load_input(self, key: Hashable) -> tuple[object, int] | None:
        """The first reading of an input that nobody has set."""
        match key:
            case ("file", str(path)):
                if not os.path.isabs(path):
                    return None, DISK
                loaded = load(path)
                self._stamps[path] = loaded.stamp
                return loaded.content, DISK
            case ("data", str(path)):
                held, self._data_stamps[path] = load_data(path)
                return held, DISK
            case ("overlay", str()):
                return None, DISK
            case ("folder", str(path)):
                return list_folder(path), DISK
            case ("workspace",):
                return self._programs(), DISK
        return None

    def _list_workspace(self) -> None:
        self.db.set_input(("workspace",), self._programs(), DISK)

    def _programs(self) -> tuple[str, ...]:
        unsaved = [
            key[1]
            for key in self.db.input_keys()
            if isinstance(key, tuple) and key[0] == "overlay" and self.db.get_input(key) is not None
        ]
        return tuple(sorted({*self._found.under(self.roots), *(key for key in unsaved if key.endswith(SUFFIXES))}))


def open_files(db: Database, roots: Iterable[str | os.PathLike[str]] = ()) -> Files:
    """Let a database read from disk, with the workspace's folders."""
    return Files(db, roots)


def load_file(db: Database, path: str | os.PathLike[str]) -> str:
    """Read a file from disk now, whatever was known of it, and give its key."""
    key = Files.key(path)
    db.set_input(("file", key), load(key).content, DISK)
    return key


def _reason(error: Exception) -> str:
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)
