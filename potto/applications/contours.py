"""Where a function over the plane is zero, as short straight lines: marching squares.

Owns `zero_lines`.
"""

from __future__ import annotations

import numpy as np

from potto.kernels.cells import Array, Ints

# The edges of a cell are 0 below, 1 right, 2 above, 3 left. By which of its corners (1: left below, 2: right below,
# 4: right above, 8: left above) the function is positive at, a line goes from edge to edge; two of them at saddles.
_LINES = {
    1: ((3, 0),), 2: ((0, 1),), 3: ((3, 1),), 4: ((1, 2),), 5: ((3, 0), (1, 2)), 6: ((0, 2),), 7: ((3, 2),),
    8: ((2, 3),), 9: ((2, 0),), 10: ((0, 1), (2, 3)), 11: ((2, 1),), 12: ((1, 3),), 13: ((1, 0),), 14: ((0, 3),),
}  # fmt: skip


def zero_lines(values: Array, xs: Array, ys: Array) -> Array:
    """The lines along which values (len(ys), len(xs)) at the places of a grid are zero: (n, 2, 2), the ends of each as
    x and y. Between places values are taken to be straight; cells with a corner that has no value have no line."""
    positive = values > 0
    code = (positive[:-1, :-1] * 1 + positive[:-1, 1:] * 2 + positive[1:, 1:] * 4 + positive[1:, :-1] * 8).astype(int)
    corners = np.isfinite(values)
    known = corners[:-1, :-1] & corners[:-1, 1:] & corners[1:, 1:] & corners[1:, :-1]
    found = []
    for kind, lines in _LINES.items():
        row, column = np.nonzero(known & (code == kind))
        for first, last in lines:
            ends = [_crossing(values, xs, ys, row, column, edge) for edge in (first, last)]
            found.append(np.stack(ends, axis=1))
    return np.concatenate(found)


def _crossing(values: Array, xs: Array, ys: Array, row: Ints, column: Ints, edge: int) -> Array:
    """Where the function is zero on an edge of cells: (n, 2)."""
    (r0, c0), (r1, c1) = {0: ((0, 0), (0, 1)), 1: ((0, 1), (1, 1)), 2: ((1, 0), (1, 1)), 3: ((0, 0), (1, 0))}[edge]
    a, b = values[row + r0, column + c0], values[row + r1, column + c1]
    share = a / np.where(a == b, 1.0, a - b)
    x = xs[column + c0] + share * (xs[column + c1] - xs[column + c0])
    y = ys[row + r0] + share * (ys[row + r1] - ys[row + r0])
    return np.stack((x, y), axis=-1)
