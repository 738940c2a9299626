"""Where long ranges are cut around the places at which an integrand may be concentrated.

Owns `shells`. Halving a range of 1e16 does not come to where exp(-x^2) lies: nodes see nothing of it, or panels become
too narrow. Shells whose sizes grow as powers meet every scale. An infinite range is drawn in instead.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from potto.integrate.decomposition.meetings import Row, as_array
from potto.integrate.levels import RESTING
from potto.kernels.cells import Array, Bools, Cell

# The length of a finite range from which on shells are made: to 1e10 halves get there, with all digits.
LONG = 2.0**30
SIZES = 2.0 ** np.arange(6, 1024, 12)


def shells(lo: Cell, hi: Cell, rows: Sequence[Row], batch: int) -> list[Row]:
    """Rows around both bounds, around 0, where numbers are dense, and around the places of other rows, of long finite
    ranges; those outside of a range are none of it."""
    low, high = as_array(lo.v, batch), as_array(hi.v, batch)
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.abs(high - low)
    long = np.isfinite(length) & (length > LONG)
    if not long.any():
        return []
    sizes = SIZES[length[long].max() > SIZES]
    found: list[Row] = []
    for middle in (low, high, np.zeros(batch), *(as_array(row.x, batch) for row in rows)):
        for size in (*-sizes, *sizes):
            found.append(Row(_beside(middle, size, long), (), RESTING, False))
    return found


def _beside(middle: Array, size: float, where: Bools) -> Array:
    """At a distance from a place, and nowhere for members whose range is not long."""
    return np.where(where, middle + size, np.nan)
