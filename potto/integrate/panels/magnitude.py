"""What an integral could come to at most: the size of its domain times the largest integrand that was met.

Owns `Extent`. A pixel whose corner a surface passes by 1e-16 covers 1e-32, and rounding of the surface's place is all
of that. Held against its own value such an answer has no digits; held against what the pixel could hold it is 0 to the
last place.
"""

from __future__ import annotations

import numpy as np

from potto.integrate.pieces import Sums
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Ints

# One rounding, in units of the accuracy by which what is added up counts (`runtime/answers/convergence`).
ROUNDING = 2.0**-12


class Extent:
    """The longest range of each variable, and the largest mean of the integrand over a piece, by outermost member."""

    def __init__(self, variables: int, batch: int) -> None:
        self.reach, self.height = np.zeros((variables, batch)), np.zeros(batch)

    def saw_range(self, number: int, seg: Segments, batch: int, root: Ints | None) -> None:
        """Count the ranges of a batch of one variable."""
        lengths: Array = np.zeros(batch)
        lengths += np.bincount(seg.owner, seg.b - seg.a, minlength=batch)
        _raise(self.reach[number], lengths, root if number else np.arange(batch))

    def saw_values(self, mean: Array, members: Ints | None) -> None:
        """Count the mean size of the integrand on segments, (S,)."""
        _raise(self.height, mean, members)

    def count(self, sums: Sums) -> None:
        """Of answers that are 0, as far as is known, one rounding of the most that there could be is added up."""
        if sums.gross is None or not (zero := (np.abs(sums.v) <= sums.e).all(axis=0)).any():
            return
        most = ROUNDING * self.reach.prod(axis=0) * self.height
        sums.gross[0] = np.maximum(sums.gross[0], np.where(zero & np.isfinite(most), most, 0.0))


def _raise(most: Array, values: Array, member: Ints | None) -> None:
    if most.size == 1 or member is None:
        most[:] = np.maximum(most, np.max(values, initial=0.0))
    else:
        np.maximum.at(most, member, values)
