"""What a prompt remembers: the session's definitions, settings, entries to undo and to save, files that it watches.

Owns `Conversation`. A file that was loaded and is broken on disk goes on meaning what it meant before, and the reload
says so. No terminal: what only a terminal can do (an editor, progress) comes in as functions that may be missing.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from potto.diagnostics import Diagnostic
from potto.modules import imported_files, names
from potto.render import Located, display_name
from potto.session import Defined, Imported, Outcome, Said, Session
from potto.settings import DEFAULTS, Settings
from potto.source import SourceText
from potto_repl.options import Options
from potto_repl.reply import Part, diagnostic, note

TYPING = "<typing>"
_OUT = re.compile(r"\bOut\[(\d+)\]")


@dataclass(slots=True)
class Entry:
    """One entry that was read: its number, its text and what became of it."""

    number: int
    text: str
    outcomes: list[Outcome] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Before:
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
        self.broken: set[str] = set()  # loaded files that mean what they meant before
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
        self.remember(f"entry {self.number + 1}: {text.strip().partition(chr(10))[0]}")
        entry = Entry(self.number + 1, text)
        self.entries.append(entry)
        rewritten = plain_names(text)
        if rewritten != text:
            self.written[f"<In {entry.number}>"] = SourceText(f"<In {entry.number}>", text)
        try:
            for outcome in self.steps(rewritten, self.settings):
                entry.outcomes.append(outcome)
                yield outcome
        finally:
            if not any(isinstance(o, Defined | Imported) for o in entry.outcomes):
                self.undoing.pop()  # nothing means anything else now

    def wrong(self, text: str) -> list[Diagnostic]:
        """The errors that an entry would have, without making it one."""
        self._put(TYPING, plain_names(text), self.prelude)
        return [located.diagnostic for located in self.world.diagnostics(TYPING)
                if located.diagnostic.severity == "error" and located.file == TYPING]  # fmt: skip

    def source(self, file: str) -> SourceText | None:
        return self.written.get(file) or super().source(file)

    def remember(self, label: str) -> None:
        """Note what is in scope before something changes it."""
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

    # Files

    def bring(self, path: str) -> list[Part]:
        """Load a file and say what it brought."""
        self.remember(f"`:load {path}`")
        outcomes = self.load(os.path.expanduser(path))
        parts = [diagnostic(o.located, self.source) for o in outcomes if isinstance(o, Said)]
        brought = [o for o in outcomes if isinstance(o, Imported)]
        if not brought:
            self.undoing.pop()
        self._elaborated()
        for item in brought:
            count = f"{len(item.names)} name{'' if len(item.names) == 1 else 's'}"
            listed = f": {', '.join(item.names[:8])}{', ...' if len(item.names) > 8 else ''}" if item.names else ""
            data = {"loaded": item.module, "names": list(item.names)}
            parts.append(Part("answer", f"{display_name(item.module)}: {count}{listed}", data))
        return parts

    def refreshed(self, quiet: bool = False) -> list[Part]:
        """Read again what changed on disk, keep old definitions where the new text is wrong, and say what was done."""
        start = time.perf_counter()
        files = self._files()
        before = {file: text.text for file in files if (text := self.world.source(file)) is not None}
        for file in self.broken:
            self.world.files.close(file)
        waiting, self.broken = self.broken, set()
        if not self.world.refresh() and not waiting:
            return [] if quiet else [Part("answer", "nothing has changed", {"reloaded": []})]
        parts: list[Part] = []
        with self.db.recording() as events:
            total = self._check_all(before, parts)
        again = {e.args for e in events if e.kind == "executed" and e.query == "core"}
        milliseconds = (time.perf_counter() - start) * 1e3
        said = f"{len(again)} of {total} recompiled, {milliseconds:.0f} ms"
        return [*parts, Part("answer", said, {"recompiled": len(again), "definitions": total})]

    def _files(self) -> list[str]:
        """The loaded files and all that they import."""
        found: dict[str, None] = {}
        todo = list(self.loaded)
        while todo:
            file = todo.pop(0)
            if file not in found:
                found[file] = None
                todo += imported_files(self.db, file)
        return list(found)

    def _check_all(self, before: dict[str, str], parts: list[Part]) -> int:
        """Check the files, set aside those that are broken now, elaborate the rest; how many definitions there are."""
        found: dict[str, list[Located]] = {}
        for file in self._files():
            found[file] = list(self.world.diagnostics(file))
        for file, said in found.items():
            parts += [diagnostic(located, self.source) for located in said]
            if any(located.diagnostic.severity == "error" for located in said) and file in before:
                parts.append(note(f"{display_name(file)}: the definitions of before are kept"))
                self.broken.add(file)
        for file in self.broken:
            self.world.files.set_text(file, before[file])
        return self._elaborated()

    def _elaborated(self) -> int:
        """Elaborate every definition of the loaded files and of those that they import; how many there are."""
        from potto.elaborate import core

        found = [(file, name) for file in self._files() for name in names(self.db, file)]
        for file, name in found:
            core(self.db, file, name)
        return len(found)


def plain_names(text: str) -> str:
    """The text with `Out[3]` as `_3`, in the same columns."""
    return _OUT.sub(lambda found: f"_{found[1]}".ljust(len(found[0])), text)
