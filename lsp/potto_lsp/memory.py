"""The garbage collector in the server: it must never run for long in the middle of a keystroke.

Loaded code and the memos of the first check live as long as the session, so they are exempt from collection. The rest
is collected in small steps, the old generation seldom. (With the usual thresholds one edit took 274 ms.) Until the
first check is over nothing is collected, since nearly everything that it makes stays.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

THRESHOLDS = (50_000, 50, 1_000)


@contextmanager
def loading() -> Iterator[None]:
    """Load code without collections, and exempt it from later ones."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()


def settle() -> None:
    """Exempt what exists now; from here on there are collections."""
    gc.freeze()
    gc.set_threshold(*THRESHOLDS)
    gc.enable()
