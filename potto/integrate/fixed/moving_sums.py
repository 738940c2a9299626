"""Sums over the nodes of cells whose ends are formulas: values and tangents, with the rounding of both.

Owns `summed`, `product`, `any_moves` and `MovingTotals`. Nodes move with the ends of their cells, so that
the tangent of the sum is the derivative of the integral. Blocks of numbers have values in row 0 and tangents in rows
1 ... k of their first axis; the nodes of the variables, (P, n2, n3), are their last axes: P those of the outermost
variable, cell after cell.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from msgspec import Struct

from potto.core.terms import Lam, function_of
from potto.integrate.pieces import Evaluator, gather, number_at, numbers_at
from potto.integrate.rules.gauss import EPS, gauss
from potto.integrate.rules.proved_orders import Region
from potto.kernels.cells import Array, Cell, Ints, Value

# A variable's number and its frame -> the frame.
Put = Callable[[int, tuple[Cell, ...]], tuple[Cell, ...]]
# The rounding of a sum of products, in units of the last place.
SUMMED = 4 * EPS


class _Layout(Struct, frozen=True):
    """What nodes of a region do not depend on numbers for.

    ends: per variable, for every node of the outermost one, where the ends of its cell are among the values of the
    frame, row after row: (2, P).
    nodes: per variable in [0, 1]. weights: of all variables but the innermost of several. count: of all nodes. faces:
    what is integrated, as functions, with the nodes of the outermost variable at which it is; None: at all.
    """

    ends: tuple[Ints, ...]
    nodes: tuple[Array, ...]
    weights: Array
    count: int
    faces: tuple[tuple[Lam, Ints | None], ...]


@lru_cache(maxsize=4096)
def _layout(region: Region) -> _Layout:
    rules, inner = [gauss(n) for n in region.outer], [gauss(n) for n in region.inner]
    owner = np.repeat(np.arange(len(rules)), region.outer)
    by_variable = np.moveaxis(np.array([cell.rows for cell in region.cells])[owner], 1, 0)
    weights = np.concatenate([r.weights for r in rules])
    for rule in inner[:-1]:
        weights = weights[..., None] * rule.weights
    faces = tuple(dict.fromkeys(cell.body for cell in region.cells))
    found = (np.nonzero(np.array([cell.body is face for cell in region.cells])[owner])[0] for face in faces)
    every, (outer, *others) = np.arange(owner.size), (rows.T for rows in by_variable)
    return _Layout(
        (outer.copy(), *(rows * owner.size + every for rows in others)),
        (np.concatenate([r.nodes for r in rules]), *(r.nodes for r in inner)),
        weights,
        owner.size * math.prod(region.inner),
        tuple((function_of(face), None if len(faces) == 1 else at) for face, at in zip(faces, found, strict=True)),
    )


class MovingTotals(Struct, frozen=True):
    """Values and tangents (1 + k,), how far rounding puts each off, and what each is when nothing cancels; evaluations
    of the integrand."""

    number: list[float]
    error: list[float]
    gross: list[float]
    nodes: int = 0

    def plus(self, other: MovingTotals) -> MovingTotals:
        mine, theirs = (self.number, self.error, self.gross), (other.number, other.error, other.gross)
        number, error, gross = ([x + y for x, y in zip(a, b, strict=True)] for a, b in zip(mine, theirs, strict=True))
        return MovingTotals(number, error, gross, self.nodes + other.nodes)


def summed(
    variables: Sequence[str], frames: Sequence[Lam], region: Region, machine: Evaluator, env: dict[str, Value],
    frame: tuple[Cell, ...], put: Put | None = None,
) -> MovingTotals | None:  # fmt: skip
    """Weighted sums over the nodes of all cells: value and tangents, with their rounding. None where cuts cross.

    frames: per variable its bounds and cuts, as functions of what is further out; `frame` has the values of the first.
    put: what puts the cuts of a variable that lie on its bounds there, so that stretches may have the length 0.
    """
    tracked, here, layout, k = machine.tracking(), dict(env), _layout(region), machine.directions
    shape: tuple[int, ...] = (1,)
    length = rounded = layout.weights
    for i, variable in enumerate(variables):
        if i:
            frame = numbers_at(frames[i], tracked, here)
        if put is not None:
            frame = put(i, frame)
        block = _block(frame, k, shape) if i else columns_of(frame, k)
        ends = block.take(layout.ends[i], axis=2)
        if i and _crossed(block[0, 0].reshape(len(frame), *shape), ends[0, 0, 0], ends[0, 0, 1], put is not None):
            return None
        lo, width, off = _between(ends)
        for name in variables[:i]:
            here[name] = here[name].map(_deeper)  # type: ignore[union-attr]
        moves = [any_moves(frame, d) for d in range(k)]
        here[variable] = placed = _placed(lo, width, off, layout.nodes[i], i > 0, moves)
        if not i:
            length, rounded = width, off
        else:
            if i > 1:
                length, rounded = _deeper(length), _deeper(rounded)
            length, rounded = _times(length, rounded, width, off)
        shape = placed.v.shape  # type: ignore[union-attr]
    values = _integrand(layout, tracked, here, shape)
    if len(variables) > 1:
        values = values @ gauss(region.inner[-1]).weights
    return _added(values, length * layout.weights, rounded * layout.weights, layout.count)


def any_moves(frame: Sequence[Cell], d: int) -> bool:
    """Whether any of the cells moves along a direction."""
    for cell in frame:  # noqa: SIM110 - runs with every call: no generator
        if cell.t[d] is not None:
            return True
    return False


def _deeper(array: Array) -> Array:
    return array[..., None]


def columns_of(frame: Sequence[Cell], k: int) -> Array:
    """Cells that are one number each as one array: (2, 1 + k, cells), the numbers and their errors."""
    none = (None,) * k
    parts = ([(c.v, *(c.t or none)) for c in frame], [(c.e, *(c.et or none)) for c in frame])
    return np.array([[[row[d] or 0.0 for row in rows] for d in range(1 + k)] for rows in parts])


def _block(frame: Sequence[Cell], k: int, shape: tuple[int, ...]) -> Array:
    """Cells as one array: (2, 1 + k, cells times P, ...), the numbers and their errors; values, then tangents."""
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
    return out.reshape(2, 1 + k, -1, *shape[1:])


def _between(ends: Array) -> tuple[Array, Array, Array]:
    """Per node the lower end, the length, and the rounding of both, (1 + k, P, ...), from the ends and their errors."""
    lo, hi = ends[0, :, 0], ends[0, :, 1]
    off = np.abs(ends[0])
    off *= EPS
    off += ends[1]
    return lo, hi - lo, off[:, 0] + off[:, 1]


def _crossed(places: Array, lo: Array, hi: Array, touching: bool) -> bool:
    """Whether ends are not in order, or a cut lies between them, at any node. touching: ends may be the same."""
    if not ((lo <= hi) if touching else (lo < hi)).all():
        return True
    return len(places) > 2 and bool(((places > lo) & (places < hi)).any())


def _placed(lo: Array, width: Array, off: Array, nodes: Array, inner: bool, moves: Sequence[bool]) -> Cell:
    """The nodes of a variable, which move with the ends of its stretch."""
    if inner:
        lo, width, off = lo[..., None], width[..., None], off[..., None]
    at = lo + width * nodes
    t = tuple([at[d] if m else None for d, m in enumerate(moves, 1)])
    return Cell(at[0], off[0], t, tuple([off[d] if m else None for d, m in enumerate(moves, 1)]))


def _times(length: Array, rounded: Array, width: Array, off: Array) -> tuple[Array, Array]:
    """The product of the lengths so far with that of one more variable, its tangents, and its rounding."""
    found = product(length, width)
    slack = product(rounded, np.abs(width))
    slack += product(np.abs(length), off)
    slack += 2 * EPS * np.abs(found)
    return found, slack


def product(block: Array, factor: Array) -> Array:
    """(f g)' = f' g + f g', for blocks (1 + k, ...)."""
    found: Array = block * factor[0]
    if len(block) > 1:
        found[1:] += block[0] * factor[1:]
    return found


