"""Sums over the nodes of cells whose ends are formulas: values and tangents, with the rounding of both.

Owns `summed`, `product`, `Totals` and `evaluated`. Nodes move with the ends of their cells, so that the tangent of the
sum is the derivative of the integral. Blocks of numbers have values in row 0 and tangents in rows 1 ... k of their
first axis; the nodes of the variables, (P, n2, n3), are their last axes: P those of the outermost variable, cell after
cell.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from msgspec import Struct

from potto.core.terms import Lam, function_of
from potto.integrate.pieces import Evaluator, gather
from potto.integrate.rules.gauss import EPS, gauss
from potto.integrate.rules.proved_orders import Cell as Stretch
from potto.integrate.rules.proved_orders import Region
from potto.kernels.cells import Array, Cell, Ints, Value

# The rounding of a sum of products, in units of the last place.
SUMMED = 4 * EPS


def evaluated(function: Lam, machine: Evaluator, env: dict[str, Value]) -> tuple[Cell, ...]:
    """The numbers of a function to a tuple of them, whose parameters have the values of `env`."""
    values = machine.evaluate(function, env, None)
    assert isinstance(values, tuple)
    return values  # type: ignore[return-value]


@lru_cache(maxsize=4096)
def _outer(orders: tuple[int, ...]) -> tuple[Ints, Array, Array]:
    """For the nodes of the outermost variable, cell after cell: the cell, the node in [0, 1], the weight."""
    rules = [gauss(n) for n in orders]
    owner = np.repeat(np.arange(len(orders)), orders)
    return owner, np.concatenate([r.nodes for r in rules]), np.concatenate([r.weights for r in rules])


class Totals(Struct, frozen=True):
    """Values and tangents (1 + k,), the rounding of each, and what each is when nothing cancels."""

    number: list[float]
    rounding: list[float]
    gross: list[float]


def summed(
    variables: Sequence[str], frames: Sequence[Lam], region: Region, machine: Evaluator, env: dict[str, Value],
    frame: tuple[Cell, ...],
) -> Totals | None:  # fmt: skip
    """Weighted sums over the nodes of all cells: value and tangents, with their rounding. None where cuts cross.

    frames: per variable its bounds and cuts, as functions of what is further out; `frame` has the values of the first.
    """
    tracked, here = machine.tracking(), dict(env)
    owner, nodes, weights = _outer(region.outer)
    rows = _rows(region)
    shape, length, rounded = (1,), None, None
    for i, variable in enumerate(variables):
        if i:
            frame = evaluated(frames[i], tracked, here)
            nodes = gauss(region.inner[i - 1]).nodes
        found = _between(_block(frame, machine.directions, shape), rows[i], i > 0)
        if found is None:
            return None
        lo, width, off = found
        if i > 1:
            weights = weights[..., None] * gauss(region.inner[i - 2]).weights
        for name in variables[:i]:
            here[name] = here[name].map(_deeper)  # type: ignore[union-attr]
        moves = [any(cell.t[d] is not None for cell in frame) for d in range(machine.directions)]
        here[variable] = _placed(lo, width, off, nodes, i > 0, moves)
        if length is None or rounded is None:
            length, rounded = width, off
        else:
            if i > 1:
                length, rounded = _deeper(length), _deeper(rounded)
            length, rounded = _times(length, rounded, width, off)
        shape = here[variable].v.shape  # type: ignore[union-attr]
    values = _integrand(region.cells, owner, tracked, here, shape)
    if len(variables) > 1:
        values = values @ gauss(region.inner[-1]).weights
    machine.count(math.prod(shape))
    return _added(values, length * weights, rounded * weights)  # type: ignore[operator]


@lru_cache(maxsize=4096)
def _rows(region: Region) -> tuple[Ints, ...]:
    """Per variable, for every node of the outermost one, which rows of the frame are the ends of its cell: (2, P)."""
    owner, _, _ = _outer(region.outer)
    count = len(region.cells[0].rows)
    ends = np.array([cell.rows for cell in region.cells])[owner]
    return tuple(ends[:, i].T.copy() for i in range(count))


def _deeper(array: Array) -> Array:
    return array[..., None]


def _block(frame: Sequence[Cell], k: int, shape: tuple[int, ...]) -> Array:
    """Cells as one array: (2, 1 + k, cells, *shape), the numbers and their errors; values, then tangents."""
    out = np.zeros((2, 1 + k, len(frame), *shape))
    for row, cell in enumerate(frame):
        out[0, 0, row] = cell.v
        if cell.e is not None:
            out[1, 0, row] = cell.e
        for d, (t, et) in enumerate(zip(cell.t, cell.et, strict=True), 1):
            if t is not None:
                out[0, d, row] = t
            if et is not None:
                out[1, d, row] = et
    return out


def _between(block: Array, rows: Ints, inner: bool) -> tuple[Array, Array, Array] | None:
    """Per node the lower end, the length, and the rounding of both: (1 + k, P, ...). None where cuts cross."""
    ends = block[:, :, rows, np.arange(rows.shape[1])] if inner else block[:, :, rows, 0]
    lo, hi = ends[0, :, 0], ends[0, :, 1]
    width = hi - lo
    if inner:
        places = block[0, 0]
        if not (width[0] > 0).all() or ((places > lo[0]) & (places < hi[0])).any():
            return None
    return lo, width, (ends[1] + EPS * np.abs(ends[0])).sum(axis=1)


def _placed(lo: Array, width: Array, off: Array, nodes: Array, inner: bool, moves: Sequence[bool]) -> Cell:
    """The nodes of a variable, which move with the ends of its stretch."""
    if inner:
        lo, width, off = lo[..., None], width[..., None], off[..., None]
    at = lo + width * nodes
    t = tuple(at[d] if m else None for d, m in enumerate(moves, 1))
    return Cell(at[0], off[0], t, tuple(off[d] if m else None for d, m in enumerate(moves, 1)))


def _times(length: Array, rounded: Array, width: Array, off: Array) -> tuple[Array, Array]:
    """The product of the lengths so far with that of one more variable, its tangents, and its rounding."""
    found = product(length, width)
    return found, product(rounded, np.abs(width)) + product(np.abs(length), off) + 2 * EPS * np.abs(found)


def product(block: Array, factor: Array) -> Array:
    """(f g)' = f' g + f g', for blocks (1 + k, ...)."""
    found: Array = block * factor[0]
    found[1:] += block[0] * factor[1:]
    return found


