"""What goes on beside the prompt, on a thread of its own: checking what is typed.

Owns `Checker`. It never keeps the user waiting: a check is cancelled when an entry is handed in.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from potto_repl.session_loading import Loader

PAUSE = 0.2  # seconds without a key before a text is checked

Mark = tuple[int, int]


class Checker:
    """Checks the newest text it was given, and keeps what is wrong with it."""

    def __init__(self, loader: Loader, done: Callable[[], None]) -> None:
        self.loader = loader
        self.done = done
        self._wanted: str | None = None
        self._known: tuple[str, tuple[Mark, ...]] = ("", ())
        self._wake = threading.Condition()
        self._thread: threading.Thread | None = None

    def wrong(self, text: str) -> tuple[Mark, ...]:
        """What is known to be wrong with exactly this text."""
        known, marks = self._known
        return marks if known == text else ()

    def look(self, text: str) -> None:
        """Check this text when there is time. A text that was waiting is dropped."""
        with self._wake:
            self._wanted = text
            self._wake.notify()
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="potto-check", daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """Stop checking: the database is needed."""
        with self._wake:
            self._wanted = None
        if self.loader.ready:
            self.loader.session.db.cancel()

    def _run(self) -> None:
        while True:
            text = self._next()
            marks = self._marks(text)
            if marks is not None:
                self._known = (text, marks)
                self.done()

    def _next(self) -> str:
        """The next text to check: one that has stood still for a moment."""
        with self._wake:
            while True:
                while self._wanted is None:
                    self._wake.wait()
                before = self._wanted
                if not self._wake.wait(PAUSE) and self._wanted == before:
                    self._wanted = None
                    return before

    def _marks(self, text: str) -> tuple[Mark, ...] | None:
        from potto.query import Cancelled
        from potto.syntax import completeness
        from potto_repl.backslash_symbols import readable

        if not text.strip() or text.lstrip().startswith(":") or text.rstrip().endswith("?") or readable(text) != text:
            return ()
        if not self.loader.ready or completeness(text) == "incomplete":
            return ()
        try:
            found = self.loader.session.wrong(text)
        except Cancelled:
            return None
        return tuple((d.span.start, d.span.end) for d in found)
