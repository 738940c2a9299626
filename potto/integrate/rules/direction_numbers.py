"""Direction numbers of Sobol points (S. Joe and F. Y. Kuo, Constructing Sobol sequences with better two-dimensional
projections, 2008; their table new-joe-kuo-6).

Owns `direction_numbers`. Those of the first variables are worked out here, of many more taken from scipy, where they
are beside all of its statistics: half a second of imports.
"""

from __future__ import annotations

import numpy as np

from potto.kernels.cells import Ints

# For each variable but the first a primitive polynomial over the field of two elements, by its bits, and the numbers
# that its recurrence starts from.
_STARTS: tuple[tuple[int, tuple[int, ...]], ...] = (
    (3, (1,)), (7, (1, 3)), (11, (1, 3, 1)), (13, (1, 1, 1)), (19, (1, 1, 3, 3)), (25, (1, 3, 5, 13)),
    (37, (1, 1, 5, 5, 17)), (41, (1, 1, 5, 5, 5)), (47, (1, 1, 7, 11, 19)), (55, (1, 1, 5, 1, 1)),
    (59, (1, 1, 1, 3, 11)), (61, (1, 3, 5, 5, 31)), (67, (1, 3, 3, 9, 7, 49)), (91, (1, 1, 1, 15, 21, 21)),
    (97, (1, 3, 1, 13, 27, 49)), (103, (1, 1, 1, 15, 7, 5)), (109, (1, 3, 1, 15, 13, 25)),
    (115, (1, 1, 5, 5, 19, 61)), (131, (1, 3, 7, 11, 23, 15, 103)), (137, (1, 3, 7, 13, 13, 15, 69)),
    (143, (1, 1, 3, 13, 7, 35, 63)), (145, (1, 3, 5, 9, 1, 25, 53)), (157, (1, 3, 1, 13, 9, 35, 107)),
    (167, (1, 3, 1, 5, 27, 61, 31)), (171, (1, 1, 5, 11, 19, 41, 61)), (185, (1, 3, 5, 3, 3, 13, 69)),
    (191, (1, 1, 7, 13, 1, 19, 1)), (193, (1, 3, 7, 5, 13, 19, 59)), (203, (1, 1, 3, 9, 25, 29, 41)),
    (211, (1, 3, 5, 13, 23, 1, 55)), (213, (1, 3, 7, 3, 13, 59, 17)), (229, (1, 3, 1, 3, 5, 53, 69)),
    (239, (1, 1, 5, 5, 23, 33, 13)), (241, (1, 1, 7, 7, 1, 61, 123)), (247, (1, 1, 7, 9, 13, 61, 49)),
    (253, (1, 3, 3, 5, 3, 55, 33)),
)  # fmt: skip
KNOWN = 1 + len(_STARTS)  # variables


def direction_numbers(dims: int, count: int, bits: int) -> Ints:
    """The points with numbers 1, 2, 4, ..., in units of 2^-bits: all others are exclusive ors of them. (dims, count)"""
    if dims > KNOWN:
        return _by_scipy(dims, count, bits)
    numbers = [[1] * count, *(_recurrence(polynomial, start, count) for polynomial, start in _STARTS[: dims - 1])]
    return np.array([[m << bits - k for k, m in enumerate(row, 1)] for row in numbers], dtype=np.int64)


def _recurrence(polynomial: int, start: tuple[int, ...], count: int) -> list[int]:
    """m_k, of which 2^-k m_k are the points: 2^d m_(k-d) and m_(k-d), and 2^i m_(k-i) for each coefficient i, added
    without carrying."""
    degree, m = len(start), list(start[:count])
    for k in range(len(m), count):
        new = m[k - degree]
        for i in range(1, degree + 1):
            if polynomial >> degree - i & 1:
                new ^= m[k - i] << i
        m.append(new)
    return m


def _by_scipy(dims: int, count: int, bits: int) -> Ints:
    from scipy.stats import qmc

    engine = qmc.Sobol(dims, scramble=False, bits=bits)
    columns = np.zeros((dims, count), dtype=np.int64)
    for b in range(count):  # scipy counts in Gray code, where number 2^b comes as the (2^(b + 1) - 1)st
        engine.fast_forward((2 << b) - 1 - engine.num_generated)
        columns[:, b] = np.rint(engine.random(1)[0] * 2.0**bits).astype(np.int64)
    return columns
