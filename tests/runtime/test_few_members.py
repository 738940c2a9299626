"""Members of a batch at places where a slope is infinite are what they are alone.

At such a place all that is known of an answer hangs on what is exact before it: 2 - x is 1 at x = 1, and no more is
rounded off in a batch. A direction in which a number does not move leaves out whatever the slope along it is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import potto


@pytest.mark.parametrize("body", ["asin(2 - x)", "hypot(x - 1, 2 - 2*x)", "sqrt(x - 1)", "(2*x - 2)^(1/3)"])
def test_errors_where_a_slope_is_infinite(body: str) -> None:
    f = potto.compile(f"def f(x) {body}").f
    alone, batch = f(1.0), f(np.array([1.0, 1.25, 1.0]))
    for member in (0, 2):
        assert batch.value[member] == alone.value and batch.error[member] == alone.error <= 1e-15
    assert batch.converged and alone.converged


def both(x: Any, y: Any) -> Any:
    f = potto.compile("def f(x, y) sqrt(x) + y^2").f
    return potto.jvp(f, {"x": x, "y": y})


def test_a_tangent_of_0_is_none_in_a_batch_as_well() -> None:
    """sqrt does not move where x does not: (sqrt(x) + y^2)' = 2 y y' there, whatever 1/(2 sqrt(x)) is."""
    found = both(np.array([0.0, 1.0, 1.0]), np.array([1.0, 1.0, 0.0]))(np.array([0.0, 1.0, 0.0]), 2.0)
    assert found.tangent[0] == 4.0 and abs(found.tangent[1] - 4.5) <= found.tangent_error[1] <= 1e-14
    assert found.tangent[2] == math.inf
    d = potto.deriv(potto.compile("def f(x) sqrt(x)").f)
    found = d((np.array([0.0, 1.0, 0.0]), np.array([0.0, 1.0, 1.0])))
    assert found.tangent.tolist() == [0.0, 0.5, math.inf] and found.member_converged.tolist() == [True, True, False]


def test_what_moves_and_stands_still_for_a_moment_is_not_known() -> None:
    """sqrt(x^2) is |x|, and x^2 has the derivative 0 at 0: none of its sides is."""
    found = potto.deriv(potto.compile("def f(x) sqrt(x^2)").f)((np.array([0.0, 1.0]), 1.0))
    assert math.isnan(found.tangent[0]) and found.tangent[1] == 1.0


def test_so_many_members_cost_no_run_of_each() -> None:
    f = potto.compile("def f(x) asin(2 - x)").f
    many = f(np.ones(3000))
    assert np.abs(many.value - math.pi / 2).max() <= 1e-15 and np.isinf(many.error).all()
