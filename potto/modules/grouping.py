"""Neighbours in groups that stand still while others come and go.

Owns `grouped`. At every keystroke the same is asked of everything in a file: of a group that shares what it hangs on it
is asked once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")


def grouped(items: Sequence[T], ends: Sequence[int], mean: int, most: int) -> Iterator[tuple[T, ...]]:
    """Items in groups of so many in the mean and at most. A group ends where the number of its last item in `ends`, a
    hash of it, says so: what comes or goes elsewhere leaves it as it is."""
    start = 0
    for index, end in enumerate(ends, 1):
        if index - start == most or end % mean == 0:
            yield tuple(items[start:index])
            start = index
    if start < len(items):
        yield tuple(items[start:])
