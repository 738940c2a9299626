"""Sobol points by numbers worked out here are scipy's, which come from the whole table of Joe and Kuo."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from potto.integrate.rules.direction_numbers import KNOWN, direction_numbers

BITS, LOG = 30, 7


@pytest.mark.parametrize("dims", [1, 2, 9, KNOWN, KNOWN + 1])
def test_points_are_those_of_scipy(dims: int) -> None:
    columns = direction_numbers(dims, 20, BITS)
    points = np.zeros((1, dims), dtype=np.int64)
    for b in range(LOG):
        points = np.concatenate((points, points ^ columns[:, b]))
    known = qmc.Sobol(dims, scramble=False, bits=BITS).random(2**LOG)
    assert sorted(map(tuple, points * 2.0**-BITS)) == sorted(map(tuple, known))  # scipy counts in Gray code


def test_late_points_too() -> None:
    columns = direction_numbers(KNOWN, 20, BITS)
    for b in range(20):  # number 2^b in the order of numbers, which Gray code has as number 2^(b + 1) - 1
        engine = qmc.Sobol(KNOWN, scramble=False, bits=BITS).fast_forward((2 << b) - 1)
        assert (engine.random(1)[0] == columns[:, b] * 2.0**-BITS).all(), b
