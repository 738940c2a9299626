"""The garbage collector in the server: it must never run for long in the middle of a keystroke.

Loaded code and the memos of the first check live as long as the session, so they are exempt from collection. Until
that check is over nothing is collected, since nearly everything that it makes stays. After it the rest is collected in
small steps while nobody waits (`tidy`, `rest`); collections that come by themselves, after so many new objects that
they take 10 to 40 ms, are left for work that never pauses.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

THRESHOLDS = (50_000, 1_000, 1_000)
YOUNG = 4_000  # new objects after which they are looked at between two keys: that takes a millisecond or two
MIDDLE = 16  # looks after which what has survived them is looked at as well: some ten milliseconds


@contextmanager
def loading() -> Iterator[None]:
    """Load code without collections, and exempt it from later ones."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()


def begin_collecting() -> None:
    """Exempt what exists now; from here on there are collections."""
    gc.freeze()
    gc.set_threshold(*THRESHOLDS)
    gc.enable()


def tidy() -> None:
    """Collect among the new objects, if they are many. For moments when open files have been told of."""
    if gc.isenabled() and gc.get_count()[0] > YOUNG:
        gc.collect(0)


def rest() -> None:
    """Collect among those that have survived this, too, if they are many. For when there is nothing to be done."""
    if gc.isenabled() and gc.get_count()[1] > MIDDLE:
        gc.collect(1)
