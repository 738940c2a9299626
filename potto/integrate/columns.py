"""Arrays that belong together: the last axis of each is one batch.

Owns `side_by_side`, `distinct`, `patterns_of`, `places_of`, and `Columns`, by which sums, panels, segments and places
are picked from, put in place and joined.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from typing import Any, Self, TypeVar

import numpy as np
from msgspec import Struct

from potto.kernels.cells import Array, Bools, Ints

C = TypeVar("C", bound="Columns")
FEW = 64  # numbers, up to which they are sorted in no time


class Columns(Struct):
    """Of these the fields that are arrays have the batch as their last axis; others are the same for all."""

    def arrays(self) -> dict[str, Array]:
        return {name: x for name in self.__struct_fields__ if isinstance(x := getattr(self, name), np.ndarray)}

    def _with(self, arrays: dict[str, Array]) -> Self:
        other = copy(self)
        for name, x in arrays.items():
            setattr(other, name, x)
        return other

    def pick(self, index: Any) -> Self:
        """Some members of the batch."""
        if index.__class__ is slice:
            return self._with({n: x[..., index] for n, x in self.arrays().items()})
        if index.dtype == bool:
            index = index.nonzero()[0]
        span = run_of(index)
        if span is not None:
            return self._with({n: x[..., span] for n, x in self.arrays().items()})
        return self._with({n: x.take(index, -1) for n, x in self.arrays().items()})

    def put(self, index: Any, part: Self) -> None:
        """Replace some members of the batch; of what is not known of the part, nothing is known of the whole."""
        there, span = part.arrays(), run_of(index)
        where: Any = index if span is None else span
        for name, x in self.arrays().items():
            if name not in there:
                setattr(self, name, None)
            elif where.__class__ is slice or where.size <= FEW:
                x[..., where] = there[name]
            else:  # row by row, which of many members takes a fifth of the time
                own = np.broadcast_to(there[name], (*x.shape[:-1], where.size))
                for row in np.ndindex(x.shape[:-1]):
                    x[row][where] = own[row]


def run_of(index: Any) -> slice | None:
    """The places that an index has, where they are one after the other in order; None for all others, also for places
    that are in another order or come several times."""
    if index.__class__ is slice or index.size < 2 or index[-1] - index[0] + 1 != index.size:
        return None
    if (np.diff(index) != 1).any():
        return None
    return slice(int(index[0]), int(index[-1]) + 1)


def joined(parts: Sequence[C]) -> C:
    """Batches put together, by one copy for any number of them; what is not known of one is not known of all."""
    first, *rest = parts
    if not rest:
        return first
    names = [name for name in first.arrays() if all(getattr(part, name) is not None for part in rest)]
    found = first._with({name: np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names})
    for name in set(first.arrays()).difference(names):
        setattr(found, name, None)
    return found


def distinct(numbers: Any) -> Any:
    """Each of some numbers once, in order. Without indices `np.unique` asks `numpy.ma`, whose import takes 13 ms.

    Whole numbers that lie close together are counted instead of sorted: of 32 K it takes a tenth of the time.
    """
    numbers = np.asarray(numbers)
    if numbers.size > FEW and _counted(numbers):
        least, most = int(numbers.min()), int(numbers.max())
        if most - least < numbers.size:
            return np.bincount(numbers.reshape(-1) - least).nonzero()[0] + least
    return np.unique(numbers, return_index=True)[0]


def patterns_of(masks: Bools, index: Ints) -> Iterator[tuple[Bools, Ints]]:
    """What masks (n, B) have at some members: each pattern that there is, (n,), with the members that have it."""
    here = masks[:, index]
    for pattern in np.unique(here, axis=1).T if index.size else ():
        yield pattern, index[(here == pattern[:, None]).all(axis=0)]


def places_of(known: Any, numbers: Any) -> Ints:
    """Where each of some whole numbers is among those that there are, in order (`distinct`)."""
    if numbers.size > FEW and _counted(numbers) and int(known[-1]) - int(known[0]) < numbers.size:
        places = np.zeros(int(known[-1]) - int(known[0]) + 1, dtype=np.int64)
        places[known - known[0]] = np.arange(known.size)
        found: Ints = places.take(numbers - known[0])
        return found
    return np.asarray(np.searchsorted(known, numbers))


def _counted(numbers: Any) -> bool:
    """Whether numbers are whole ones that can be places of an array."""
    return bool(numbers.dtype.kind in "iu" and np.can_cast(numbers.dtype, np.int64))


def side_by_side(owner: Ints, values: Array, batch: int, gap: float = np.nan) -> Array:
    """Values (..., n) of members, who come in order, as rows with one value for each: (..., rows, batch)."""
    count = np.bincount(owner, minlength=batch)
    rows = np.full((*values.shape[:-1], int(count.max(initial=0)), batch), gap)
    rows[..., np.arange(owner.size) - (np.cumsum(count) - count)[owner], owner] = values
    return rows
