"""When machine code takes over from numpy: once numpy has taken as long as making it is expected to.

Owns `Promotion` and `settle`. First answers never wait: the text is written when the least function that it may be
would pay, LLVM works on it in a thread of its own once this one does, as long as it is, and numpy goes on until that is
done. Who rents for as long as buying costs, and then buys, pays at most twice the least.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING

from potto.kernels.making import compiling, counts, making
from potto.kernels.native import objects
from potto.kernels.native.operations import NotStraight

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

# Seconds, as `benchmarks/calibration.py native` measures them: the loading of LLVM, once in a process; a function of
# machine code at the least, and what each line of its text adds; and what it takes to write one, which who asks waits
# for.
LLVM, LEAST, LINE, WRITTEN = 0.15, 0.003, 22e-6, 13e-6
# Lines that add as much again to what each of them takes: LLVM finds registers for all values of a block at once.
# Kernels of scenes of 2,300, 4,200 and 28,800 lines take 29, 40 and 147 us a line; sums of 3,000, 9,800 and 29,200
# lines, whose values do not live as long, 34, 49 and 78.
LONG = 7_000


def _making(lines: int) -> float:
    """Seconds that LLVM takes for so many lines."""
    return LEAST + LINE * lines * (1 + lines / LONG)


class Promotion:
    """A function of machine code: not asked for yet, on its way, ready, or impossible. name: of it in its text, which
    has so many lines at the least."""

    def __init__(self, name: str, lines: int = 0) -> None:
        self.name = name
        self.spent = 0.0
        self.impossible = False
        self._cost = _making(lines) + WRITTEN * lines
        self._text: str | None = None
        self._ready: objects.Loaded | None = None
        self._coming: Future[objects.Loaded] | None = None

    def function(self, backend: str, text: Callable[[], str]) -> objects.Loaded | None:
        """The function if it is to be used now, None if numpy is. text: what to compile; may raise NotStraight."""
        if backend == "numpy" or self.impossible:
            return None
        now = backend == "native"
        if self._ready is None and (now or self._pays()):
            self._get(text, now)
        return self._ready

    @property
    def due(self) -> bool:
        """Whether the function is to be asked for: numpy has done it for long enough, and it is not on its way."""
        return self._pays() if self._coming is None else self._coming.done()

    def by_numpy(self) -> ByNumpy:
        """A block whose time counts as that of numpy: the processor's, whoever else is using it. Kernels that are made
        in it are made once."""
        return ByNumpy(self)

    def _pays(self) -> bool:
        """Whether numpy has taken as long as machine code would; until its text is written, as the least would."""
        return self._coming is not None or (
            self.spent > self._cost + (0.0 if objects.loaded_llvm() else LLVM) and objects.available()
        )

    def _get(self, text: Callable[[], str], now: bool) -> None:
        try:
            coming = self._coming or self._asked(text, now)  # other threads may be here as well
            if coming is not None and (now or coming.done()):
                self.impossible = not now and coming.exception() is not None  # numpy goes on where LLVM can't
                self._ready = None if self.impossible else coming.result()
        except NotStraight:
            self.impossible = True

    def _asked(self, text: Callable[[], str], now: bool) -> Future[objects.Loaded] | None:
        """The function on its way, if it pays now that its text is known."""
        written = self._text
        if written is None:
            with making, compiling:
                written = self._text = text()
            self._cost = _making(written.count("\n"))
        if not (now or self._pays()):
            return None
        if self._coming is None:
            self._coming = _worker(os.getpid()).submit(_made, written, self.name)
            self._text = None
        return self._coming


class ByNumpy:
    """A block that numpy computes in; it may be as short as a kernel, so that it is not a generator."""

    __slots__ = ("made", "promotion", "start")

    def __init__(self, promotion: Promotion) -> None:
        self.promotion = promotion

    def __enter__(self) -> None:
        self.start, self.made = time.thread_time(), compiling.worked

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            self.promotion.spent += time.thread_time() - self.start - (compiling.worked - self.made)


def settle() -> None:
    """Wait until nothing is being compiled (for measurements: whatever else was asked for is not part of them)."""
    if _worker.cache_info().currsize:
        _worker(os.getpid()).submit(int).result()


def _made(text: str, name: str) -> objects.Loaded:
    start = time.perf_counter()
    found, new = objects.made(text, name)
    counts.native += new
    counts.kept += not new
    counts.native_seconds += time.perf_counter() - start
    return found


@lru_cache(maxsize=1)
def _worker(process: int) -> ThreadPoolExecutor:
    """One thread, as LLVM has one lock, in each process, as forks have no threads. It ends with the process."""
    from concurrent.futures import ThreadPoolExecutor  # takes its time to load: where code is made only

    return ThreadPoolExecutor(1, "potto-native")
