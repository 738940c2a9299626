"""Kernels over many points: by machine code, or by numpy a few thousand at a time.

Owns `at_points`. By numpy, a kernel is a line of numpy an operation, each with an array of its own: where these are
larger than the caches, or so large that the allocator gives them back to the system each time, a point takes several
times as long.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import compress
from typing import Any

import numpy as np

from potto.kernels.cells import Array, Cell, Number, Trace, Value, all_arrays, combined, map_arrays, map_trace
from potto.kernels.memory import kept
from potto.kernels.native.points import Pointwise
from potto.kernels.writing import Runtime
from potto.kernels.written import Kernel

# Points at once: a few arrays of this length fit the second-level cache. A kernel of 60 operations takes 60 to 100 ns a
# point at 4 K to 16 K points, and two to four times as long from 64 K on.
POINTS = 1 << 14


# From how many points on a function of machine code takes less than numpy: a call takes 5 us, each line of a
# kernel 0.4 us and 0.6 ns a point.
MANY = 1 << 8
# The same where numpy does it in any case, a few thousand points at a time.
MANY_BY_NUMPY = 1 << 10


def many(args: list[Value], backend: str) -> bool:
    """Whether there are so many points that it is worth a thought who does them."""
    least = MANY_BY_NUMPY if backend == "numpy" else MANY
    for arg in args:  # noqa: SIM110 - runs with every kernel: no generator
        if arg.__class__ is Cell and arg.v.__class__ is np.ndarray and arg.v.size > least:
            return True
    return False


def at_points(kernel: Kernel, rt: Runtime, trace: Trace | None, args: list[Value], backend: str) -> Value:
    """The value of a kernel that works point by point: by machine code once that pays, by numpy until then."""
    parts: list[Any] = []  # runs with every kernel: no generators
    for arg in args:
        if arg.__class__ is not Cell:
            return in_chunks(kernel, rt, trace, args, all_arrays(tuple(args)))
        parts += (arg.v, arg.e, *arg.t, *arg.et)
    varying = tuple([part.__class__ is np.ndarray for part in parts])
    if backend == "numpy":
        return in_chunks(kernel, rt, trace, args, [*compress(parts, varying)])
    sides = trace or {}  # a plain kernel calls nothing: masks are all that there is
    forced = tuple([(at, side.__class__ is np.ndarray) for at, side in sides.items()]) if sides else ()
    found = kernel.native.get((varying, forced))
    if found is None:
        found = kernel.native[varying, forced] = Pointwise(kernel, varying, forced, args)
    function = found.promotion.function(backend, found.text)
    if function is not None:
        return found.run(function, rt, sides, args)
    if found.everywhere is not None:
        return found.everywhere(rt, sides, args)
    with found.promotion.by_numpy():
        return in_chunks(kernel, rt, trace, args, [*compress(parts, varying)])


def in_chunks(kernel: Kernel, rt: Runtime, trace: Trace | None, args: list[Value], arrays: Sequence[Array]) -> Value:
    """The value of a kernel that works point by point, by parts of the first axis. arrays: those among the arguments;
    mostly all have one shape, and numpy takes as long to find that as to run a short kernel."""
    shape = arrays[0].shape
    for array in arrays:
        if array.shape != shape:
            shape = np.broadcast_shapes(*(array.shape for array in arrays))
            break
    size = math.prod(shape)
    if size > POINTS // 2:
        kept()  # not for machine code: the one large array that it fills lies better where the system puts it
    if size <= POINTS:
        return kernel.run(rt, trace, *args)
    step = max(1, POINTS * shape[0] // size)
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
