"""How the garbage collector behaves in a server: never in the middle of a keystroke.

What is loaded and the memos of the first check live as long as the session, so they are taken out of collections; the
rest is collected in small steps, the old generation seldom. (With the usual thresholds one edit took 274 ms.) Until
the first check is over nothing is collected: nearly all that it makes stays.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

THRESHOLDS = (50_000, 50, 1_000)


@contextmanager
def loading() -> Iterator[None]:
    """Load code without collections, and leave it out of all later ones."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()


def settle() -> None:
    """What is there now stays; from now on there are collections."""
    gc.freeze()
    gc.set_threshold(*THRESHOLDS)
    gc.enable()
