"""Scrambled Sobol points, many scramblings at once.

Owns `Sobol`. A block of points for all scramblings takes a few operations on whole arrays. Each scrambling is a random
lower triangular matrix of bits for each variable and a digital shift (Matousek, 1998): every point is uniform over the
cube, so that means over them are unbiased, and the points together keep the net's evenness.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from potto.integrate.rules.direction_numbers import direction_numbers
from potto.kernels.cells import Array, Ints

BITS = 30
MOST = 20  # a scrambling has at most 2^MOST points


class Sobol:
    """`copies` independent scramblings of Sobol points in `dims` dimensions; equal seeds give equal points."""

    def __init__(self, dims: int, copies: int, seed: Any) -> None:
        self.dims, self.copies, self.seed = dims, copies, seed

    def blocks(self, start: int, stop: int, size: int) -> Iterator[Array]:
        """Points start..stop-1 of every scrambling, in blocks of at most `size` a scrambling: (copies, c, dims).

        start, stop: 0 or powers of 2; size: a power of 2.
        """
        step = min(size, stop - start)
        for first in range(start, stop, step):
            block = self._block(first, step.bit_length() - 1).swapaxes(1, 2)
            yield (block.astype(np.float64) + 0.5) * 2.0**-BITS

    def _block(self, first: int, log: int) -> Ints:
        points = self.shift.copy()
        for b in range(log, MOST):
            if first >> b & 1:
                points ^= self.columns[:, :, b : b + 1]
        for b in range(log):
            points = np.concatenate((points, points ^ self.columns[:, :, b : b + 1]), axis=2)
        return points

    @cached_property
    def shift(self) -> Ints:
        return self._scrambling[0]

    @cached_property
    def columns(self) -> Ints:
        return self._scrambling[1]

    @cached_property
    def _scrambling(self) -> tuple[Ints, Ints]:
        """The digital shifts (copies, dims, 1) and the direction numbers multiplied by the matrices."""
        random = np.random.default_rng(self.seed)
        shape = (self.copies, self.dims, 1)
        shift = random.integers(0, 1 << BITS, shape)
        plain = _directions(self.dims)
        columns = np.zeros((self.copies, self.dims, MOST), dtype=np.int64)
        for row in range(BITS):  # bit `row`, from the highest, is that of the point plus random ones of those above it
            at = BITS - 1 - row
            mask = random.integers(0, 1 << row, shape) << (at + 1) | 1 << at
            columns |= _parity(mask & plain) << at
        return shift, columns


def _parity(x: Ints) -> Ints:
    for half in (16, 8, 4, 2, 1):
        x = x ^ x >> half
    return x & 1


@lru_cache(maxsize=64)
def _directions(dims: int) -> Ints:
    return direction_numbers(dims, MOST, BITS)
