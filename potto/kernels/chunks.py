"""Kernels over many points: by machine code, or by numpy a few thousand at a time.

Owns `at_points`. By numpy, a kernel is a line of numpy an operation, each with an array of its own: where these are
larger than the caches, or so large that the allocator gives them back to the system each time, a point takes several
times as long.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from potto.kernels.cells import Cell, Number, Trace, Value, combined, map_arrays, map_trace
from potto.kernels.memory import kept
from potto.kernels.native.points import Pointwise
from potto.kernels.writing import Runtime
from potto.kernels.written import Kernel

# Points at once: a few arrays of this length fit the second-level cache. A kernel of 60 operations takes 60 to 100 ns a
# point at 4 K to 16 K points, and two to four times as long from 64 K on.
POINTS = 1 << 14


# From how many points on a function of machine code takes less than numpy: a call takes 13 us, each line of a
# kernel 1 us and 0.6 ns a point.
MANY = 1 << 10


def many(args: list[Value]) -> bool:
    """Whether there are so many points that it is worth a thought who does them."""
    for arg in args:  # noqa: SIM110 - runs with every kernel: no generator
        if arg.__class__ is Cell and arg.v.__class__ is np.ndarray and arg.v.size > MANY:
            return True
    return False


def at_points(kernel: Kernel, rt: Runtime, trace: Trace | None, args: list[Value], backend: str) -> Value:
    """The value of a kernel that works point by point: by machine code once that pays, by numpy until then."""
    if backend == "numpy":
        return in_chunks(kernel, rt, trace, args)
    sides = trace or {}  # a plain kernel calls nothing: masks are all that there is
    parts: list[Any] = []  # runs with every kernel: no generators
    for arg in args:
        if arg.__class__ is not Cell:
            return in_chunks(kernel, rt, trace, args)
        parts += (arg.v, arg.e, *arg.t, *arg.et)
    varying = tuple([part.__class__ is np.ndarray for part in parts])
    forced = tuple([(at, side.__class__ is np.ndarray) for at, side in sides.items()])
    found = kernel.native.get((varying, forced))
    if found is None:
        found = kernel.native[varying, forced] = Pointwise(kernel, varying, forced, args)
    function = found.promotion.function(backend, found.text)
    if function is not None:
        return found.run(function, rt, sides, args)
    with found.promotion.by_numpy():
        return in_chunks(kernel, rt, trace, args)


def in_chunks(kernel: Kernel, rt: Runtime, trace: Trace | None, args: list[Value]) -> Value:
    """The value of a kernel that works point by point, by parts of the first axis."""
    kept()
    shape = np.broadcast_shapes(*(a.shape for arg in args if isinstance(arg, Cell) for a in arg.arrays()))
    step = max(1, POINTS * shape[0] // int(np.prod(shape)))
    if step >= shape[0]:
        return kernel.run(rt, trace, *args)
    parts = []
    for start in range(0, shape[0], step):
        part = slice(start, min(start + step, shape[0]))

        def cut(a: Any, part: slice = part) -> Any:
            return a[part] if a.ndim == len(shape) and a.shape[0] == shape[0] else a

        parts.append(kernel.run(rt, map_trace(trace, cut), *(map_arrays(arg, cut) for arg in args)))
    sizes = [min(step, shape[0] - start) for start in range(0, shape[0], step)]

    def whole(*rows: Number) -> Number:
        """Parts that are the same number everywhere stay one."""
        if not any(isinstance(row, np.ndarray) for row in rows) and len(set(rows)) == 1:
            return rows[0]
        return np.concatenate([np.broadcast_to(row, (n, *shape[1:])) for row, n in zip(rows, sizes, strict=True)])

    return combined(whole, *parts)
