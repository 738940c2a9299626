"""What sits at an end of a variable that is not the innermost one, too narrow for any node.

Owns `peaks_at_ends`. At the ends of segments of the innermost variable integrands are looked at anyway. Further out
that takes an integral each, so it is done only where the integrand itself, at a few places on the ends of ranges, is
far larger than at places within, and than beside them: not where a bracket holds at ends alone. Cuts are not looked at.
"""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np

from potto.integrate.pieces import Evaluator, components, gather, numbers_at, still
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import PEAK
from potto.kernels.cells import Array, Bools, Cell, Value

# Where variables are looked at, in parts of their ranges; of more, each at its own ends with the others in the middle.
PLACES, MANY = (0.0, 0.11, 0.5, 0.89, 1.0), 4
BESIDE = 2.0**-9  # how far from the ends it is looked beside them: a fifth of the way to the first of eleven nodes


def peaks_at_ends(plan: Plan, machine: Evaluator, env: dict[str, Value], batch: int) -> bool:
    """Whether some member's integrand is far larger on the ends of outer variables than within."""
    count = len(plan.levels)
    if count == 1 or plan.over is not None or all(degree is not None for degree in plan.degrees):
        return False
    machine = machine.with_directions(0)
    parts = _parts(count)
    beside = parts.copy()
    beside[:, :-1] = np.clip(beside[:, :-1], BESIDE, 1.0 - BESIDE)
    each = np.concatenate((parts, beside))
    here = gather({name: still(value) for name, value in env.items()}, np.repeat(np.arange(batch), len(each)))
    within, at_end = np.ones(batch * len(each), dtype=bool), np.zeros(batch * len(each), dtype=bool)
    for number, level in enumerate(plan.levels):
        low, high, *_ = numbers_at(level.frame, machine, here)
        x, inside = _spread(np.asarray(low.v), np.asarray(high.v), np.tile(each[:, number], batch))
        here[level.variable] = Cell(x)
        within &= inside
        if number + 1 < count:
            at_end |= ~inside
    with np.errstate(all="ignore"):
        values = components(machine.evaluate(plan.body, {n: here[n] for n in plan.body.params}, None))
    shape = batch, 2, len(parts)
    for cell in values:
        sizes = np.abs(np.broadcast_to(cell.v, at_end.shape))
        sizes = np.where(np.isfinite(sizes), sizes, 0.0)
        middle = np.where(within, sizes, 0.0).reshape(batch, -1).max(axis=1, keepdims=True)
        ends, near = np.moveaxis(sizes.reshape(shape), 1, 0)
        if (at_end.reshape(shape)[:, 0] & (ends > PEAK * np.maximum(near, middle))).any():
            return True
    return False


@lru_cache(maxsize=16)
def _parts(count: int) -> Array:
    """The places at which so many variables are looked at, in parts of their ranges: (N, count)."""
    if count < MANY:
        return np.array(list(itertools.product(PLACES, repeat=count)))
    places = np.full((1 + 2 * count, count), 0.5)
    for variable in range(count):
        places[1 + 2 * variable : 3 + 2 * variable, variable] = 0.0, 1.0
    return places


def _spread(low: Array, high: Array, part: Array) -> tuple[Array, Bools]:
    """Places at parts of ranges, and which of them are within; ranges without an end are looked at near the other."""
    with np.errstate(all="ignore"):
        x = low + part * (high - low)
        rest = part / (1.0 - part)
        x = np.where(np.isinf(high) & np.isfinite(low), low + rest, x)
        x = np.where(np.isinf(low) & np.isfinite(high), high - 1.0 / rest, x)
        x = np.where(np.isinf(low) & np.isinf(high), 2.0 * part - 1.0, x)
    at_end: Bools = ((part == 0.0) & np.isfinite(low)) | ((part == 1.0) & np.isfinite(high))
    return np.where(np.isfinite(x), x, 0.0), ~at_end & np.isfinite(x)
