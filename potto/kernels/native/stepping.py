"""A plain kernel as a loop of machine code: what it makes of a state, made of that again, step after step.

Owns `Stepping`. A function goes through the members of a batch eight at a time, and with them through all steps; the
numbers of the state stay where they are from step to step, and each is written down for every step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from potto.kernels.cells import Array, Cell, Value, all_arrays, all_cells
from potto.kernels.making import counts
from potto.kernels.native.elementary import module
from potto.kernels.native.objects import Loaded
from potto.kernels.native.operations import NotStraight
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.straight import ArgumentPart, FlatKernel, Packed, Result, needed, packed
from potto.kernels.native.vectors import LANES, Vectors
from potto.kernels.written import Kernel

NAME = "steps"
HEAD = 3  # numbers of the frame before the columns: how many members, how many steps, where the states go


class Stepping:
    """The steps of a kernel from numbers to numbers. state, place: which of its parameters are the state, and the
    number of the step, if it asks for that. rows: which have a number of their own for every step."""

    def __init__(self, kernel: Kernel, state: int, place: int | None, rows: frozenset[int]) -> None:
        self.kernel, self.state, self.place, self.rows = kernel, state, place, rows
        self.promotion = Promotion(NAME)

    def text(self) -> str:
        """The function. Raises NotStraight."""
        flat = FlatKernel.of(self.kernel)
        results = [cell.v for cell in packed(flat.result)]
        if any(operation.is_mask and operation.name in results for operation in flat.operations):
            raise NotStraight("a condition as a result")
        at = Vectors()
        length, steps = at.address("%frame", 0), at.address("%frame", 1)
        out = at.address("%frame", 2, "ptr")
        last = at.whole("sub", length, LANES)
        blocks = at.whole("udiv", at.whole("add", length, LANES - 1), LANES)
        rooms = {path: at.room(1) for path in _paths(flat.result, (self.state,))}
        begin = at.whole("mul", at.begin(blocks), LANES)
        first = at.once(f"call i64 @llvm.umin.i64(i64 {begin}, i64 {last})", begin)  # the last ones are done twice

        def column(number: int, row: str = "0") -> str:
            place = at.whole("add", at.whole("mul", row, length), first)
            return at.load(at.at(at.address("%frame", HEAD + number, "ptr"), place, "double"))

        for number, room in enumerate(rooms.values()):
            at.store(column(number), room)
        others = [(name, part) for name, part in flat.parts.items() if part.path[0] not in (self.state, self.place)]
        self.columns = [part for _, part in others]
        numbered = [
            (name, len(rooms) + number, part.path[0] in self.rows) for number, (name, part) in enumerate(others)
        ]
        values = {name: column(number) for name, number, many in numbered if not many}
        step = at.begin(steps)
        values |= {name: column(number, step) for name, number, many in numbered if many}
        for name, part in flat.parts.items():
            if part.path[0] == self.state:
                values[name] = at.load(self.room(rooms, part))
            elif part.path[0] == self.place:
                count = at.spread(at.once(f"uitofp i64 {step} to double", step))
                values[name] = at.apply("add", at.constant("%numbers", 0), count)
        values = at.run(needed(flat.operations, results), values)
        for number, (name, room) in enumerate(zip(results, rooms.values(), strict=True)):
            value = values[name] if name in values else at.number(float(name))
            row = at.whole("add", at.whole("mul", steps, number), step)
            at.store(value, at.at(out, at.whole("add", at.whole("mul", row, length), first), "double"))
            at.store(value, room)
        at.end()
        at.end()
        return module(at, NAME, "ptr %frame, ptr %numbers")

    def room(self, rooms: dict[tuple[int, ...], str], part: ArgumentPart) -> str:
        if part.kind != "v" or part.path not in rooms:
            raise NotStraight("a state that changes its form")
        return rooms[part.path]

    def run(self, function: Loaded, args: Sequence[Value], places: range) -> list[Array]:
        """Each number of the state at the beginning and after every step, (1 + steps, *batch). args: of the kernel,
        with the first state; numbers without errors or tangents."""
        begun = [cell.v for cell in all_cells(args[self.state])]
        given = [(x, False) for x in begun]
        given += [(_number(args, part), part.path[0] in self.rows) for part in self.columns]
        shapes = [a.shape[1:] if at in self.rows else a.shape for at, arg in enumerate(args) for a in all_arrays(arg)]
        shape = np.broadcast_shapes(*shapes)
        size = max(math.prod(shape), LANES)
        columns = [_columns(x, (len(places), *shape) if many else (1, *shape), size) for x, many in given]
        out = np.empty((len(begun), len(places), size))
        frame = np.array([size, len(places), address(out), *map(address, columns)], dtype=np.int64)
        numbers = np.array([float(places.start)])
        function.call(address(frame), address(numbers))
        counts.native_points += len(places) * math.prod(shape)
        rows = out[..., : math.prod(shape)].reshape(*out.shape[:2], *shape)
        return [np.concatenate((np.broadcast_to(x, (1, *shape)), row)) for x, row in zip(begun, rows, strict=True)]


def _paths(result: Result, path: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """The way to each number of a state that has the form of a result."""
    if isinstance(result, Packed):
        yield path
    else:
        for number, item in enumerate(result):
            yield from _paths(item, (*path, number))


def _columns(number: float | Array, shape: tuple[int, ...], size: int) -> Array:
    """A number of each member, of all steps or of each, in rows of this size, for which members may come again."""
    rows = np.broadcast_to(number, shape).reshape(shape[0], -1)
    return np.ascontiguousarray(rows if rows.shape[1] == size else rows[:, np.arange(size) % rows.shape[1]])


def _number(args: Sequence[Value], part: ArgumentPart) -> float | Array:
    found = args[part.path[0]]
    for number in part.path[1:]:
        assert isinstance(found, tuple)
        found = found[number]
    assert isinstance(found, Cell)
    return found.v
