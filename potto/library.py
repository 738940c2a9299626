"""Files and what is wrong with them: a database that reads from disk, for whoever needs no numbers.

Owns `Library`. Everything may be called from several threads.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

from potto.check import diagnostics, errors_of
from potto.diagnostics import Diagnostic, declare
from potto.modules import Unreadable, open_files, source
from potto.modules.files import MAX_BYTES, decode
from potto.modules.texts import content
from potto.query import Database
from potto.render import Located, ProgramError
from potto.source import SourceText, Span

NOWHERE = Span(0, 0)
NO_FILE = declare("P0230", "a file that does not exist")
NO_SUCH_DEFINITION = declare("P0232", "a name on the command line that the file does not define")
NOT_READABLE = declare("P0231", "a file that cannot be read as a program")


class Library:
    """Programs from disk and from memory, checked."""

    def __init__(self, roots: Sequence[str | os.PathLike[str]] = ()) -> None:
        self.db = Database()
        self.files = open_files(self.db, roots)

    def key(self, path: str | os.PathLike[str]) -> str:
        """How the database calls a file."""
        return self.files.key(path)

    def put(self, key: str, text: str) -> str:
        """Give a file, or a pseudo file such as `<text>`, a text that counts instead of what is on disk."""
        self.files.set_text(key, text)
        return key

    def put_bytes(self, key: str, data: bytes) -> Located | None:
        """The same from bytes; the diagnostic if they are no text."""
        text = decode(data) if len(data) <= MAX_BYTES else Unreadable("too large", f"{len(data):,} bytes")
        if isinstance(text, Unreadable):
            return Located(key, _complaint(text))
        self.put(key, text)
        return None

    def unreadable(self, key: str) -> Located | None:
        """What keeps a file from being read as a program, if anything does."""
        found = content(self.db, key)
        if isinstance(found, str):
            return None
        return Located(key, NO_FILE(NOWHERE, "there is no such file") if found is None else _complaint(found))

    def must_exist(self, key: str) -> None:
        """Raise ProgramError if a file cannot be read as a program."""
        problem = self.unreadable(key)
        if problem is not None:
            raise ProgramError([problem], self.source)

    def refresh(self) -> bool:
        """Read again what has changed on disk; True if anything had."""
        return bool(self.files.refresh())

    def source(self, file: str) -> SourceText | None:
        """The text of a file."""
        return source(self.db, file)

    def diagnostics(self, file: str) -> tuple[Located, ...]:
        """Everything there is to say about a file."""
        return diagnostics(self.db, file)

    def require(self, file: str) -> None:
        """Raise ProgramError if there is an error in a file."""
        wrong = errors_of(self.diagnostics(file))
        if wrong:
            raise ProgramError(wrong, self.source)


def _complaint(found: Unreadable) -> Diagnostic:
    detail = f": {found.detail}" if found.detail else ""
    match found.reason:
        case "folder":
            return NO_FILE(NOWHERE, "this is a folder, and a file is needed here")
        case "not a file":
            return NOT_READABLE(NOWHERE, "this is no regular file")
        case "not text":
            message = f"this file is not UTF-8 text{detail} at byte {found.offset}"
            return NOT_READABLE(NOWHERE, message, help="programs are text; save it as UTF-8 if it is one")
        case "too large":
            return NOT_READABLE(NOWHERE, f"this file is too large to be a program{detail}")
        case "no access":
            return NOT_READABLE(NOWHERE, f"this file cannot be read{detail}")
