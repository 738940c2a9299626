"""Where a function over the plane is zero, as short straight lines: marching squares.

Owns `zero_lines` and `spread`.
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
_COUNTS = np.array([len(_LINES.get(kind, ())) for kind in range(16)])
_EDGES = np.zeros((16, 2, 2), dtype=int)
for _kind, _lines in _LINES.items():
    _EDGES[_kind, : len(_lines)] = _lines
_ENDS = np.array([(0, 0, 0, 1), (0, 1, 1, 1), (1, 0, 1, 1), (0, 0, 1, 0)])  # of edges: row and column of both


def zero_lines(values: Array, xs: Array, ys: Array) -> Array:
    """The lines along which values (len(ys), len(xs)) at the places of a grid are zero: (n, 2, 2), the ends of each as
    x and y. Between places values are taken to be straight; cells with a corner that has no value have no line."""
    positive = values > 0
    code = (positive[:-1, :-1] * 1 + positive[:-1, 1:] * 2 + positive[1:, 1:] * 4 + positive[1:, :-1] * 8).astype(int)
    corners = np.isfinite(values)
    known = corners[:-1, :-1] & corners[:-1, 1:] & corners[1:, 1:] & corners[1:, :-1]
    cells = np.nonzero(known & (_COUNTS[code] > 0))
    number = _COUNTS[code[cells]]
    row, column = (np.repeat(at, number) for at in cells)
    second = np.concatenate(([False], (row[1:] == row[:-1]) & (column[1:] == column[:-1]))).astype(int)
    edges = _EDGES[code[row, column], second[: len(row)]]
    return _crossings(values, xs, ys, row[:, None], column[:, None], edges)


def _crossings(values: Array, xs: Array, ys: Array, row: Ints, column: Ints, edges: Ints) -> Array:
    """Where the function is zero on edges (n, 2) of cells: (n, 2, 2)."""
    r0, c0, r1, c1 = (row + _ENDS[edges, 0], column + _ENDS[edges, 1], row + _ENDS[edges, 2], column + _ENDS[edges, 3])
    a, b = values[r0, c0], values[r1, c1]
    share = a / np.where(a == b, 1.0, a - b)
    x = xs[c0] + share * (xs[c1] - xs[c0])
    y = ys[r0] + share * (ys[r1] - ys[r0])
    return np.stack((x, y), axis=-1)


def spread(points: Array, apart: float) -> Ints:
    """Which of points (n, 2) along curves to show so that two are hardly ever closer than `apart`: from the leftmost on
    always the nearest of those that are far enough from all before."""
    left, found = np.lexsort(points.T[::-1]), list[int]()
    at = 0
    while len(left):
        found.append(int(left[at]))
        distance = np.linalg.norm(points[left] - points[left[at]], axis=1)
        far = distance >= apart
        far[at] = False
        left, distance = left[far], distance[far]
        at = int(np.argmin(distance)) if len(left) else 0
    return np.array(found, dtype=int)
