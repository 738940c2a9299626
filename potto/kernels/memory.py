"""Memory that is freed is kept for the arrays to come.

Owns `kept`. The allocator of C gives large blocks back to the system when they are freed, and maps their pages anew for
the next one, which takes as long as what is done to the numbers in them. glibc learns from what it sees: once a block
was freed, blocks up to its size are taken from memory that it keeps, up to twice that much. So one is freed that nobody
has touched, and that has no pages yet. Other allocators don't mind.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

BYTES = 16 << 20  # twice this is kept: more than the arrays of a chunk of samples, or of a batch's nodes, take together


@lru_cache(maxsize=1)
def kept() -> None:
    """From now on large arrays take the memory of those before them."""
    np.empty(BYTES, dtype=np.uint8)
