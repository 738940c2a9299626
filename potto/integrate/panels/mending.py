"""Nodes that rounding puts where the integrand has no value.

Owns `mend`. Close to an end of a segment where roots merge an integrand like 1/sqrt(r^2 - x^2 - y^2) has a radicand of
the size of its rounding, and may come out as nan. There, in the coordinate that the segment is run through by, it is
smooth: its values a little further in stand for those.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from potto.integrate.rules import substitution
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Ints

# The channels at nodes, and the errors that came with them: see `PanelBatch.values`.
Evaluated = Callable[[Segments, Ints, Array, Array, Array], tuple[Array, Array | None]]
# As close as this to an end, in the coordinate, values are taken for those at this distance: the closest that will do.
CLOSE = (1e-6, 1e-4, 1e-2)
# As close as this to an end an integral further in, that nothing comes of there, is taken for that at this distance.
UNREACHED = 1e-12


def mend(evaluated: Evaluated, seg: Segments, index: Ints, u: Array, du: Array, h: Array, bounds: Array | None) -> None:
    """Put values, and bounds of their errors, from further in where channels (C, P, n) are not numbers.

    u, du: (P, n) as for the map. Of nodes so close to an end that integrals further in give up, of 1/(x + y) along y at
    x = 1e-20, nothing is known but that they count little if values grow slowly; they may be off by all that they are.
    """
    turning = seg.turning

    def put(close: float, segments: Bools, doubt: float) -> bool:
        bad = ~np.isfinite(h).all(axis=0) & segments[:, None] & ((u < close) | (u > 1 - close))
        rows = np.nonzero(bad.any(axis=1))[0]
        if rows.size:
            part, inner = seg.pick(rows), np.clip(u[rows], close, 1 - close)
            x, slope, label = substitution.points(part, inner)
            found, errors = evaluated(part, index[rows], x, label, slope * np.broadcast_to(du, u.shape)[rows])
            h[:, rows] = np.where(bad[rows], found, h[:, rows])
            if bounds is not None:
                off = doubt * np.abs(found) + (0.0 if errors is None else errors)
                bounds[:, rows] = np.where(bad[rows], off, bounds[:, rows])
        return bool(rows.size)

    for close in CLOSE if turning.any() else ():
        if not put(close, turning, 0.0):
            break
    if bounds is not None and not np.isfinite(h).all():
        put(UNREACHED, seg.kind == substitution.LINEAR, 1.0)
