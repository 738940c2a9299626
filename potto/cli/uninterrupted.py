"""Work that is brought to its end before an interrupt counts.

Owns `uninterrupted`.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def uninterrupted() -> Iterator[list[int]]:
    """An interrupt is put into the list, as what took long is done and is only being written; a second one is met at
    once."""
    met: list[int] = []

    def later(number: int, _: FrameType | None) -> None:
        if met:
            raise KeyboardInterrupt
        met.append(number)

    if threading.current_thread() is not threading.main_thread():  # signals are no concern of others
        yield met
        return
    before = signal.signal(signal.SIGINT, later)
    try:
        yield met
    finally:
        signal.signal(signal.SIGINT, before)
