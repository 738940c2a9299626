"""Of which numbers of a batch no more is known than a part of what they are.

Owns `rough_places` and `imprecise`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from potto.integrate.columns import distinct
from potto.kernels.cells import Array, Ints, Number

AT_ONCE = 1 << 14  # numbers that are looked at together


def rough_places(numbers: Number, errors: Number, rtol: float) -> Iterator[Ints]:
    """The places of numbers that are not precise, in order: some at a time, whose sizes stay in the cache. In memory
    they take six times as long."""
    if np.shape(numbers) != np.shape(errors):
        numbers, errors = np.broadcast_arrays(numbers, errors)
    flat, off = np.reshape(numbers, -1), np.reshape(errors, -1)  # copies, where they have gaps: never of large batches
    room = np.empty(min(flat.size, AT_ONCE))
    for start in range(0, flat.size, AT_ONCE):
        some = flat[start : start + AT_ONCE]
        size = np.abs(some, out=room[: some.size])
        finite = size.max() < np.inf
        size *= rtol
        good = off[start : start + AT_ONCE] <= size
        if not finite:
            good &= np.isfinite(some)
        if not good.all():
            yield start + np.flatnonzero(~good)


def imprecise(numbers: Array, errors: Array, rtol: float) -> Ints:
    """The members of a batch, in order, of whose numbers (..., B) not all are precise."""
    places = list(rough_places(numbers, errors, rtol))
    return distinct(np.concatenate(places) % numbers.shape[-1]) if places else np.zeros(0, dtype=np.int64)
