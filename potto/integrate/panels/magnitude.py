"""What an integral could come to at most: the size of its domain times the largest integrand that was met.

Owns `Extent`. A pixel whose corner a surface passes by 1e-16 covers 1e-32, and rounding of the surface's place is all
of that. Held against its own value such an answer has no digits; held against what the pixel could hold it is 0 to the
last place. So is its derivative, held against that of a surface which moves as fast and crosses all of the pixel.
"""

from __future__ import annotations

import numpy as np

from potto.integrate.pieces import Sums
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Ints

# One rounding, in units of the accuracy by which what is added up counts (`runtime/answers/allowances`).
ROUNDING = 2.0**-12


class Extent:
    """By outermost member: of each variable the longest range, and how fast its cuts move in each of k directions; the
    largest mean of the integrand over a piece."""

    def __init__(self, variables: int, k: int, batch: int) -> None:
        self.reach, self.speed = np.zeros((variables, batch)), np.zeros((variables, k, batch))
        self.height = np.zeros(batch)

    def saw_range(self, number: int, seg: Segments, batch: int, root: Ints | None) -> None:
        """Count the ranges of a batch of one variable, and the speeds of the cuts in them."""
        lengths: Array = np.zeros(batch)
        lengths += np.bincount(seg.owner, seg.b - seg.a, minlength=batch)
        _raise(self.reach[number], lengths, root if number else np.arange(batch))
        # further in, nodes that move are directions, too: they come last
        for speed, ta, tb in zip(self.speed[number], seg.ta, seg.tb, strict=False):
            if ta.any() or tb.any():
                owner = seg.owner if not number else None if root is None else root[seg.owner]
                _raise(speed, np.maximum(np.abs(ta), np.abs(tb)), owner)

    def saw_values(self, mean: Array, members: Ints | None) -> None:
        """Count the mean size of the integrand on segments, (S,)."""
        _raise(self.height, mean, members)

    def count(self, sums: Sums) -> None:
        """Of answers that are 0, as far as is known, one rounding of the most that there could be is added up; of such
        derivatives all of the most, of which rounding of a surface's place is a larger part, the smaller the domain."""
        if sums.gross is None:
            return
        zero, still = (np.asarray((np.abs(x) <= off).all(axis=0)) for x, off in ((sums.v, sums.e), (sums.t, sums.et)))
        if zero.any():
            _count(sums.gross[0], ROUNDING * self.reach.prod(axis=0) * self.height, zero)
        if still.any():
            _count(sums.gross[1], self.swept(still), np.asarray(still.any(axis=0)))

    def swept(self, still: Bools) -> Array:
        """The most that surfaces could sweep over in directions (k, B): across one variable, along all the others."""
        fastest = np.max(self.speed, axis=1, initial=0.0, where=still)
        across = (np.delete(self.reach, n, axis=0).prod(axis=0) * fastest[n] for n in range(fastest.shape[0]))
        most: Array = np.max(list(across), axis=0) * self.height
        return most


def _count(gross: Array, most: Array, members: Bools) -> None:
    np.maximum(gross, np.where(members & np.isfinite(most), most, 0.0), out=gross)


def _raise(most: Array, values: Array, member: Ints | None) -> None:
    if most.size == 1 or member is None:
        most[:] = np.maximum(most, np.max(values, initial=0.0))
    else:
        np.maximum.at(most, member, values)
