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
from potto.kernels.cells import Array, Ints

# The channels at nodes, and the errors that came with them: see `PanelBatch.values`.
Evaluated = Callable[[Segments, Ints, Array, Array, Array], tuple[Array, Array | None]]
# As close as this to an end, in the coordinate, values are taken for those at this distance: the closest that will do.
CLOSE = (1e-6, 1e-4, 1e-2)
# As close as this to an end an integral further in, that nothing comes of there, is taken for that at this distance.
UNREACHED = 1e-12


def mend(
    evaluated: Evaluated, seg: Segments, index: Ints, u: Array, du: Array, h: Array, bounds: Array | None
) -> None:
    """Put values, and bounds of their errors, from further in where channels (C, P, n) are no numbers.

    u, du: (P, n) as for the map.
    """
    turning = np.isin(seg.kind, (substitution.LEFT, substitution.RIGHT, substitution.BOTH))[:, None]
    for close in CLOSE if turning.any() else ():
        bad = ~np.isfinite(h).all(axis=0) & turning & ((u < close) | (u > 1 - close))
        rows = np.nonzero(bad.any(axis=1))[0]
        if not rows.size:
            break
        part, inner = seg.pick(rows), np.clip(u[rows], close, 1 - close)
        x, slope, label = substitution.points(part, inner)
        found, errors = evaluated(part, index[rows], x, label, slope * np.broadcast_to(du, u.shape)[rows])
        h[:, rows] = np.where(bad[rows], found, h[:, rows])
        if bounds is not None and errors is not None:
            bounds[:, rows] = np.where(bad[rows], errors, bounds[:, rows])
    if bounds is not None and not np.isfinite(h).all():
        _unreached(evaluated, seg, index, u, du, h, bounds)


def _unreached(
    evaluated: Evaluated, seg: Segments, index: Ints, u: Array, du: Array, h: Array, bounds: Array
) -> None:
    """Values for nodes so close to an end that integrals further in give up: of 1/(x + y) along y at x = 1e-20.

    Nothing is known of them but that they count little if values grow slowly; they may be off by all that they are.
    """
    plain = (seg.kind == substitution.LINEAR)[:, None]
    bad = ~np.isfinite(h).all(axis=0) & plain & ((u < UNREACHED) | (u > 1 - UNREACHED))
    rows = np.nonzero(bad.any(axis=1))[0]
    if rows.size:
        part, inner = seg.pick(rows), np.clip(u[rows], UNREACHED, 1 - UNREACHED)
        x, slope, label = substitution.points(part, inner)
        found, errors = evaluated(part, index[rows], x, label, slope * np.broadcast_to(du, u.shape)[rows])
        off = np.abs(found) if errors is None else np.abs(found) + errors
        h[:, rows] = np.where(bad[rows], found, h[:, rows])
        bounds[:, rows] = np.where(bad[rows], off, bounds[:, rows])
