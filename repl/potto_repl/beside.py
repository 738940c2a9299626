"""What goes on beside the prompt, on threads of its own: checking what is typed, and the line that shows progress.

Owns `Checker` and `Progress`. Neither ever keeps the person waiting: a check is cancelled when an entry is handed in.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TextIO

from potto_repl.start import Loader

PAUSE = 0.2  # seconds without a key before a text is checked
PATIENCE = 0.5  # seconds before progress is shown
CLEAR = "\r\x1b[K"

Mark = tuple[int, int]


class Checker:
    """Checks the newest text that it was given, and keeps what is wrong with it."""

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
        """Check this text when there is time; whatever was to be checked before is not."""
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
        from potto_repl.symbols import readable

        if not text.strip() or text.lstrip().startswith(":") or text.rstrip().endswith("?") or readable(text) != text:
            return ()
        if not self.loader.ready or completeness(text) == "incomplete":
            return ()
        try:
            found = self.loader.session.wrong(text)
        except Cancelled:
            return None
        return tuple((d.span.start, d.span.end) for d in found)


class Progress:
    """A line that says that something is going on, after a while, and goes away when it is over."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._shown = False
        self._text = "evaluating"
        self._share: float | None = None
        self._start = 0.0

    def __enter__(self) -> Progress:
        self._over.clear()
        self._text, self._share, self._start = "evaluating", None, time.perf_counter()
        threading.Thread(target=self._run, name="potto-progress", daemon=True).start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._over.set()
        self.clear()

    def note(self, text: str, share: float | None = None) -> None:
        """What is being done, and which share of it is over."""
        self._text, self._share = text, share

    def clear(self) -> None:
        """Take the line away, before something else is written."""
        with self._lock:
            if self._shown:
                self.stream.write(CLEAR)
                self.stream.flush()
                self._shown = False

    def _run(self) -> None:
        wait = PATIENCE
        while not self._over.wait(wait):
            wait = 0.2
            with self._lock:
                if not self._over.is_set():
                    self.stream.write(f"{CLEAR}{self.line()}")
                    self.stream.flush()
                    self._shown = True

    def line(self) -> str:
        """`step 3, value 0.2, 1.4 s, 2.0 s left (Ctrl-C stops)`."""
        spent = time.perf_counter() - self._start
        left = f", {spent * (1 - self._share) / self._share:.1f} s left" if self._share else ""
        return f"{self._text}, {spent:.1f} s{left} (Ctrl-C stops)"
