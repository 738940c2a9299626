"""Roots of which rounding hides where they are: divided by what is 0 but for rounding they are nowhere, or anywhere.

Owns `unplaced`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from potto.integrate.decomposition.meetings import Row, as_array
from potto.integrate.degenerate.scene import surfaces_beside
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Evaluator
from potto.kernels.cells import Array, Cell, Ints, Mask, Value


def unplaced(
    level: LevelPlan, env: dict[str, Value], ends: tuple[Cell, Cell], rows: Sequence[Row], batch: int,
    machine: Evaluator,
) -> Ints:  # fmt: skip
    """The members of which a surface has no finite root, and at one end of the range a side that rounding hides: there
    may be a root all the same."""
    none: dict[int, Mask] = {n: bool(cut.roots) for n, cut in enumerate(level.level.cuts) if cut.decides}
    for row in rows:
        if row.cut in none:
            none[row.cut] = none[row.cut] & ~np.isfinite(row.x)
    everybody = np.arange(batch)
    found = np.zeros(batch, dtype=bool)
    somewhere = any(there.any() if isinstance(there, np.ndarray) else there for there in none.values())
    for end in ends if somewhere else ():
        x: Array = as_array(end.v, batch)
        for there, value, off in zip(none.values(), *surfaces_beside(level, everybody, x, env, machine), strict=True):
            found |= there & (np.abs(value) < off) & np.isfinite(x)
    return np.nonzero(found)[0]
