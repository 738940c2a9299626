"""What is made once and used again, and the time that takes: kernels, plans, proofs.

Owns `making`, of that `compiling`, and `counts` of definitions linked, of kernels and of functions of machine code
(which another thread makes). What is made on the way to something else counts once. Kernels are compiled a function at
a time; the rest is about the whole of a scene: which surfaces cut what, and where they meet.
"""

from __future__ import annotations

import threading
import time

from msgspec import Struct


class Counts(Struct):
    compiled: int = 0
    recalled: int = 0  # found on disk
    reused: int = 0
    seconds: float = 0.0
    kernel_seconds: float = 0.0  # of these
    native: int = 0
    kept: int = 0
    native_seconds: float = 0.0
    native_points: int = 0
    linked: int = 0

    def so_far(self) -> tuple[int, int, int, int, float, float, int, int, int]:
        made = self.linked, self.compiled, self.reused, self.recalled, self.seconds, self.kernel_seconds
        return *made, self.native, self.kept, self.native_points


counts = Counts()


class _Making(threading.local):
    """`with making:` adds the time of the block by the clock to those seconds of `counts`. `worked`: the seconds of the
    processor, which others may be using as well, that such blocks of this thread have taken."""

    depth = 0
    start = since = worked = 0.0

    def __init__(self, seconds: str) -> None:
        self.seconds = seconds

    def __enter__(self) -> None:
        if not self.depth:
            self.start, self.since = time.perf_counter(), time.thread_time()
        self.depth += 1

    def __exit__(self, *exc: object) -> None:
        self.depth -= 1
        if not self.depth:
            setattr(counts, self.seconds, getattr(counts, self.seconds) + time.perf_counter() - self.start)
            self.worked += time.thread_time() - self.since


making, compiling = _Making("seconds"), _Making("kernel_seconds")
