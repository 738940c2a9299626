"""A plain kernel as machine code over the points of a batch.

Owns `Pointwise`: made for a kernel and for which parts of its arguments are arrays. What depends on none of these is
computed by the kernel's own lines first; the arrays, which broadcast against each other, are gone through as rows of
numbers that lie side by side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from potto.kernels.cells import Array, Cell, Value
from potto.kernels.compile import Kernel, Runtime
from potto.kernels.native import objects
from potto.kernels.native.straight import NotStraight, Operation, Packed, Part, Result, Straight, packed, read
from potto.kernels.native.vectors import LANES, Vectors

NAME = "points"


class Pointwise:
    """The kernel for arguments whose parts in `varying` are arrays. Raises NotStraight."""

    def __init__(self, kernel: Kernel, varying: frozenset[Part]) -> None:
        straight = Straight.of(kernel)
        self.parts = straight.parts
        uniform = [name for name, part in straight.parts.items() if part not in varying]
        constant = straight.constant(uniform)
        operations = straight.operations(constant)
        self.result = straight.result
        names = list(dict.fromkeys(name for cell in packed(self.result) for name in cell.parts()))
        made = {operation.name for operation in operations}
        needed = read(operations, names)
        self.arrays = tuple(n for n in needed if n in self.parts and self.parts[n] in varying and n not in constant)
        self.given = tuple(n for n in needed if n in constant)
        self.outputs = tuple(n for n in names if n in made)
        masks = {operation.name for operation in operations if operation.is_mask}
        if masks & set(self.outputs):
            raise NotStraight("a condition as a result")
        self.uniform = tuple(name for name in self.parts if name in constant)
        self.prelude = straight.prelude(constant, self.given)
        self.text = _text(operations, self.arrays, self.given, self.outputs)
        self.function = objects.loaded(objects.compiled(self.text), NAME)

    def run(self, rt: Runtime, args: Sequence[Value]) -> Value:
        """The kernel's value; its arrays all have the shape of the batch."""
        numbers = {name: _part(args, part) for name, part in self.parts.items()}
        given = self.prelude(rt, *(numbers[name] for name in self.uniform))
        constants = np.array([0.0 if x is None else x for x in given], dtype=float)
        arrays = [numbers[name] for name in self.arrays]
        shape = np.broadcast_shapes(*(a.shape for a in arrays))
        outputs = [np.empty(shape) for _ in self.outputs]
        frame = np.array(_frame(arrays, shape) + [address(a) for a in outputs], dtype=np.int64)
        self.function.call(address(frame), address(constants))
        known = {**numbers, **dict(zip(self.given, given, strict=True)), **dict(zip(self.outputs, outputs, strict=True))}
        return _unpacked(self.result, known)


def _part(args: Sequence[Value], part: Part) -> Any:
    value: Any = args[part.path[0]]
    for item in part.path[1:]:
        value = value[item]
    found = getattr(value, part.kind)
    if part.kind in ("t", "et"):
        found = found[part.direction]
    return 0.0 if found is None else found


def parts_of(value: Value, path: tuple[int, ...]) -> list[tuple[Part, Any]]:
    """The parts of a value that are there."""
    if isinstance(value, Cell):
        found = [(Part(path, "v"), value.v), (Part(path, "e"), value.e)]
        found += [(Part(path, "t", d), x) for d, x in enumerate(value.t)]
        found += [(Part(path, "et", d), x) for d, x in enumerate(value.et)]
        return [(part, x) for part, x in found if x is not None]
    if isinstance(value, tuple):
        return [found for i, item in enumerate(value) for found in parts_of(item, (*path, i))]
    return []


def _unpacked(result: Result, known: dict[str, Any]) -> Value:
    if not isinstance(result, Packed):
        return tuple(_unpacked(item, known) for item in result)

    def part(name: str | None) -> Any:
        return None if name is None else known[name] if name in known else float(name)

    return Cell(part(result.v), part(result.e), tuple(map(part, result.t)), tuple(map(part, result.et)))


def address(array: Any) -> int:
    return array.__array_interface__["data"][0]  # type: ignore[no-any-return]


def _frame(arrays: list[Array], shape: tuple[int, ...]) -> list[int]:
    """Rows of numbers: how many (of two axes), how long, and per array where it starts and the steps of both axes.

    Arrays that don't lie so are copied; they are replaced in the list, so that they live as long as it does.
    """
    rows, inner = shape[:-1], shape[-1]
    whole = [a.shape == shape and a.flags.c_contiguous for a in arrays]
    if all(whole):
        return [1, 1, math.prod(shape), *(x for a in arrays for x in (address(a), 0, 0))]
    outer, middle = (math.prod(rows[:-1]), rows[-1]) if rows else (1, 1)
    found = [outer, middle, inner]
    for i, a in enumerate(arrays):
        steps = np.broadcast_to(a, shape).strides
        front = [s for s, n in zip(steps[:-2], shape[:-2], strict=True) if n > 1]
        fits = (steps[-1] == 8 or inner == 1) and len(front) <= 1
        if not fits:
            a = arrays[i] = np.ascontiguousarray(np.broadcast_to(a, shape))
            steps, front = a.strides, [a.strides[-2]] if len(shape) > 1 else []
            lead = shape[-2] * a.strides[-2] if len(shape) > 1 else 0
        else:
            lead = front[0] if front else 0
        found += [address(a), lead, steps[-2] if len(shape) > 1 else 0]
    return found


def _text(
    operations: Sequence[Operation], arrays: Sequence[str], given: Sequence[str], outputs: Sequence[str]
) -> str:
    """A function of the frame (`_frame`, then where the outputs go) and of the numbers that are the same everywhere."""
    at = Vectors()
    values: dict[str, str] = {}
    masks = {arg for operation in operations for arg in operation.masks}
    for i, name in enumerate(given):
        number = at.constant("%constants", i)
        values[name] = at.apply("ne", number, at.number(0.0)) if name in masks else number
    outer, middle, inner = (at.address("%frame", i) for i in range(3))
    slots = [[at.address("%frame", 3 + 3 * i + j) for j in range(3)] for i in range(len(arrays))]
    ends = [at.address("%frame", 3 + 3 * len(arrays) + i) for i in range(len(outputs))]
    last = at.whole("sub", inner, LANES)
    vectors = at.whole("udiv", at.whole("add", inner, LANES - 1), LANES)
    i, j = at.begin(outer), at.begin(middle)
    row = at.whole("mul", at.whole("add", at.whole("mul", i, middle), j), at.whole("mul", inner, 8))
    starts = [at.whole("add", start, at.whole("add", at.whole("mul", i, a), at.whole("mul", j, b)))
              for start, a, b in slots]  # fmt: skip
    into = [at.whole("add", end, row) for end in ends]
    first = at.whole("mul", at.begin(vectors), LANES)
    k = at.once(f"call i64 @llvm.umin.i64(i64 {first}, i64 {last})", first)  # the last ones of a row are done twice

    def place(start: str) -> str:
        memory = at.once(f"inttoptr i64 {start} to ptr", start)
        return at.at(memory, k, "double")

    for name, start in zip(arrays, starts, strict=True):
        values[name] = at.load(place(start))
    values = at.run(operations, values)
    for name, end in zip(outputs, into, strict=True):
        at.store(values[name], place(end))
    for _ in range(3):
        at.end()
    return at.module(NAME, "ptr %frame, ptr %constants")
