"""The table of worlds beside sums that are differentiated: what the sums lack is there, and no more than that."""

from __future__ import annotations

import runpy
from typing import Any

import pytest
from worlds_references import EXAMPLES

BESIDE: dict[str, Any] = runpy.run_path(str(EXAMPLES / "beside.py"))
ROWS = list(BESIDE["rows"]())
SMOOTH = "probability/newsvendor"  # its cost bends at the order and does not jump: there the sum is right


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.world.program)
def test_values_agree_and_slopes_of_sums_lack_the_boundary(row: Any) -> None:
    assert abs(row.sampled - row.value) < 2e-3 * max(1.0, abs(row.value))
    if row.world.program == SMOOTH:
        assert abs(row.sampled_slope - row.slope) < 1e-4
    else:
        assert row.sampled_slope == 0.0 and abs(row.slope) > 0.01


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.world.program)
def test_differences_of_sums_see_it(row: Any) -> None:
    """The sum's values, a tenth apart, change as our derivative says, to what samples can tell."""
    up, down = (row.world.sampled(complex(row.world.place + h)).real for h in (0.05, -0.05))
    assert abs((up - down) / 0.1 - row.slope) < 0.03 * max(1.0, abs(row.slope))
