"""How far a sum goes whose terms fall off in the end, and what is left of it.

Owns `Extent`. Chances of whole numbers fall faster than any power, so that beyond where they are next to nothing the
terms fall by a factor that does not grow again: what is left is less than a geometric series. The factor is that
between the largest of BLOCK terms and the largest of the BLOCK before, since a body that changes sign is small at
single numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from potto.kernels.cells import Array, Cell, Rows, Value, listed
from potto.kernels.tape import Node

BLOCK = 4  # terms
# What may be left, as a part of what was added up without regard to sign. It is in the error; but derivatives that are
# swept back have none of their own, and so it is far below rounding.
SMALL = 2.0**-66
SHARE = 4  # a sum that is not at its end goes on for so much of what it had
LONGEST = 100_000  # terms beyond those that are added up in any case


class Extent:
    """The numbers that a sum goes through, in chunks of up to `step`, as far as they matter."""

    def __init__(self, first: int, last: int, step: int, endless: bool) -> None:
        self.first, self.last, self.endless = first, last, endless
        self.step = max(step, 4 * BLOCK) if endless else step
        self.added: list[Array] = []  # of each part of a value, what was added up
        self.left: list[Any] = []  # and what is left at most
        self.settled = not endless

    def __iter__(self) -> Iterator[Array]:
        start, stop = self.first, self.last + 1
        while start < stop or not self.settled:
            if start >= stop:
                if start - self.last > LONGEST:
                    return
                stop = start + max(8 * BLOCK, (start - self.first) // SHARE)
            pieces = -(-(stop - start) // self.step)  # equal ones: the last one tells what is left
            size = -(-(stop - start) // pieces)
            yield np.arange(start, min(start + size, stop), dtype=float)
            start = min(start + size, stop)

    def saw(self, value: Value, count: int) -> None:
        """Take note of the terms of a chunk, along the last axis."""
        if not self.endless:
            return
        parts = [_along(part, count) for part in _numbers(value)]
        sizes = [np.add.reduce(part, axis=-1) for part in parts]
        self.added = [a + b for a, b in zip(self.added, sizes, strict=True)] if self.added else sizes
        self.left = [_beyond(part) for part in parts]
        with np.errstate(invalid="ignore"):
            self.settled = all(bool(np.all(~(b > SMALL * a))) for a, b in zip(self.added, self.left, strict=True))

    @property
    def finite(self) -> Any:
        """Of each member, whether a bound of what is left is known."""
        return np.logical_and.reduce([np.isfinite(left) for left in np.broadcast_arrays(*self.left)])

    def with_rest(self, value: Value) -> Value:
        """The sum, with what is left in its errors."""
        if not self.endless:
            return value
        left = iter(self.left)

        def widened(value: Value) -> Value:
            if isinstance(value, tuple):
                return tuple([widened(item) for item in value])
            if isinstance(value, Rows):
                return listed([widened(row) for row in value.rows()])
            assert isinstance(value, Cell)
            e = _more(value.v, value.e, left)
            return Cell(value.v, e, value.t, tuple([_more(*one, left) for one in zip(value.t, value.et, strict=True)]))

        return widened(value)


def _more(part: Any, error: Any, left: Iterator[Any]) -> Any:
    if part is None or isinstance(part, Node):
        return error
    more = next(left)
    more = float(more) if np.ndim(more) == 0 else more
    return more if error is None else error + more


def _numbers(value: Value) -> Iterator[Any]:
    """The values and tangents of all cells, in order."""
    if isinstance(value, tuple):
        for item in value:
            yield from _numbers(item)
    elif isinstance(value, Rows):
        for row in value.rows():
            yield from _numbers(row)
    elif isinstance(value, Cell):
        yield from (part for part in (value.v, *value.t) if part is not None and not isinstance(part, Node))


def _along(part: Any, count: int) -> Array:
    """The sizes of terms; of one that is the same for all numbers as many."""
    wide: Array = np.asarray(np.abs(part))
    return wide if wide.ndim and wide.shape[-1] == count else np.broadcast_to(wide, (*wide.shape[:-1], count))


def _beyond(terms: Array) -> Array:
    """What the terms beyond these add up to at most, along the last axis."""
    if terms.shape[-1] < 2 * BLOCK:
        return np.where(np.any(terms > 0, axis=-1), np.inf, 0.0)
    before, last = (terms[..., here].max(axis=-1) for here in (slice(-2 * BLOCK, -BLOCK), slice(-BLOCK, None)))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = last / before
        left = np.where(ratio < 1, BLOCK * last * ratio / (1 - ratio), np.inf)
    return np.where(last == 0, 0.0, left)
