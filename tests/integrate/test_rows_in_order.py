"""Cuts of many members put in order by machine code are those that numpy puts in order.

Both compare and subtract the same doubles, so that they agree to the last bit; places repeat, lie on bounds, or are no
numbers (roots that are not there). Where one may be anywhere nothing is sure.
"""

from __future__ import annotations

import numpy as np
import pytest

from potto.integrate.fixed.topologies import in_order

pytest.importorskip("llvmlite")


@pytest.mark.parametrize("rows", [2, 3, 5, 9, 13])
def test_rows_are_in_the_same_order_by_machine_code(rows: int) -> None:
    random = np.random.default_rng(rows)
    places = random.integers(-6, 7, (rows, 5_000)) / 4 + random.choice([0.0, 1e-15, 1e-3], (rows, 5_000))
    places[:2].sort(axis=0)
    places[2:][random.random((rows - 2, 5_000)) < 0.2] = np.nan
    places[1][random.random(5_000) < 0.01] = np.inf
    off = np.abs(places) * 1e-16
    off[np.isnan(off)] = 0.0
    anywhere = random.random((rows - 2, 5_000)) < 0.05  # at infinity, and as far off
    places[2:][anywhere], off[2:][anywhere] = random.choice([-np.inf, np.inf], anywhere.sum()), np.inf
    order, count, fine = in_order(places, off, "numpy")
    others = in_order(places, off, "native")
    assert (others[1] == count).all() and (others[2] == fine).all()
    for member in range(5_000):  # what lies beyond the bounds may be in any order
        assert (others[0][: count[member], member] == order[: count[member], member]).all()
    assert 0 < fine.sum() < fine.size and not fine[anywhere.any(axis=0)].any()
