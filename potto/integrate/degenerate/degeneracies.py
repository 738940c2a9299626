"""Steps where only bends are expected: a surface that runs along a variable further in has no section there.

Owns `look_for_steps` (at cuts) and `brush` (at bounds). What is further in is integrated on both sides of the place; if
it jumps, another variable must go innermost.
"""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np

from potto.integrate.decomposition.cuts import Cuts, Edge
from potto.integrate.degenerate.coincidences import Scene, around
from potto.integrate.events import Degenerate
from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Evaluator, Pieces, gather, still, take
from potto.kernels.cells import Array, Bools, Cell, Value

# How far beside a place it is looked at (beside a bound twice), and what part may be lost across it.
BESIDE, DISCONTINUITY = (1e-7, 1e-9), 1e-6
# How far sections may have come at the nearer of these places, in their size, that don't run along the bound.
SLOW = 1e-3


def look_for_steps(work: PanelBatch, whole: Pieces) -> None:
    """Whether the integral further in jumps where only its kinks were expected, which move in different ways.

    A surface that runs along the innermost variable leaves such a step. Looked at just beside the cut, since on
    the cut itself the sides are a matter of rounding.
    """
    seg, frozen = work.seg, work.machine.with_directions(0)
    follows = np.nonzero((seg.owner[1:] == seg.owner[:-1]) & (seg.a[1:] == seg.b[:-1]) & (seg.rank[1:] == 1))[0] + 1
    if not follows.size:
        return
    width = np.minimum(np.abs(seg.b - seg.a)[follows], np.abs(seg.b - seg.a)[follows - 1])
    steps = []
    for part in BESIDE:
        aside, values = part * np.minimum(width, 1e300), []
        for side, index in ((1.0, follows), (-1.0, follows - 1)):
            here = gather({n: still(v) for n, v in work.env.items()}, seg.owner[index])
            here[work.level.variable] = Cell(seg.a[follows] + side * aside)
            sides = {g: take(m, index) for g, m in work.sides.items()}
            with nullcontext() if work.machine.costs is None else work.machine.costs.apart():
                root = work.below(seg.owner[index])
                values.append(work.parent.inside(work.number, here, index.size, sides, frozen, root)[0])
        steps.append(np.abs(values[0] - values[1]))
    mean = whole.size.reshape(work.width, -1, seg.a.size)[:, 0] / (seg.b - seg.a)
    size = np.abs(values[0]) + np.abs(values[1]) + mean[:, follows] + mean[:, follows - 1]
    jumps = _jumps(steps, size)
    if jumps.any():
        work.machine.note(Degenerate(work.level.variable), work.below(np.unique(seg.owner[follows[jumps]])))


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
        if _bends(scene, here, edge, frozen):
            continue
        steps, root = [], scene.below(edge.owner)
        with nullcontext() if machine.costs is None else machine.costs.apart():
            for part in BESIDE:
                aside = part * (1 + np.abs(edge.x))
                inside, beyond = (
                    parent.inside(number, {**here, level.variable: Cell(x)}, size, inner, frozen, root)[0]
                    for x in (edge.x + aside, edge.x - aside)
                )
                steps.append(np.abs(inside - beyond))
        jumps = _jumps(steps, np.abs(inside) + np.abs(beyond))
        if jumps.any():
            machine.note(Degenerate(level.variable), scene.below(edge.owner[jumps]))


def _jumps(steps: list[Array], size: Array) -> Bools:
    """Where values on the two sides of a place differ, and no less so nearer to it: what bends would shrink."""
    return np.asarray(((steps[1] > 0.5 * steps[0]) & (steps[1] > DISCONTINUITY * size)).any(axis=0))


def _bends(scene: Scene, here: dict[str, Value], edge: Edge, frozen: Evaluator) -> bool:
    """Whether it is plain that no surface runs along the bound: all sections in the innermost variable are slow."""
    levels, name = scene.parent.plan.levels, scene.level.variable
    further = levels[scene.number + 1]
    if scene.number + 2 < len(levels) or further.searched:
        return False
    aside = BESIDE[1] * (1 + np.abs(edge.x)) * (-1 if edge.upper else 1)
    places = ({**here, name: Cell(x)} for x in (edge.x, edge.x + aside))
    on, inside = (frozen.evaluate(further.frame, {n: at[n] for n in further.frame.params}, None) for at in places)
    assert isinstance(on, tuple) and isinstance(inside, tuple)
    for row, beside in zip(on, inside, strict=True):
        assert isinstance(row, Cell) and isinstance(beside, Cell)
        with np.errstate(invalid="ignore"):
            slow = np.abs(row.v - beside.v) <= SLOW * (1 + np.abs(row.v))
        if not np.all(slow):
            return False
    return True
