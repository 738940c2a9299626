"""What a prompt remembers: the session's definitions, settings, entries to undo and to save, files that it watches.

Owns `Conversation`. What becomes of files that change is for `following`. No terminal: what only a terminal can do (an
editor, progress) comes in as functions that may be missing.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from potto.diagnostics import Diagnostic
from potto.evaluating.session import Defined, Imported, Outcome, Session
from potto.projects.settings import DEFAULTS, Settings
from potto.source import SourceText
from potto_repl.options import Options

if TYPE_CHECKING:
    from potto_repl.shown_values import Parts

TYPING = "<typing>"
_OUT = re.compile(r"\bOut\[(\d+)\]")


class Entry(Struct):
    """One entry that was read: its number, its text and what became of it."""

    number: int
    text: str
    file: str
    outcomes: list[Outcome] = []


class Before(Struct, frozen=True):
    """What was in scope before an entry: what `:undo` goes back to."""

    label: str
    prelude: tuple[str, ...]
    loaded: tuple[str, ...]
    entries: int


class Conversation(Session):
    """A session with what a prompt keeps beside it."""

    def __init__(self, roots: Sequence[str | os.PathLike[str]] = (".",)) -> None:
        super().__init__(roots)
        self.settings: Settings = DEFAULTS
        self.options = Options()
        self.entries: list[Entry] = []
        self.undoing: list[Before] = []
        self.written: dict[str, SourceText] = {}  # entries as they were typed, where that differs from what was run
        self.broken: dict[str, object] = {}  # loaded files that mean what they meant before, by how they were then
        self.parts: dict[tuple[str, str], Parts | None] = {}  # of derivatives that were answered, by their definition
        self.last_code: str | None = None
        self.last_picture: Any = None
        self.watching = False
        self.leaving = False
        self.record: str | None = None  # the file that the transcript goes to
        self.edit: Callable[[str], str | None] | None = None
        self.progress: Callable[..., None] | None = None
        self.history: Callable[[], Sequence[str]] | None = None
        self.width: Callable[[], int] = lambda: 80

    # Entries

    def enter(self, text: str) -> Iterator[Outcome]:
        """Run an entry step by step and remember it."""
        number, file = self.coming()
        self.remember(f"entry {number}: {text.strip().partition(chr(10))[0]}")
        entry = Entry(number, text, file)
        self.entries.append(entry)
        rewritten = plain_names(text)
        if rewritten != text:
            self.written[file] = SourceText(file, text)
        try:
            for outcome in self.steps(rewritten, self.settings):
                entry.outcomes.append(outcome)
                yield outcome
        finally:
            if not any(isinstance(o, Defined | Imported) for o in entry.outcomes):
                self.undoing.pop()  # nothing means anything else now

    def wrong(self, text: str) -> list[Diagnostic]:
        """The errors that an entry would have, without entering it."""
        self.put_aside(TYPING, text)
        return [located.diagnostic for located in self.world.diagnostics(TYPING)
                if located.diagnostic.severity == "error" and located.file == TYPING]  # fmt: skip

    def put_aside(self, file: str, text: str) -> None:
        """Keep what is being typed in a pseudo file, in the scope of the session, without entering it."""
        self._put(file, plain_names(text), self.prelude)

    def source(self, file: str) -> SourceText | None:
        return self.written.get(file) or super().source(file)

    def remember(self, label: str) -> None:
        """Note what is in scope before it changes."""
        self.undoing.append(Before(label, self.prelude, tuple(self.loaded), len(self.entries)))

    def undo(self) -> str | None:
        """Take back the last change; what it was, or None."""
        if not self.undoing:
            return None
        before = self.undoing.pop()
        self.loaded[:] = before.loaded
        del self.entries[before.entries :]
        self._see(before.prelude)
        return before.label

    def reset(self) -> None:
        super().reset()
        self.entries.clear()
        self.undoing.clear()
        self.broken.clear()


def plain_names(text: str) -> str:
    """The text with `Out[3]` as `_3`, in the same columns."""
    return _OUT.sub(lambda found: f"_{found[1]}".ljust(len(found[0])), text)
