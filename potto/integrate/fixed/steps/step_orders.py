"""How many nodes are enough for the cells of one member, proved of all of them at once.

Owns `enough`, `proved` and `StepProof`. To a proof (`proved_orders`) the ends of a cell and the heights of step
functions on it are parameters as others are, and the cells are regions of these: what it takes is that of one cell, in
longer arrays. It is kept, and holds for as long as all of these stay within their radii: that is seen by as many
comparisons.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from msgspec import Struct

from potto.core.terms import var
from potto.integrate.fixed.regions import MARGIN, REGION
from potto.integrate.fixed.steps.step_cells import StepCells
from potto.integrate.fixed.steps.step_integral import StepIntegral
from potto.integrate.rules.proved_orders import LEAST_NODES, FrameCell, error_bounds
from potto.kernels.cells import Array, Cell, Value
from potto.kernels.making import making

LOW, HIGH = "#low", "#high"
# Radii of the parameters' discs: of the ends of a cell, as parts of its width, and of a height and any other parameter,
# as parts of its size. The smaller ones where nothing is proved with the larger.
RADII = (2.0**-3, REGION), (2.0**-4, REGION), (2.0**-8, 2.0**-4 * REGION)


class StepProof(Struct, frozen=True):
    """That so many nodes are enough within these radii about these numbers, (P, C) each: those of the ends of cells, of
    the step functions, and of what else the integrand reads (`others`). error: bounds of what the rule leaves out of
    each cell, (C,)."""

    middle: Array
    radius: Array
    order: int
    error: Array

    def holds(self, numbers: Array) -> bool:
        return numbers.shape == self.middle.shape and bool((np.abs(numbers - self.middle) <= self.radius).all())


def enough(
    plan: StepIntegral, cells: StepCells, env: Mapping[str, Value], rtol: float
) -> tuple[int, list[float]] | None:
    """How many nodes on each cell of a member, and bounds of what they leave out of the sum and of its tangents; None
    where none are proved to be enough for a part MARGIN of `rtol`, derivatives by the ends of cells included."""
    numbers = _numbers(plan, cells, env)  # (P, 1 + k, C)
    proof = _known(plan, numbers, rtol)
    if proof is None:
        return None
    still = numbers[:, 1:] == 0
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.where(still, 0.0, np.abs(numbers[:, 1:]) / proof.radius[:, None]).max(axis=0)  # Cauchy's estimate
    return proof.order, [float(proof.error.sum()), *(rates @ proof.error).tolist()]


def proved(plan: StepIntegral, cells: StepCells, env: Mapping[str, Value], rtol: float) -> StepProof | None:
    """The proof of it."""
    return _known(plan, _numbers(plan, cells, env), rtol)


def others(plan: StepIntegral) -> list[str]:
    """What an integrand reads beside its variable and step functions."""
    return [name for name in plan.body.params if name != plan.variable and name not in plan.names]


def _known(plan: StepIntegral, numbers: Array, rtol: float) -> StepProof | None:
    proof: StepProof | None = plan.proofs.get(rtol)
    if proof is None or not proof.holds(numbers[:, 0]):
        with making:
            proof = _proved(plan, numbers, rtol)
        if proof is not None:
            plan.proofs[rtol] = proof
    return proof


def _numbers(plan: StepIntegral, cells: StepCells, env: Mapping[str, Value]) -> Array:
    """The parameters of the cells with their tangents: ends, heights, then the others that the integrand reads."""
    low, read = cells.low, others(plan)
    rows = np.zeros((2 + len(plan.names) + len(read), *low.shape))
    rows[0], rows[1] = low, low + cells.width
    for row, (height, _) in zip(rows[2:], cells.heights, strict=False):
        row[: len(height)] = height
    for row, name in zip(rows[2 + len(plan.names) :], read, strict=True):
        given = env[name]
        assert isinstance(given, Cell)
        row[0] = given.v
        for d, t in enumerate(given.t, 1):
            row[d] = 0.0 if t is None else t
    return rows


def _proved(plan: StepIntegral, numbers: Array, rtol: float) -> StepProof | None:
    names, middle = [LOW, HIGH, *plan.names, *others(plan)], numbers[:, 0]
    width, reach = middle[1] - middle[0], middle[1, -1] - middle[0, 0]
    cell = FrameCell(((0, 1),), plan.body.body)
    for of_ends, of_others in RADII:
        sizes = np.maximum(np.abs(middle[2:]).max(axis=1), reach)
        sizes[: len(plan.names)][list(plan.resting)] = 0.0
        radius = np.empty(middle.shape)
        radius[:2], radius[2:] = of_ends * width, (of_others * sizes)[:, None]
        errors, size = error_bounds(
            (plan.variable,), ((var(LOW), var(HIGH)),), cell, dict(zip(names, middle, strict=True)),
            dict(zip(names, radius, strict=True)),
        )  # fmt: skip
        rates = errors[0] * (reach / np.maximum(radius[0], np.finfo(float).tiny))  # where an end runs the whole way
        left = rates.sum(axis=-1) <= MARGIN * rtol * abs(float(size.sum()))
        if left.any():
            number = int(left.argmax())
            return StepProof(middle, radius, number + LEAST_NODES, errors[0, number])
    return None
