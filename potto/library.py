"""Files and what is wrong with them: a database that reads from disk, for whoever needs no numbers.

Owns `Library`. Everything may be called from several threads.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

from potto.check import diagnostics, errors_of
from potto.diagnostics import declare
from potto.modules import Unreadable, module_diagnostics, open_files, source
from potto.modules.files import MAX_BYTES, decode
from potto.modules.import_checks import unreadable
from potto.modules.texts import content
from potto.query import Database
from potto.render import Located, ProgramError
from potto.source import SourceText, Span

NOWHERE = Span(0, 0)
NO_PROGRAMS = declare("P0230", "a folder without programs")
NO_SUCH_DEFINITION = declare("P0232", "a name on the command line that the file does not define")


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
            return Located(key, unreadable(text, key, NOWHERE, "standard input"))
        self.put(key, text)
        return None

    def unreadable(self, key: str) -> Located | None:
        """What keeps a file from being read as a program, if anything does."""
        if isinstance(content(self.db, key), str):
            return None
        return Located(key, module_diagnostics(self.db, key)[0])

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
