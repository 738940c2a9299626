"""What is made once and used again, and the time that takes: kernels, plans, proofs.

Owns `making`, and `counts` of kernels. What is made on the way to something else counts once.
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


counts = Counts()


class _Making(threading.local):
    """`with making:` adds the time of the block, in this thread, to `counts.seconds`."""

    depth = 0
    start = 0.0

    def __enter__(self) -> None:
        if not self.depth:
            self.start = time.perf_counter()
        self.depth += 1

    def __exit__(self, *exc: object) -> None:
        self.depth -= 1
        if not self.depth:
            counts.seconds += time.perf_counter() - self.start


making = _Making()
