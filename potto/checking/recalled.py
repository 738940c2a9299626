"""What commands found out about programs, kept on disk. It holds while the texts that it was read from stay the same.

Owns `Question`, what is asked of which programs. An answer is kept with the digests of all texts that were read for
it, those of imports among them, and of files that were looked for and are not there; it is given again if each of them
is what it was. No syntax is loaded for that. Answers that rest on anything else than the texts of programs (files of
data, the contents of folders) are not kept, nor are those under a project file that is not understood.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Hashable, Mapping
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from potto.core.packing import keep, recall
from potto.digests import blake2b
from potto.projects.project import Projects

if TYPE_CHECKING:
    from potto.query import Database

KIND = "checked"
_ABSENT = b""  # the digest of a file that is not there
_MARK = b"\xef\xbb\xbf"  # of the order of bytes, which is no part of a text


class Question(Struct, frozen=True):
    """What a command asks of programs: its name and the words that the answer depends on, and the paths of files."""

    words: tuple[Hashable, ...]
    paths: tuple[str, ...]

    @property
    def _key(self) -> bytes | None:
        """All that the answer depends on beside texts; None where a path is no file, so that what it
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
        found = None if key is None else recall(KIND, key)
        if found is None:
            return None
        texts, answer = found
        return answer if all(_on_disk(path) == digest for path, digest in texts.items()) else None

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
    """The digest of a file as it is now; None of what is there and is no file that can be read."""
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
