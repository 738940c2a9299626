"""Files of data that programs name: what kind of value each holds, as a question about the program.

Owns `data_file`. A path is looked for from the folder of the file that names it. What a file holds is an input of the
database, as texts are: it is read once, and again when it has changed on disk.
"""

from __future__ import annotations

import os.path

from msgspec import Struct

from potto.data.mistakes import UNREADABLE, DataMistake
from potto.data.values import Shape
from potto.query import Database, query

_NO_FILES = "this program is not in a folder: save it in a file, or give the data as an argument"


class DataFile(Struct, frozen=True):
    """A file of data as it was read: where it is, the digest of its content, and what it holds."""

    path: str
    digest: str
    shape: Shape


def path_of(file: str, written: str) -> str:
    """The file that a name in a program means."""
    return os.path.abspath(os.path.join(os.path.dirname(file), os.path.expanduser(written)))


@query
def data_file(db: Database, file: str, written: str) -> DataFile | DataMistake:
    """What a file of data holds, or what is wrong with it."""
    path = path_of(file, written)
    found: DataFile | DataMistake | None = db.get_input(("data", path))
    return found if found is not None else DataMistake(UNREADABLE, "this program cannot read files", hint=_NO_FILES)
