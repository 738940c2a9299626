"""Steps where only bends are expected: a surface that runs along a variable further in has no section there.

Owns `look_for_steps` (at cuts) and `brush` (at bounds). What is further in is integrated on both sides of the place; if
it jumps, another variable must go innermost.
"""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING

import numpy as np

from potto.integrate.cuts import Cuts
from potto.integrate.edges import Scene, around
from potto.integrate.pieces import Pieces, gather, still, take
from potto.kernels.cells import Cell

if TYPE_CHECKING:
    from potto.integrate.work import Work

# How far beside a place it is looked at (beside a bound twice), and what part may be lost across it.
BESIDE, DISCONTINUITY = (1e-7, 1e-9), 1e-6


def look_for_steps(work: Work, whole: Pieces) -> None:
    """Whether the integral further in jumps where only its kinks were expected, which move in different ways.

    A surface that runs along the innermost variable leaves such a step. Looked at just beside the cut, since on
    the cut itself the sides are a matter of rounding.
    """
    seg, frozen = work.seg, work.machine.with_directions(0)
    follows = np.nonzero((seg.owner[1:] == seg.owner[:-1]) & (seg.a[1:] == seg.b[:-1]) & (seg.rank[1:] == 1))[0] + 1
    if not follows.size:
        return
    width = np.minimum(np.abs(seg.b - seg.a)[follows], np.abs(seg.b - seg.a)[follows - 1])
    values = []
    for side, index in ((1.0, follows), (-1.0, follows - 1)):
        here = gather({n: still(v) for n, v in work.env.items()}, seg.owner[index])
        here[work.level.variable] = Cell(seg.a[follows] + side * BESIDE[1] * np.minimum(width, 1e300))
        sides = {g: take(m, index) for g, m in work.sides.items()}
        with nullcontext() if work.machine.costs is None else work.machine.costs.apart():
            root = work.below(seg.owner[index])
            values.append(work.parent.inside(work.number, here, index.size, sides, frozen, root)[0])
    mean = whole.size.reshape(work.width, -1, seg.a.size)[:, 0] / (seg.b - seg.a)
    size = np.abs(values[0]) + np.abs(values[1]) + mean[:, follows] + mean[:, follows - 1]
    jumps = (np.abs(values[0] - values[1]) > DISCONTINUITY * size).any(axis=0)
    if jumps.any():
        work.machine.note_degenerate(work.level.variable, work.below(np.unique(seg.owner[follows[jumps]])))


def brush(scene: Scene, cuts: Cuts) -> None:
    """Whether what is further in jumps at a bound on which it should only bend: a surface runs along the bound.

    Looked at on both sides of the bound, with the surfaces of this variable as they are inside.
    """
    parent, number, level, machine = scene.parent, scene.number, scene.level, scene.machine
    for found in cuts.brushes:
        edge = found.pick(scene.counted(found.owner))
        if not edge.owner.size:
            continue
        here, inner = around(level, edge.owner, edge.x, not edge.upper, scene.env, scene.sides, machine)
        frozen, size = machine.with_directions(0), edge.owner.size
        further = parent.plan.levels[number + 1]
        if number + 2 == len(parent.plan.levels) and not further.searched:
            sections = frozen.evaluate(further.frame, {n: here[n] for n in further.frame.params}, None)
            assert isinstance(sections, tuple)
            if all(isinstance(at, Cell) and np.isfinite(at.v).all() for at in sections):
                continue  # none of them runs along it
        steps, root = [], scene.below(edge.owner)
        with nullcontext() if machine.costs is None else machine.costs.apart():
            for part in BESIDE:
                aside = part * (1 + np.abs(edge.x))
                inside, beyond = (
                    parent.inside(number, {**here, level.variable: Cell(x)}, size, inner, frozen, root)[0]
                    for x in (edge.x + aside, edge.x - aside)
                )
                steps.append(np.abs(inside - beyond))
        whole = np.abs(inside) + np.abs(beyond)
        # What bends would shrink.
        jumps = ((steps[1] > 0.5 * steps[0]) & (steps[1] > DISCONTINUITY * whole)).any(axis=0)
        if jumps.any():
            machine.note_degenerate(level.variable, scene.below(edge.owner[jumps]))