def _integrand(
    cells: tuple[Stretch, ...], owner: Ints, machine: Evaluator, here: dict[str, Value], shape: tuple[int, ...]
) -> Array:
    """Numbers, errors and magnitudes of the integrand at the nodes: (3, 1 + k, *shape)."""
    out = np.zeros((3, 1 + machine.directions, *shape))
    faces = dict.fromkeys(cell.body for cell in cells)
    for face in faces:
        function = function_of(face)
        env, index = {n: here[n] for n in function.params}, None
        if len(faces) > 1:
            index = np.nonzero(np.array([cell.body is face for cell in cells])[owner])[0]
            env = gather(env, index)
        cell = machine.evaluate(function, env, None)
        assert isinstance(cell, Cell)
        for part, numbers in enumerate(((cell.v, *cell.t), (cell.e, *cell.et))):
            for row, number in enumerate(numbers):
                if number is not None:
                    out[part, row, ... if index is None else index] = number
    np.abs(out[0], out=out[2])
    return out


def _added(values: Array, length: Array, rounded: Array) -> Totals:
    """Sums over nodes of the integrand (3, 1 + k, P, ...) times the lengths (1 + k, P, ...) with their weights."""
    values, k1 = values.reshape(*values.shape[:2], -1), len(length)
    length, rounded = length.reshape(k1, -1).T, rounded.reshape(k1, -1).T
    size = np.abs(length)

    def ruled(products: Array) -> Array:  # (f g)' = f' g + f g'
        total: Array = products[:, 0] + products[0]
        total[0] = products[0, 0]
        return total

    gross = ruled(values[2] @ size)
    rounding = ruled(values[1] @ size) + ruled(values[2] @ rounded) + SUMMED * gross
    return Totals(ruled(values[0] @ length).tolist(), rounding.tolist(), gross.tolist())
