"""Memory that is freed is kept for the arrays to come.

Owns `kept`, `room`, `copied` and `apart`. The allocator of C gives large blocks back to the system when they are freed,
and maps their pages anew for the next one, which takes as long as what is done to the numbers in them, or several times
as long.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from functools import lru_cache
from mmap import ACCESS_COPY, mmap
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from potto.kernels.cells import Array

BYTES = 16 << 20  # twice this is kept: more than the arrays of a chunk of samples, or of a batch's nodes, take together
# Of one array: from how many bytes on it gets a block of ours. Blocks are kept up to so many bytes together, whether
# they are in use or not; those of a picture of 512 x 512 pixels, with what goes in and comes out, take half of them.
LARGE, MOST = 1 << 18, 64 << 20
STEPS = 8  # sizes of blocks between two powers of two, so that arrays of about one size have each other's

_lock = Lock()
_blocks: list[NDArray[np.uint8]] = []  # those that were asked for last come last


@lru_cache(maxsize=1)
def kept() -> None:
    """From now on large arrays take the memory of those before them.

    glibc learns from what it sees: once a block was freed, blocks up to its size are taken from memory that it keeps,
    up to twice that much. So one is freed that nobody has touched, and that has no pages yet. Other allocators don't
    mind. How long that lasts depends on what others allocate, so that arrays that come with every call have `room`.
    """
    np.empty(BYTES, dtype=np.uint8)


def room(*shape: int) -> Array:
    """An array of numbers that are yet to be written; a large one where one was that nobody has any more."""
    size = 8 * math.prod(shape)
    if size < LARGE:
        return np.empty(shape)
    with _lock:  # until it has an array over it a block looks free
        return _free(size)[:size].view(np.float64).reshape(shape)


def copied(array: NDArray[Any]) -> Array:
    """An array as one of doubles that is nobody else's."""
    found = room(*array.shape)
    found[...] = array
    return found


def apart(parts: Iterable[Any]) -> bool:
    """Whether no two arrays in tuples and lists of parts are one."""
    starts, left = list[int](), [*parts]
    while left:
        part = left.pop()
        if isinstance(part, np.ndarray):
            starts.append(part.__array_interface__["data"][0])
        elif isinstance(part, tuple | list):
            left += part
    return len(set(starts)) == len(starts)


def _free(size: int) -> NDArray[np.uint8]:
    """A block of at least so many bytes, and not much more, over which there are no arrays."""
    step = 1 << max(size.bit_length() - STEPS.bit_length(), 0)
    size = -(-size // step) * step
    for place in range(len(_blocks)):
        if _blocks[place].size == size and _holders(_blocks, place) == NOBODY:
            _blocks.append(_blocks.pop(place))
            return _blocks[-1]
    block = np.frombuffer(_pages(size), dtype=np.uint8)  # numpy asks for huge pages, which may take 40 ms to find
    if size <= MOST:
        _blocks.append(block)
    while sum(own.size for own in _blocks) > MOST:
        del _blocks[0]  # whoever has arrays over it keeps it
    return block


def _pages(size: int) -> mmap:
    """Memory of this process alone: by itself `mmap` shares it with those that are forked off."""
    if sys.platform == "win32":
        return mmap(-1, size)
    return mmap(-1, size, access=ACCESS_COPY)


def _holders(blocks: list[NDArray[np.uint8]], place: int) -> int:
    """How many hold a block of a list: this list, who asks, and each array over it."""
    return sys.getrefcount(blocks[place])


NOBODY = _holders([np.empty(0, dtype=np.uint8)], 0)
