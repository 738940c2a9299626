"""What was found out about programs, kept on disk. It holds while all that it was read from stays the same.

Owns `Question`, what a command asks of which programs, and `keep_said` and `said_earlier` for what is said about one
file of a database. An answer is kept with the digests of all that was read for it, what imports lead to among it, and
of files that were looked for and are not there; it is given again if each of them is what it was. No syntax is loaded
for that. What commands keep rests on the texts of programs alone: nothing of data or the contents of folders, nor of a
project file that is not understood.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Hashable, Mapping
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from potto.core.packing import keep, recall
from potto.digests import blake2b
from potto.projects.project import Projects

if TYPE_CHECKING:
    from potto.query import Database
    from potto.reports.render import Located

KIND = "checked"
MOST_READ = 5_000  # texts and folders that what is said about a file may rest on
_ABSENT = b""  # the digest of a file that is not there
_MARK = b"\xef\xbb\xbf"  # of the order of bytes, which is not part of a text


def _given_again(key: bytes, now: Callable[[str], bytes | None]) -> Any:
    """The answer kept under a key, if everything that was read for it still has the same digest; else None."""
    found = recall(KIND, key)
    if found is None:
        return None
    reads, answer = found
    return answer if all(now(name) == digest for name, digest in reads.items()) else None


class Question(Struct, frozen=True):
    """What a command asks of programs: its name and the words that the answer depends on, and the paths of files."""

    words: tuple[Hashable, ...]
    paths: tuple[str, ...]

    @property
    def _key(self) -> bytes | None:
        """All that the answer depends on beside texts; None where a path is not a file, so that what it
        stands for may change, or a project file is not understood."""
        if not all(path != "-" and os.path.isfile(path) for path in self.paths):
            return None
        here, projects = os.getcwd(), Projects()
        files = tuple(map(os.path.abspath, self.paths))
        found = [projects.of(path) for path in (here, *files)]
        if any(project is not None and project.problems for project in found):
            return None
        return repr((self.words, here, files, found)).encode("utf-8", "surrogatepass")

    def recalled(self) -> Any:
        """The answer that was kept; None if there is none, or a text has changed since."""
        key = self._key
        return None if key is None else _given_again(key, _on_disk)

    def keep(self, answer: object, db: Database) -> None:
        """Keep the answer that a database has led to. Texts that were put into it must follow from the question."""
        key, texts = self._key, _texts(db)
        if key is not None and texts is not None:
            keep(KIND, key, (texts, answer))


def _texts(db: Database) -> Mapping[str, bytes] | None:
    """The files that a database has read, with the digests of their texts; None if it has read anything else."""
    found = dict[str, bytes]()
    for key, node in db.inputs():
        match key, node.value:
            case ("roots",) | ("overlay", _), _:
                continue
            case ("file", str(path)), None:
                found[path] = _ABSENT
            case ("file", str(path)), str(text):
                found[path] = _digest(text.encode())
            case _:
                return None
    return found


def _on_disk(path: str) -> bytes | None:
    """The digest of a file as it is now; None if something is there that cannot be read as a file."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):  # reading a pipe might never end
            return None
        with open(path, "rb") as file:
            return _digest(file.read().removeprefix(_MARK))
    except (FileNotFoundError, NotADirectoryError):
        return _ABSENT
    except (OSError, ValueError):  # ValueError: a NUL in the path
        return None


def _digest(text: bytes) -> bytes:
    return blake2b(text, digest_size=16).digest()


# What is said about one file of a database


def said_earlier(db: Database, file: str) -> tuple[Located, ...] | None:
    """What an earlier session has said about a file, if that still holds."""
    found: tuple[Located, ...] | None = _given_again(_said_of(file), lambda name: _in_database(db, name))
    return found


def keep_said(db: Database, file: str) -> None:
    """Keep what is said about a file of which all is known. An open file and the one on disk are one text."""
    from potto.checking.check import diagnostics

    keys = db.inputs_below(diagnostics.__name__, (file,)) if os.path.isabs(file) else None
    if keys is not None and len(keys) <= MOST_READ:
        names = dict.fromkeys(map(_name, keys))
        keep(KIND, _said_of(file), ({name: _in_database(db, name) for name in names}, diagnostics(db, file)))


def _said_of(file: str) -> bytes:
    return repr(("said of", file)).encode("utf-8", "surrogatepass")


def _name(key: Hashable) -> str:
    """How an input is called by what rests on it."""
    assert isinstance(key, tuple)
    kind, *path = key
    return ":".join(("text" if kind in ("file", "overlay") else kind, *path))


def _in_database(db: Database, name: str) -> bytes:
    """The digest of what is read under a name now."""
    from potto.modules.texts import content

    kind, *path = name.split(":", 1)
    value = content(db, path[0]) if kind == "text" else db.get_input((kind, *path))
    return _digest(repr(value).encode("utf-8", "surrogatepass"))
