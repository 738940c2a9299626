"""Members of a batch of which too little is known, evaluated as numbers are.

Owns `told_alone`. What a sum or a product rounds off is looked at in full where it is one number; over a batch it
counts as half a unit in its last place, and a tangent of 0 is a number as any other. That decides nothing but where a
slope is infinite: 2 - x is 1, or 1 give or take something, of which asin may be anything; and infinity times 0 has no
value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import reduce

import numpy as np

from potto.kernels.cells import (
    Array,
    Cell,
    Number,
    Value,
    all_cells,
    batch_shape,
    combined,
    map_arrays,
    map_cells,
)
from potto.runtime.evaluation.machine import Machine

MOST = 1024  # members, each of which takes a run of its own: 0.1 ms and more

Found = Callable[[Machine, Mapping[str, Value]], Value]


def told_alone(value: Value, machine: Machine, env: Mapping[str, Value], found: Found) -> Value:
    """The value over a batch, in which members are as they are alone of which something is a number, and something else
    not known. Integrals see to their members themselves."""
    if machine.taping or machine.record.methods or not env or not _plain(value):
        return value
    cells = all_cells(value)
    parts = [part for cell in cells for part in (cell.v, cell.e, *cell.t, *cell.et) if part is not None]
    # a sum tells it in a third of the time of a look at each
    if all(math.isfinite(part if np.ndim(part) == 0 else np.add.reduce(part, None)) for part in parts):
        return value
    shape = batch_shape(env.values())
    if len(shape) != 1:
        return value
    known, number = (
        reduce(both, (np.isfinite(part) for part in some))
        for both, some in ((np.logical_and, parts), (np.logical_or, [cell.v for cell in cells]))
    )
    members = np.flatnonzero(np.broadcast_to(number & ~known, shape))
    for member in members if members.size <= MOST else ():
        with machine.unrecorded() as apart:
            alone = found(apart, {name: _of(own, int(member), shape) for name, own in env.items()})
        value = combined(lambda whole, own, at=member: _put(whole, own, at, shape), value, alone)
    return value


def _plain(value: Value) -> bool:
    """Whether a value is made of numbers alone."""
    return all(map(_plain, value)) if isinstance(value, tuple | list) else isinstance(value, Cell)


def _of(value: Value, member: int, shape: tuple[int, ...]) -> Value:
    """The value of a member; in a direction in which it does not move it has no tangent."""

    def still(cell: Cell) -> Cell:
        t = tuple([None if isinstance(x, float) and x == 0 and not off else x for x, off in zip(cell.t, cell.et)])
        return Cell(cell.v, cell.e, t, cell.et)

    return map_cells(map_arrays(value, lambda a: float(np.broadcast_to(a, shape)[member])), still)


def _put(whole: Number, own: Number, member: int, shape: tuple[int, ...]) -> Array:
    out: Array = np.array(np.broadcast_to(whole, shape))
    out[member] = own
    return out
