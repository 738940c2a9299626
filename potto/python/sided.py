"""What a tape does not tell: the derivatives on both sides, by the parameters that move something that has two.

Owns `with_sides`. A tape has one slope for each number. Which of two counts depends on the way in which a parameter
moves the number that is at a kink, and that is another for each parameter: so by those that move one it is
differentiated forward, a few at a time, if they are few. By all others the tape is right.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import count
from typing import Any

import numpy as np

from potto.integrate.events import OneSidedDerivatives, TwoSided
from potto.kernels.cells import Array, Bools, Cell, Rows, Value, all_cells, map_cells
from potto.kernels.sweeps import reached
from potto.kernels.tape import Node
from potto.python.moving import with_places
from potto.runtime.answers.convergence import merged
from potto.runtime.evaluation.record import Record

BLOCK = 32  # directions at once: a forward run costs 1.6 values with 4 of them, and with 64 up to 4.8
MOST = 32  # parameters that move what has two: with more of them a gradient would cost by their number

Direction = tuple[int, tuple[int, ...]]  # a number of the parameters: whose seed it has, and its place in arrays
Forward = Callable[[dict[str, Value], int], tuple[Value, Record]]  # by parameters that move in so many directions


def with_sides(found: Value, record: Record, given: dict[str, Value], seeds: Sequence[Node], forward: Forward) -> Value:
    """What a tape has found, with the derivatives by what moves one that has two put right, and both of them noted.

    Where more than `MOST` parameters do, the tape's: each is a derivative of every part to one of its sides, and notes
    are those of parts.
    """
    directions = list(_directions(given.values()))
    number = {direction: i for i, direction in enumerate(directions)}
    marked = reached(record.taped)
    marks = [_over_members(marked.get(seed, False), seed, directions, k) for k, seed in enumerate(seeds)]
    touched = [(k, place) for k, place in directions if marks[k][place]] or directions
    if len(touched) > MOST:
        return found
    cells = {i: _Slopes(cell, seeds) for i, cell in enumerate(all_cells(found)) if cell.t}
    if len(touched) == len(directions):
        record.shortfalls = {}  # what the tape lacked is found anew
    record.edges = []
    notes: dict[TwoSided, list[Array]] = {}
    for block in (touched[start : start + BLOCK] for start in range(0, len(touched), BLOCK)):
        value, own = forward(_moving(given, block), len(block))
        parts = all_cells(value)
        for i, slopes in cells.items():
            slopes.put(block, parts[i])
        record.evaluations += own.evaluations
        merged(record.shortfalls, own.shortfalls)
        for edge in own.edges:
            _noted(notes, edge, [number[direction] for direction in block], len(directions))
    for cause, sides in notes.items():
        if len(sides[0]) == len(cells):
            _filled(sides, [slopes.by(directions) for slopes in cells.values()])
        record.edges.append(OneSidedDerivatives(cause, *(side.reshape(-1, *side.shape[2:]) for side in sides)))
    rest = iter(cells.values())
    return map_cells(found, lambda cell: next(rest).cell if cell.t else cell)


def _directions(values: Iterable[Value]) -> Iterator[Direction]:
    """The numbers of all parameters in their order, arrays element by element."""
    seed = 0
    for value in values:
        for k, place in _within(value, ()):
            yield seed + k, place
        seed += len(all_cells(value))


def _within(value: Value, place: tuple[int, ...]) -> Iterator[Direction]:
    if isinstance(value, Rows):
        for row in range(value.size):
            yield from _within(value.item, (*place, row))
    elif isinstance(value, tuple):
        seed = 0
        for item in value:
            for k, inner in _within(item, place):
                yield seed + k, inner
            seed += len(all_cells(item))
    else:
        yield 0, place


def _over_members(mask: Any, seed: Node, directions: Sequence[Direction], k: int) -> Bools:
    """Which elements of a parameter are marked for some member of a batch."""
    axes = next(len(place) for own, place in directions if own == k)
    whole: Bools = np.broadcast_to(mask, seed.shape)
    found: Bools = np.any(whole, axis=tuple(range(axes, whole.ndim)))
    return found


def _moving(given: dict[str, Value], block: Sequence[Direction]) -> dict[str, Value]:
    """The parameters, of which these numbers move, each in a direction of its own."""
    seeds = count()

    def change(cell: Cell, places: tuple[int, ...]) -> Cell:
        k = next(seeds)
        more = (1,) * (np.ndim(cell.v) - len(places))
        return Cell(cell.v, cell.e, tuple(_unit(place, places, more) if own == k else None for own, place in block))

    return {name: with_places(value, (), change) for name, value in given.items()}


def _unit(place: tuple[int, ...], places: tuple[int, ...], more: tuple[int, ...]) -> Any:
    if not places:
        return 1.0
    unit = np.zeros((*places, *more))
    unit[place] = 1.0
    return unit


def _noted(notes: dict[TwoSided, list[Array]], edge: OneSidedDerivatives, block: list[int], directions: int) -> None:
    """Put what was met in a block among what is known of its cause: (answers, directions, ...) each."""
    for number, side in enumerate(edge.sides):
        rows = side.reshape(-1, len(block), *side.shape[1:])
        unknown = [np.full((len(rows), directions, *rows.shape[2:]), np.nan) for _ in edge.sides]
        notes.setdefault(edge.cause, unknown)[number][:, block] = rows


def _filled(sides: Sequence[Array], slopes: Sequence[tuple[Array, Array]]) -> None:
    """By parameters that move nothing that has two derivatives there is one, to both sides."""
    for answer, (t, et) in enumerate(slopes):
        backward, forward, before, beyond = (side[answer] for side in sides)
        unknown = np.isnan(backward) & np.isnan(forward)
        unknown &= ~unknown.all(axis=0)  # members that have nothing of this kind
        for side, known in ((backward, t), (forward, t), (before, et), (beyond, et)):
            side[unknown] = np.broadcast_to(known, side.shape)[unknown]


class _Slopes:
    """The derivatives of one number by all seeds, and how far off they are, to be written to."""

    def __init__(self, cell: Cell, seeds: Sequence[Node]) -> None:
        def whole(parts: tuple[Any, ...]) -> list[Array]:
            return [np.array(np.broadcast_to(0.0 if x is None else x, seed.shape))
                    for x, seed in zip(parts, seeds, strict=True)]  # fmt: skip

        self.v, self.e, self.t, self.et = cell.v, cell.e, whole(cell.t), whole(cell.et)

    def put(self, block: Sequence[Direction], cell: Cell) -> None:
        for (k, place), t, et in zip(block, cell.t, cell.et, strict=True):
            self.t[k][place] = 0.0 if t is None else t
            self.et[k][place] = 0.0 if et is None else et

    def by(self, directions: Sequence[Direction]) -> tuple[Array, Array]:
        """The derivatives in these directions, and how far off they are: (directions, ...) each."""
        t, et = (np.array([part[k][place] for k, place in directions]) for part in (self.t, self.et))
        return t, et

    @property
    def cell(self) -> Cell:
        def plain(x: Array) -> Any:
            return x if x.ndim else float(x)

        return Cell(self.v, self.e, tuple(map(plain, self.t)), tuple(map(plain, self.et)))
