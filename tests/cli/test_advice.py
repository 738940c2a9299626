"""The hint beside an inaccurate answer is about its own reason."""

from __future__ import annotations

import pytest
from command_runs import Potto


@pytest.mark.parametrize(
    ("program", "expression", "says", "not_"),
    [
        ("def f(t) integral [0, 1] t/x d(x)", "f(1)", "of no use to an integral that diverges", "max"),
        ("def f(t) integral [0, inf] (1 + t*x) d(x)", "f(1)", "a tail that falls too slowly", "max"),
        ("def f(t) integral [0, 1] [x < t]/sqrt(x) d(x)", "deriv(f)((0, 1))", "ask at parameters beside these", "max"),
        ("def f(t) integral [0, 1] sin(1e5*t*x) d(x)", "f(3)", "allow more evaluations (`--max-evals`)", "of no use"),
    ],
)
def test_the_hint_suits_the_reason(potto: Potto, program: str, expression: str, says: str, not_: str) -> None:
    ran = potto("eval", "main.po", expression, "--max-evals", "2000", main=program + "\n")
    assert ran.status == 0 and "warning[P0501]" in ran.err
    assert says in ran.err and f"--{not_}" not in ran.err and (not_ == "max" or not_ not in ran.err)
