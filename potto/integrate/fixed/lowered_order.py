"""The rows of a frame in order, for many members, by machine code: what `topologies.in_order` does by numpy.

Owns `sorted_rows`. Each row's rank is how many rows come before it; there are at most a dozen, so that comparing each
with each, for eight members at a time, takes less than sorting.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from potto.kernels.cells import Array
from potto.kernels.native.elementary import module
from potto.kernels.native.points import address
from potto.kernels.native.promotion import Promotion
from potto.kernels.native.vectors import LANES, Vectors

NAME = "in_order"
LEAST = 256  # members, below which a call takes longer than numpy
# Where a row is put that may lie anywhere, being at infinity and as far off: before the upper bound, so that it is seen
# that the order is not sure.
FARTHEST = np.finfo(float).max / 2


def sorted_rows(places: Array, near: Array, backend: str) -> tuple[Array, Array, Array] | None:
    """Rows in order (R, M), how many count (M,), and for whom the order is sure (M,), all as numbers; None where numpy
    is to do it. near: (R, M), from where on a place is as good as another."""
    rows, count = places.shape
    if count < LEAST:
        return None
    function = _promotion(rows).function(backend, lambda: _text(rows))
    if function is None:
        return None
    out = np.empty((rows + 2, count))
    frame = np.array([count, *map(address, places), *map(address, near), *map(address, out)], dtype=np.int64)
    function.call(address(frame), address(frame))
    return out[:rows], out[rows], out[rows + 1]


@lru_cache(maxsize=64)
def _promotion(rows: int) -> Promotion:
    return Promotion(NAME)


def by_numpy(rows: int) -> Promotion:
    """Where the time is counted that numpy takes for it."""
    return _promotion(rows)


def _text(rows: int) -> str:
    """A function of a frame: how many members, and where the rows of places, of what is near, and of results are."""
    at = Vectors()
    last = at.whole("sub", at.address("%frame", 0), LANES)
    vectors = at.whole("udiv", at.whole("add", at.address("%frame", 0), LANES - 1), LANES)
    first = at.whole("mul", at.begin(vectors), LANES)
    k = at.once(f"call i64 @llvm.umin.i64(i64 {first}, i64 {last})", first)  # the last ones are done twice

    def column(number: int) -> str:
        return at.at(at.address("%frame", 1 + number, "ptr"), k, "double")

    places = [at.load(column(row)) for row in range(rows)]
    near = [at.load(column(rows + row)) for row in range(rows)]
    zero, one, infinite, farthest = at.number(0.0), at.number(1.0), at.number(np.inf), at.number(FARTHEST)
    lowest = at.apply("sub", places[0], near[0])
    highest = at.apply("add", places[1], near[1])
    keys, counted = [at.number(-np.inf), at.number(np.finfo(float).max)], at.number(2.0)
    for place, room in zip(places[2:], near[2:], strict=True):
        lying = at.apply("and", at.apply("ge", place, at.apply("sub", lowest, room)),
                         at.apply("le", place, at.apply("add", highest, room)))  # fmt: skip
        near_enough = at.apply("select", at.apply("lt", place, farthest), place, farthest)
        keys.append(at.apply("select", lying, near_enough, infinite))
        counted = at.apply("add", counted, at.apply("select", lying, one, zero))
    ranks = [zero] * rows
    for i in range(rows):
        for j in range(i):
            behind = at.apply("le", keys[j], keys[i])
            ranks[i] = at.apply("add", ranks[i], at.apply("select", behind, one, zero))
            ranks[j] = at.apply("add", ranks[j], at.apply("select", behind, zero, one))
    ordered = []
    for rank in range(rows):
        here = [at.apply("eq", own, at.number(float(rank))) for own in ranks]
        found = (at.number(0.0), places[0], near[0])
        for row in range(1, rows):
            own = (at.number(float(row)), places[row], near[row])
            found = tuple(at.apply("select", here[row], x, y) for x, y in zip(own, found, strict=True))  # type: ignore[assignment]
        ordered.append(found)
        at.store(found[0], column(2 * rows + rank))
    fine = at.apply("lt", at.apply("abs", at.apply("sub", places[1], places[0])), infinite)
    for rank in range(1, rows):
        (_, a, off), (_, b, other) = ordered[rank - 1 : rank + 1]
        apart = at.apply("gt", at.apply("sub", b, a), at.apply("add", off, other))
        beyond = at.apply("le", counted, at.number(float(rank)))
        fine = at.apply("and", fine, at.apply("or", apart, beyond))
    at.store(counted, column(3 * rows))
    at.store(at.apply("select", fine, one, zero), column(3 * rows + 1))
    at.end()
    return module(at, NAME, "ptr %frame, ptr %constants")
