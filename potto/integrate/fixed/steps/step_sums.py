"""The integral of one member between its cuts, as the sum over its cells: what does for numbers.

Owns `SteppedCall`. All cells are done at once, with the same nodes: their ends, and the heights of step functions, are
arrays. Where the integrand is a polynomial on each, the rule leaves nothing out; else it is proved what it leaves out
(`step_orders`). Nodes move with the ends of their cells, so that the tangents of the sum are the derivatives.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from msgspec import Struct

from potto.integrate.fixed.moving_sums import SUMMED, MovingTotals, product
from potto.integrate.fixed.proved_sums.settled import accurate
from potto.integrate.fixed.regions import LOOSEST
from potto.integrate.fixed.steps.stays import Stay
from potto.integrate.fixed.steps.step_cells import StepCells, step_cells
from potto.integrate.fixed.steps.step_integral import StepIntegral
from potto.integrate.fixed.steps.step_orders import enough
from potto.integrate.pieces import Evaluator, dense
from potto.integrate.rules.gauss import gauss
from potto.kernels.cells import Array, Cell, Value
from potto.kernels.whole import PAIRWISE


class SteppedCall(Struct, frozen=True):
    """The integral as a function of its parameters, whatever these are. machine: one that keeps track of rounding.
    stay: tells when parameters have stayed near each other for so long that there is a shorter way."""

    plan: StepIntegral
    machine: Evaluator
    stay: Stay | None = None

    def at(self, env: dict[str, Any]) -> MovingTotals | None:
        """The value and its tangents; None where that is not plain, or not as accurate as was asked for, or a shorter
        way is due."""
        if self.stay is not None and self.stay.due(env):
            return None
        machine = self.machine
        found = step_sum(self.plan, machine, env, min(machine.rtol, LOOSEST))
        return None if found is None else accurate(*found, machine.rtol, machine.atol)


@np.errstate(all="ignore")
def step_sum(
    plan: StepIntegral, machine: Evaluator, env: dict[str, Value], rtol: float
) -> tuple[MovingTotals, list[float]] | None:
    """The sums with their rounding, and bounds of what the rule leaves out of each; None where cuts are not apart, the
    integrand is not defined somewhere, or nothing is proved."""
    cells = step_cells(plan, machine, env)
    if not cells.fine:
        return None
    cells = lit(cells, plan)
    nothing = [0.0] * (1 + machine.directions)
    if not cells.width.size:
        return MovingTotals(nothing, nothing, nothing), nothing
    order, truncation = 1, nothing
    if plan.degree is not None:
        order = plan.degree // 2 + 1
    else:
        proof = enough(plan, cells, env, rtol)
        if proof is None:
            return None
        order, truncation = proof
    found = _added(plan, cells, machine, env, order)
    return None if found is None else (found, truncation)


def lit(cells: StepCells, plan: StepIntegral) -> StepCells:
    """The cells of one member without those on which nothing is integrated."""
    if not plan.dark:
        return cells
    kept = np.any([number.any(axis=0) for number, _ in cells.heights], axis=0)
    return cells if kept.all() else cells.pick((np.flatnonzero(kept),))


def _added(
    plan: StepIntegral, cells: StepCells, machine: Evaluator, env: dict[str, Value], order: int
) -> MovingTotals | None:
    """The sums over all nodes; None where one of them is not finite."""
    rule, moving = gauss(order), cells.moving
    at = cells.low[:, None] + cells.width[:, None] * rule.nodes[:, None]  # (1 + k, order, C)
    place = Cell(
        at[0], cells.off[0], tuple([at[d] if m else None for d, m in enumerate(moving, 1)]),
        tuple([cells.off[d] if m else None for d, m in enumerate(moving, 1)]),
    )  # fmt: skip
    here: dict[str, Value] = {plan.variable: place, **dict(zip(plan.names, cells.levels(), strict=True))}
    here = {name: here[name] if name in here else env[name] for name in plan.body.params}
    value, error = dense(machine.evaluate(plan.body, here, None), machine.directions, at.shape[1:])
    number, size = rule.weights @ value[0], rule.weights @ np.abs(value[0])
    rounded = np.zeros(size.shape) if error is None else rule.weights @ error[0]
    total = _summed(number, size, rounded, cells, at[0].size)
    return total if all(map(math.isfinite, total.number)) else None


def _summed(number: Array, size: Array, rounded: Array, cells: StepCells, nodes: int) -> MovingTotals:
    """Means of the integrand on cells (1 + k, C), of its size and of its rounding, times their widths, added up."""
    width, off = cells.width, cells.off
    long = np.abs(width)
    gross = product(size, long).sum(axis=-1)
    error = (product(rounded, long) + product(size, off)).sum(axis=-1) + (SUMMED + PAIRWISE) * gross
    return MovingTotals(product(number, width).sum(axis=-1).tolist(), error.tolist(), gross.tolist(), nodes)