def _integrand(layout: _Layout, machine: Evaluator, here: dict[str, Value], shape: tuple[int, ...]) -> Array:
    """Numbers, errors and magnitudes of the integrand at the nodes: (3, 1 + k, *shape)."""
    out = np.zeros((3, 1 + machine.directions, *shape))
    for function, index in layout.faces:
        env = here if index is None else gather({n: here[n] for n in function.params}, index)
        cell = number_at(function, machine, env)
        for part, numbers in enumerate(((cell.v, *cell.t), (cell.e, *cell.et))):
            for row, number in enumerate(numbers):
                if number is not None:
                    out[part, row, ... if index is None else index] = number
    np.abs(out[0], out=out[2])
    return out


def _added(values: Array, length: Array, rounded: Array, nodes: int) -> MovingTotals:
    """Sums over nodes of the integrand (3, 1 + k, P, ...) times the lengths (1 + k, P, ...) with their weights."""
    k1 = len(length)
    factors = np.concatenate((length, np.abs(length), rounded)).reshape(3 * k1, -1)
    products = (values.reshape(3 * k1, -1) @ factors.T).tolist()

    def ruled(part: int, by: int) -> list[float]:  # (f g)' = f' g + f g'
        rows, at = products[part * k1 : (part + 1) * k1], by * k1
        first = rows[0][at : at + k1]
        return [first[0], *(row[at] + x for row, x in zip(rows[1:], first[1:], strict=True))]

    gross = ruled(2, 1)
    off = zip(ruled(1, 1), ruled(2, 2), gross, strict=True)
    return MovingTotals(ruled(0, 0), [a + b + SUMMED * c for a, b, c in off], gross, nodes)
