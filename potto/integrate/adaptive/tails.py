"""At what pace infinite stretches are run through: by where lies what they hold.

Owns `paced`. An infinite stretch is drawn into the unit interval by x = a + L u/(1 - u). Where L is some lengths of its
decay, what falls like a density takes a third of the nodes that it takes elsewhere, in whatever units a program counts.
"""

from __future__ import annotations

import numpy as np
from msgspec.structs import replace

from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import gather, still
from potto.integrate.rules import substitution
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Cell, Ints

# How far from the finite end the integrand is looked at.
PLACES = 8.0 ** np.arange(-8, 9)
# Of the logarithm of the distance, with what is held there as its weight: up to which variance it is the decay of a
# density (an exponential has 1.6, half a normal density 1.2), up to which that of a power (1/x^2 has 3.3). Beyond, and
# where the farthest place still holds a part, nothing is known. How many times the mean distance L is, for either.
FAST, SLOW = 2.0, 4.0
HELD = 1e-2
PACES = 8.0, 1.0


def paced(work: PanelBatch) -> Segments:
    """The segments, those that are infinite on one side with a pace of their own where their integrands tell one."""
    seg = work.seg
    rows = np.nonzero((seg.kind == substitution.UP) | (seg.kind == substitution.DOWN))[0]
    if not rows.size or not work.last or work.machine.overdrawn():
        return seg
    pace = seg.pace.copy()
    pace[rows] = _pace(_held(work, rows))
    return replace(seg, pace=pace)


def _held(work: PanelBatch, rows: Ints) -> Array:
    """What there is at each of the places, in proportion: the integrand times the distance, (S, places)."""
    seg, machine = work.seg.pick(rows), work.machine.with_directions(0)
    up = (seg.kind == substitution.UP)[:, None]
    x = np.where(up, seg.a[:, None] + PLACES, seg.b[:, None] - PLACES)
    row = np.repeat(np.arange(rows.size), PLACES.size)
    env = gather({n: still(v) for n, v in work.env.items() if n in work.parent.reads}, seg.owner[row])
    env[work.level.variable] = Cell(x.ravel())
    sides = {g: m[rows[row]] if isinstance(m, np.ndarray) else m for g, m in work.sides.items()}
    values, _ = work.parent.inside(work.number, env, x.size, sides, machine, work.below(seg.owner[row]))
    with np.errstate(invalid="ignore", over="ignore"):
        held: Array = np.abs(values).sum(axis=0).reshape(x.shape) * PLACES
    return held


def _pace(held: Array) -> Array:
    """L for each row of `held`, a power of two; 1 where nothing is known."""
    logs = np.log(PLACES)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        share = held / held.sum(axis=1, keepdims=True)
        mean = share @ logs
        spread = share @ logs**2 - mean**2
        paces = np.exp2(np.round(np.log2(np.exp(mean) * np.where(spread <= FAST, *PACES))))
    known = (spread <= SLOW) & (share[:, -1] <= HELD) & (share[:, 0] <= HELD)
    return np.where(known, paces, 1.0)
