"""The integral of one member between its cuts with its derivatives by many parameters, in one sweep back.

Owns `step_gradient`. By the ends of a cell, the height of a step function on it and what else is read there, each cell
has derivatives of its own, which are found as those of one cell are. A cut is the end of two cells and a change of
height counts on all cells above it, so that the derivatives by cuts and heights are sums along the cells. From these a
tape leads to the parameters. n conditions with parameters of their own cost as much as n cells, where a tangent for
each costs the square.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from potto.integrate.fixed.moving_sums import SUMMED, MovingTotals, product
from potto.integrate.fixed.steps.step_cells import WIDE, WIDE_EPS, StepCells, cells_between, levels_of
from potto.integrate.fixed.steps.step_integral import StepIntegral
from potto.integrate.fixed.steps.step_orders import StepProof, others, proved
from potto.integrate.fixed.steps.step_sides import layout
from potto.integrate.fixed.steps.step_sums import lit
from potto.integrate.pieces import Evaluator, dense, numbers_at
from potto.integrate.rules.gauss import EPS, gauss
from potto.kernels.cells import Array, Cell, Value
from potto.kernels.sweeps import Accumulated, adjoints
from potto.kernels.tape import Node
from potto.kernels.whole import PAIRWISE

# Directions of a cell that come before those of heights and parameters: its lower and its upper end.
ENDS = 2
# A derivative, how far off it is, and what it is when nothing cancels: (3, ...).
Slopes = Array
Slope = tuple[float, float, float]
NONE: Slope = 0.0, 0.0, 0.0


@np.errstate(all="ignore")
def step_gradient(
    plan: StepIntegral, machine: Evaluator, env: Mapping[str, Cell], moving: Sequence[str], rtol: float
) -> MovingTotals | None:
    """The sum and its derivatives by the parameters in `moving`, whose errors count what the rule leaves out; None as
    for `step_sum`. machine: one that keeps track of rounding."""
    seeds = {name: Node((), ()) for name in moving}
    taped = {name: Cell(cell.v, cell.e, (seeds.get(name),)) for name, cell in env.items()}  # type: ignore[arg-type]
    frame = numbers_at(plan.frame, machine.taped(), taped)
    levels = levels_of(plan, machine.taped(), taped)
    still: dict[str, Value] = {name: Cell(cell.v, cell.e) if cell.t else cell for name, cell in env.items()}
    cells = cells_between(plan, frame, levels, machine, still, 0)
    if not cells.fine:
        return None
    if all(plan.resting):
        cells = lit(cells, plan)
    order, proof = 1, None
    if plan.degree is not None:
        order = plan.degree // 2 + 1
    elif cells.width.size:
        proof = proved(plan, cells, still, rtol)
        if proof is None:
            return None
        order = proof.order
    own = [name for name in plan.body.params if name in seeds]
    value, slopes = _on_cells(plan, cells, machine, still, own, order, proof)
    ends = np.union1d(cells.lower, cells.upper).tolist()  # a root that is not there has no derivative
    by_row = _by_rows(cells, slopes, len(frame))
    answers = [(frame[row].t, by_row[:, row]) for row in ends]
    rising = [i for i, rests in enumerate(plan.resting) if not rests]
    for i, parts in zip(rising, np.moveaxis(slopes[:, ENDS:], 1, 0), strict=False):
        by_height = _by_heights(plan, i, cells, parts)
        answers += [(cell.t, part) for cell, part in zip(levels[i], by_height.T, strict=True)]
    for name, parts in zip(own, np.moveaxis(slopes[:, ENDS + len(rising) :], 1, 0), strict=True):
        answers.append(((seeds[name],), _total(parts)))
    found = _to_parameters(answers)
    number, error, gross = map(list, zip(_total(value).tolist(), *(found.get(seed, NONE) for seed in seeds.values())))
    nodes = order * cells.width.shape[-1]
    return MovingTotals(number, error, gross, nodes) if all(map(math.isfinite, (*number, *error))) else None


def _on_cells(
    plan: StepIntegral, cells: StepCells, machine: Evaluator, env: dict[str, Value], own: Sequence[str], order: int,
    proof: StepProof | None,
) -> tuple[Slopes, Slopes]:  # fmt: skip
    """What is integrated on each cell, (3, C), and its derivatives by the ends of the cell, by the heights that move
    and by these parameters, (3, k, C)."""
    rising = [name for name, rests in zip(plan.names, plan.resting, strict=True) if not rests]
    names = (*rising, *own)
    k, rule = ENDS + len(names), gauss(order)
    nodes, width = rule.nodes[:, None], cells.width[0]
    none = (None,) * len(names)
    place = Cell(cells.low[0] + width * nodes, cells.off[0], (1.0 - nodes, nodes, *none), (EPS, EPS, *none))
    here: dict[str, Value] = {**env, plan.variable: place, **dict(zip(plan.names, cells.levels(), strict=True))}
    for i, name in enumerate(names, ENDS):
        cell = here[name]
        assert isinstance(cell, Cell)
        here[name] = Cell(cell.v, cell.e, (None,) * i + (1.0,) + (None,) * (k - i - 1))
    moved = machine.with_directions(k)
    value, error = dense(moved.evaluate(plan.body, here, None), k, place.v.shape)  # type: ignore[union-attr]
    number, size = rule.weights @ value[0], rule.weights @ np.abs(value[0])
    rounded = np.zeros(size.shape) if error is None else rule.weights @ error[0]
    long, off = np.zeros((2, *number.shape))
    long[:3], off[:3] = np.broadcast_arrays(width, -1.0, 1.0), np.broadcast_arrays(cells.off[0], EPS, EPS)
    gross = product(size, np.abs(long))
    lost = product(rounded, np.abs(long)) + product(size, off) + SUMMED * gross
    if proof is not None:
        kept = [*range(ENDS), *(ENDS + plan.names.index(name) for name in rising)]
        kept += [ENDS + len(plan.names) + others(plan).index(name) for name in own]
        lost[0] += proof.error
        lost[1:] += proof.error / proof.radius[kept]  # Cauchy's estimate
    found = np.array((product(number, long), lost, gross))
    return found[:, 0], found[:, 1:]


def _total(parts: Slopes) -> Slopes:
    """The sum over the cells."""
    found: Slopes = parts.sum(axis=-1)
    found[1] += PAIRWISE * found[2]
    return found


def _by_rows(cells: StepCells, slopes: Slopes, rows: int) -> Slopes:
    """The derivatives by the rows of the frame, (3, rows): each cut is the upper end of a cell and the lower one of the
    next."""
    found = np.zeros((3, rows))
    found[:, cells.lower] = slopes[:, 0]
    found[:, cells.upper] += slopes[:, 1]
    found[1] += EPS * found[2]
    return found


def _by_heights(plan: StepIntegral, own: int, cells: StepCells, parts: Slopes) -> Slopes:
    """The derivatives by what a step function is made of (`StepFunction`): what is below all surfaces counts on all
    cells, a change on those above its surface, a value where it is taken. parts: by the height on each cell, all of
    which there are."""
    step, sides, count = plan.steps[own], cells.sides, cells.passed.cells
    along = np.zeros((3, 1 + count), dtype=WIDE)
    along[:, : parts.shape[-1]] = np.cumsum(parts[:, ::-1].astype(WIDE), axis=-1)[:, ::-1]
    total, alone = along[:, :1], list(step.alone)
    by_row = along[:, cells.passed.place[layout(plan).rows[alone]]]  # (3, N, M)
    above = total * sides.first[alone] + (by_row * sides.change[alone]).sum(axis=-1)
    gross = (by_row * np.abs(sides.change[alone])).sum(axis=-1) + total * sides.first[alone]
    above[1:] = gross[1:]
    values = [
        np.array([np.bincount(which, part, len(choice.values)) for part in parts])
        for choice, which in zip(step.choices, cells.taken[own], strict=True)
    ]
    found = np.concatenate([np.repeat(total, 1 + len(alone), axis=1), above, *values], axis=1)
    found[1] += 3 * parts.shape[-1] * WIDE_EPS * found[2]
    slopes: Slopes = found.astype(float)
    slopes[1] += PAIRWISE * slopes[2]
    return slopes


def _to_parameters(answers: Sequence[tuple[tuple[object, ...], Slopes]]) -> dict[Node, Slope]:
    """What a tape makes of derivatives by the numbers that it led to."""
    nodes, slopes = [t for t, _ in answers], np.array([part for _, part in answers]).tolist()
    found = adjoints([
        (t[0], Accumulated(number, gross, error, False))
        for t, (number, error, gross) in zip(nodes, slopes, strict=True)
        if t and isinstance(t[0], Node)
    ])  # fmt: skip
    return {seed: (float(x.value), float(x.error), float(x.size)) for seed, x in found.items()}
