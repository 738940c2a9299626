"""A plain kernel as machine code over the points of a batch.

Owns `Pointwise`: made for a kernel, for which parts of its arguments are arrays, and for which sides a trace forces.
What depends on none of these is computed by the kernel's own lines first; the arrays, which broadcast against each
other, are gone through as rows of numbers that lie side by side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from ctypes import addressof, c_char
from struct import pack
from typing import Any

import numpy as np

from potto.kernels.cells import Array, Cell, Trace, Value
from potto.kernels.making import counts
from potto.kernels.native.elementary import module
from potto.kernels.native.objects import Loaded
from potto.kernels.native.operations import NotStraight, Operation
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.straight import (
    SIDE,
    ArgumentPart,
    Packed,
    Result,
    StraightKernel,
    needed,
    packed,
    read,
)
from potto.kernels.native.vectors import LANES, Vectors
from potto.kernels.writing import Runtime
from potto.kernels.written import Kernel

NAME = "points"
Parts = tuple[bool, ...]  # of all parts of all arguments, which are arrays
Sides = tuple[tuple[int, bool], ...]  # the sites whose sides are forced, and whether not everywhere to the same


class Pointwise:
    """A kernel for arguments some parts of which are arrays, with some sides forced."""

    def __init__(self, kernel: Kernel, varying: Parts, forced: Sides, args: Sequence[Value]) -> None:
        self.kernel, self.forced = kernel, forced
        every = [part for i, arg in enumerate(args) for part in _parts(i, arg)]
        found = {part for part, varies in zip(every, varying, strict=True) if varies}
        self.varying = found.union(ArgumentPart((at,), SIDE) for at, varies in forced if varies)
        self.promotion = Promotion(NAME, _least_lines(kernel, forced))
        self.around: Callable[..., Value] | None = None
        self.everywhere: Callable[..., Value] | None = None  # the value, of (rt, trace, args), where it is one number

    def text(self) -> str:
        """The function. Raises NotStraight."""
        straight = StraightKernel.of(self.kernel, (at for at, _ in self.forced))
        constant = straight.constant(name for name, part in straight.parts.items() if part not in self.varying)
        operations = straight.operations(constant)
        names = tuple(dict.fromkeys(name for cell in packed(straight.result) for name in cell.parts()))
        made = {operation.name: operation.is_mask for operation in operations}
        if any(made.get(name) for name in names):
            raise NotStraight("a condition as a result")
        operations = needed(operations, names)
        wanted = read(operations, names)
        given = tuple(name for name in wanted if name in constant)
        arrays = tuple(name for name in wanted if name not in constant)
        outputs = tuple(name for name in names if name in made)
        if not arrays:
            if not outputs:  # all that varies decides sides that are forced
                result = _unpacked(straight.result, dict.fromkeys(given))
                self.everywhere = straight.function(constant, given, "rt, sides, args", [f"return {result}"], SCOPE)
            raise NotStraight("the same at all points")
        self.around = straight.function(
            constant, (*given, *arrays), "rt, sides, args, call",
            _around(given, arrays, outputs, _unpacked(straight.result, {**dict.fromkeys((*given, *arrays)), **{
                name: f"outputs[{at}]" for at, name in enumerate(outputs)
            }})), SCOPE,
        )  # fmt: skip
        return _text(operations, arrays, given, outputs)

    def run(self, function: Loaded, rt: Runtime, trace: Trace, args: Sequence[Value]) -> Value:
        """The kernel's value; its arrays all have the shape of the batch."""
        assert self.around is not None
        sides = {at: _side(side) for at, side in trace.items()} if trace else trace
        return self.around(rt, sides, args, function.call)


def _around(given: Sequence[str], arrays: Sequence[str], outputs: Sequence[str], result: str) -> list[str]:
    """The lines around the function of machine code (`_text`), from arguments to the value: mostly all arrays are rows
    of numbers without gaps. What is told to the function are bytes, which take less time than arrays."""
    first, *others = arrays
    flat = " and ".join(f"{name}.flags.c_contiguous" for name in arrays)
    alike = "".join(f" == {name}.shape" for name in others)
    where = ", ".join(f"address({name}), 0, 0" for name in arrays)
    into = "".join(f", at + {8 * place}*size" for place in range(len(outputs)))
    length, count = 3 + 3 * len(arrays) + len(outputs), len(given)
    numbers = "".join(f", 0.0 if {name} is None else {name}" for name in given)
    return [
        f"shape, kept = {first}.shape, ()",
        f"if {f'shape{alike} and ' if others else ''}{flat}: size = {first}.size; where = 1, 1, size, {where}",
        f"else: kept = [{', '.join(arrays)}]; shape, where = frame(kept); size = prod(shape)",
        f"outputs = empty(({len(outputs)}, *shape)); at = address(outputs)",
        f"call(pack('{length}q', *where{into}), pack('{count}d'{numbers}))",
        "counts.native_points += size",
        f"return {result}",
    ]


