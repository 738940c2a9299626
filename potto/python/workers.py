"""Processes of this machine as an executor: what `--workers` stands for.

Owns `Workers`. Processes and not threads: a kernel is a chain of short calls of numpy, between which Python holds its
lock. Pictures of 512 x 512 take as long on two threads as on one (half plane 55 and 57 ms, disc 35 and 37).
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any

START = 2.0  # seconds of work that pay for a process that is not there yet: it takes half of that to start


class Workers(Executor):
    """So many processes, which start with the first task. One that dies is replaced; what it worked on fails.

    They leave interrupts to the process that they work for, and end with it.
    """

    def __init__(self, count: int | None = None) -> None:
        self._max_workers = count or os.cpu_count() or 1
        self._pool: ProcessPoolExecutor | None = None

    @property
    def worth(self) -> float:
        """How many seconds of work are worth asking."""
        return START * (1 if self._pool is None else 0.2) if self._max_workers > 1 else float("inf")

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        try:
            return self._open().submit(fn, *args, **kwargs)
        except BrokenProcessPool:
            self.shutdown(wait=False)
            return self._open().submit(fn, *args, **kwargs)

    def _open(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = multiprocessing.get_context("spawn")  # threads of ours don't survive a fork
            self._pool = ProcessPoolExecutor(self._max_workers, context, _works_for_another)
        return self._pool

    def __exit__(self, *raised: object) -> None:
        """What is still worked on nobody waits for: who asked has been interrupted."""
        pool, self._pool = self._pool, None
        if pool is not None:
            for process in list((getattr(pool, "_processes", None) or {}).values()):
                process.terminate()
            pool.shutdown(cancel_futures=True)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(wait, cancel_futures=cancel_futures)


def _works_for_another() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_it, daemon=True).start()


def _end_with_it() -> None:
    """One that is killed tells nobody: its workers would wait for tasks for ever, and whoever reads what they print."""
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(1)
