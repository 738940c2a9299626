"""A line that says how far an evaluation is, and how long the rest may take, for a person who waits.

Owns `Progress`, `shown` and `duration`.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:  # the prompt shows itself before what evaluates is loaded
    from potto.runtime.evaluation.gauge import Gauge

PATIENCE = 0.5  # seconds before progress is shown
PLAIN = "evaluating"  # one evaluation, whose gauge says how far it is
CLEAR, DIM, OFF = "\r\x1b[K", "\x1b[2m", "\x1b[0m"


class Progress:
    """A line that says that something is going on, after a while, and goes away when it is over.

    columns: how wide the terminal is; a line that did not fit could not be taken away. dim: whether it may have a
    style. gauge: how far the evaluation has come, set by who starts it.
    """

    def __init__(self, stream: TextIO, columns: Callable[[], int] = lambda: 80, dim: bool = False) -> None:
        self.stream = stream
        self.columns = columns
        self.dim = dim
        self.gauge: Gauge | None = None
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._shown = False
        self._text = ""
        self._share: float | None = None
        self._open = False
        self._start = 0.0

    def __enter__(self) -> Progress:
        self._over = threading.Event()
        self.note(PLAIN)
        self.gauge, self._start = None, time.perf_counter()
        threading.Thread(target=self._run, args=(self._over,), name="potto-progress", daemon=True).start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._over.set()
        self.say("")

    def note(self, text: str, share: float | None = None, *, open: bool = False) -> None:
        """Note what is being done and how much of it is over. `open`: of what is known so far; there may be more."""
        self._text, self._share, self._open = text, share, open

    def say(self, text: str) -> None:
        """Write something else, in place of the line."""
        with self._lock:
            self.stream.write(f"{CLEAR if self._shown else ''}{text}")
            self.stream.flush()
            self._shown = False

    def _run(self, over: threading.Event) -> None:
        wait = PATIENCE
        while not over.wait(wait):
            wait = 0.2
            with self._lock:
                if not over.is_set():
                    line = self.line(time.perf_counter())
                    self.stream.write(f"{CLEAR}{DIM}{line}{OFF}" if self.dim else f"{CLEAR}{line}")
                    self.stream.flush()
                    self._shown = True

    def line(self, now: float) -> str:
        """`evaluating, 1,200,000 evaluations, 1.4 s, at most 20 s left (Ctrl-C stops)`, as far as there is room."""
        gauge, spent = self.gauge, duration(now - self._start)
        asked = f"{gauge.evaluations:,} evaluations" if gauge is not None and gauge.evaluations else ""
        left, stops = self._left(now), "(Ctrl-C stops)"
        room = self.columns() - 1
        for words in ([self._text, asked, spent, left], [self._text, spent, left], [self._text, spent], [spent, left]):
            line = ", ".join(filter(None, words))
            if len(line) + 1 + len(stops) <= room:
                return f"{line} {stops}"
        return f"{spent} (Ctrl-C)"[:room]

    def _left(self, now: float) -> str:
        """How long it will go on, as far as anyone knows."""
        gauge = self.gauge
        if self._share:
            return f"{_rest(now - self._start, self._share)}{' or more' if self._open else ''} left"
        left = gauge.left(now) if gauge is not None and self._text == PLAIN else None
        return "" if gauge is None or left is None else f"{'at most ' if gauge.limit else ''}{duration(left)} left"


@contextmanager
def shown(stream: TextIO, dim: bool = False) -> Iterator[None]:
    """In this block a line says how far an evaluation is, for a person who waits; it goes away when it is over. Nothing
    where the stream is no terminal."""
    if not stream.isatty():
        yield
        return
    from potto.runtime.evaluation.gauge import Gauge, watching

    def columns() -> int:
        try:
            return os.get_terminal_size(stream.fileno()).columns or 80
        except (OSError, ValueError):
            return 80

    with Progress(stream, columns, dim) as progress, watching(Gauge()) as progress.gauge:
        yield


def _rest(spent: float, share: float) -> str:
    return duration(spent * (1 - share) / share)


def duration(seconds: float) -> str:
    """A waiting time: `1.4 s`, `12 min`, `3.1 h`."""
    if seconds < 100:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