def _least_lines(kernel: Kernel, forced: Sides) -> int:
    """How many lines the function has at the least: a kernel's line becomes 2.1 to 3.5. Where sides are forced much of
    the kernel may not be needed: it has become 0.6 of its lines."""
    lines = kernel.text.count("\n")
    return lines // 2 if forced else 2 * lines


def _side(side: Any) -> Any:
    return side.astype(float) if isinstance(side, np.ndarray) else bool(side)


def _parts(number: int, value: Value) -> list[ArgumentPart]:
    """All parts of an argument that is a number."""
    assert isinstance(value, Cell)
    rows = [("t", value.t), ("et", value.et)]
    return [ArgumentPart((number,), "v"), ArgumentPart((number,), "e")] + [
        ArgumentPart((number,), kind, d) for kind, row in rows for d in range(len(row))
    ]


def _unpacked(result: Result, known: Mapping[str, str | None]) -> str:
    """How a result is put together of names, some of which stand for such a text."""
    if not isinstance(result, Packed):
        return f"({''.join(f'{_unpacked(item, known)}, ' for item in result)})"

    def part(name: str | None) -> str:
        if name is None or name in known:
            return "None" if name is None else known[name] or name
        return repr(float(name)) if math.isfinite(float(name)) else f"float({name!r})"

    t, et = ("".join(f"{part(name)}, " for name in names) for names in (result.t, result.et))
    return f"Cell({part(result.v)}, {part(result.e)}, ({t}), ({et}))"


def address(numbers: Any) -> int:
    """Where the numbers of an array of numpy lie. (numpy tells it in five times the time, of any array.)"""
    try:
        return addressof(c_char.from_buffer(numbers))
    except (TypeError, ValueError):  # it is empty, has gaps, or is not to be written to
        return numbers.__array_interface__["data"][0]  # type: ignore[no-any-return]


def _frame(arrays: list[Array]) -> tuple[tuple[int, ...], list[int]]:
    """The shape that arrays have together, and rows of numbers: how many (of two axes), how long, and per array where
    it starts and the steps of both axes.

    Arrays that don't lie so are copied; they are replaced in the list, so that they live as long as it does.
    """
    shape = arrays[0].shape
    if not _flat(arrays, shape):
        shape = np.broadcast_shapes(*(a.shape for a in arrays))
        inner = shape[-1]
        middle = shape[-2] if len(shape) > 1 else 1
        found = [math.prod(shape[:-2]), middle, inner]
        for i, a in enumerate(arrays):
            steps = np.broadcast_to(a, shape).strides
            front = [step for step, n in zip(steps[:-2], shape[:-2], strict=False) if n > 1]
            if inner < LANES or steps[-1] != a.itemsize or len(front) > 1:
                a = arrays[i] = np.ascontiguousarray(np.broadcast_to(a, shape))
                steps = a.strides
                front = [steps[-2] * middle] if len(shape) > 1 else []
            found += [address(a), front[0] if front else 0, steps[-2] if len(shape) > 1 else 0]
        if not _flat(arrays, shape):
            return shape, found
    found = [1, 1, math.prod(shape)]
    for a in arrays:
        found += (address(a), 0, 0)
    return shape, found


def _flat(arrays: list[Array], shape: tuple[int, ...]) -> bool:
    """Whether all arrays are rows of numbers without gaps."""
    for a in arrays:  # noqa: SIM110 - runs with every kernel: no generator
        if a.shape != shape or not a.flags.c_contiguous:
            return False
    return True


SCOPE = {"Cell": Cell, "address": address, "frame": _frame, "prod": math.prod, "empty": np.empty, "pack": pack,
         "counts": counts}  # fmt: skip


def _text(operations: Sequence[Operation], arrays: Sequence[str], given: Sequence[str], outputs: Sequence[str]) -> str:
    """A function of the frame (`_frame`, then where the outputs go) and of the numbers that are the same everywhere."""
    at = Vectors()
    values: dict[str, str] = {}
    masks = {arg for operation in operations for arg in operation.masks}
    for slot, name in enumerate(given):
        number = at.constant("%constants", slot)
        values[name] = at.apply("ne", number, at.number(0.0)) if name in masks else number
    outer, middle, inner = (at.address("%frame", slot) for slot in range(3))
    slots = [[at.address("%frame", 3 + 3 * number + j) for j in range(3)] for number in range(len(arrays))]
    ends = [at.address("%frame", 3 + 3 * len(arrays) + number) for number in range(len(outputs))]
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
        number = at.load(place(start))
        values[name] = at.apply("ne", number, at.number(0.0)) if name in masks else number
    values = at.run(operations, values)
    for name, end in zip(outputs, into, strict=True):
        at.store(values[name], place(end))
    for _ in range(3):
        at.end()
    return module(at, NAME, "ptr %frame, ptr %constants")
