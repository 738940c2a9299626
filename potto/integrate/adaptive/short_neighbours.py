"""Next to the ends of segments: what is small beyond an end is felt as near to it inside, between all nodes.

Owns `unseen`. The loop of x^3 + y^3 = t x y is as long as t is. Left of it what lies under the curve has another slope
over such a stretch, too, and no cut tells where: roots merge beside the real line. So where places that cut lie much
closer together than a segment is long, the integrand is compared with what its nodes lead to at places nearer and
nearer to that end.

What a density leaves of its tails dies out as fast as a surface crosses them, which may be before the first node, and
its tangents are larger than it by as much as it is narrow. There one place beside each end tells, by all channels; of
values the end itself tells (`refinement.missed_peak`).
"""

from __future__ import annotations

import numpy as np

from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Pieces
from potto.integrate.rules import substitution
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Ints

SHORT = 2.0**-7  # of a segment: what is shorter has no node of its own there
PLACES, FIRST = 12, 2.0**-5  # how many places are looked at, from where on
# Where there is no short neighbour: in a third of what the first of eleven nodes leaves, and as much beside it.
TAIL = 2.0**-8
ROUNDED = 8.0  # how many times farther than their rounding ends must lie apart


def unseen(work: PanelBatch, p: Pieces) -> tuple[tuple[Array, Bools], ...]:
    """What whole segments may have missed next to their left and to their right end, (C, S), and whether what lies
    beyond is much shorter than they are. Nothing where no segment was looked at: where what is further in is integrated
    between planes all that it can do happens at cuts."""
    seg, degrees = work.seg, work.parent.degrees
    if work.last or p.coefficients is None or work.machine.overdrawn():
        return ()
    if degrees and degrees[work.number] is not None:
        return ()
    length = seg.b - seg.a
    sides, finite = _beyond(seg), seg.kind < substitution.UP
    found, looked = [], False
    for beyond, turned in zip(sides, (False, True), strict=True):
        missed, short = np.zeros(p.error.shape), finite & (beyond < SHORT * length)
        if (there := np.nonzero(short)[0]).size:
            fall = (np.log(beyond[there] / length[there]) - np.log(FIRST)) / (PLACES - 1)
            near = FIRST * np.exp(fall[:, None] * np.arange(PLACES))
            missed[:, there], looked = _missed(work, p, there, near, turned) * -fall, True
        steep = finite & ~short & (beyond < length) if work.k and work.hinted else np.zeros_like(short)
        if (there := np.nonzero(steep)[0]).size:
            missed[:, there], looked = _missed(work, p, there, np.full((there.size, 1), TAIL), turned), True
        found.append((missed, short))
    return tuple(found) if looked else ()


def _beyond(seg: Segments) -> tuple[Array, Array]:
    """How far it is from each end of every segment to what cuts, or turns, beyond it; infinite where nothing does."""
    left, right = np.full((2, seg.a.size), np.inf)
    same: Bools = seg.owner[1:] == seg.owner[:-1]
    gap, length, off = seg.a[1:] - seg.b[:-1], seg.b - seg.a, ROUNDED * np.maximum(seg.ea, seg.eb)
    left[1:] = np.where(same, np.where(gap > 0, gap, length[:-1]), np.inf)
    right[:-1] = np.where(same, np.where(gap > 0, gap, length[1:]), np.inf)
    for side, turns in ((left, seg.a - seg.left), (right, seg.right - seg.b)):
        np.minimum(side, turns, out=side, where=turns > 0)
    return np.where(left > off, left, np.inf), np.where(right > off, right, np.inf)


def _missed(work: PanelBatch, p: Pieces, index: Ints, near: Array, turned: bool) -> Array:
    """By how much the integrand is off its interpolant at places (I, n) from an end, times how far away they are: what
    that comes to between two of them for each time that they are farther by e: (C, I)."""
    assert p.coefficients is not None
    seg, coefficients = work.seg.pick(index), p.coefficients[:, index]
    u, rest = (1.0 - near, near) if turned else (near, 1.0 - near)
    x, dx, label = substitution.points(seg, u, rest)
    if seg.kind.any():
        x = substitution.off_the_ends(seg, x)
    h, inner = work.values(seg, index, x, label, dx)
    functions = np.polynomial.legendre.legvander(2 * u - 1, coefficients.shape[-1] - 1)
    led = np.einsum("cpk,pnk->cpn", coefficients, functions)
    off = np.abs(h - led)
    if inner is not None:
        off = np.maximum(off - np.abs(inner), 0.0)
    off = np.where(np.isfinite(off), off, 0.0)
    return np.asarray((off * near).sum(axis=-1))
