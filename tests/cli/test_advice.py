"""The hint beside an inaccurate answer is about its own reason."""

from __future__ import annotations

import re

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


def test_sampling_that_missed_says_what_to_do_and_that_helps(potto: Potto) -> None:
    program = "def f(t) integral [0, 1] [x < t] d(x)\n"
    asked = ("eval", "main.po", "f(0.25)", "--method", "mc", "--rtol", "1e-2")
    short = potto(*asked, "--samples", "100000", main=program)
    assert short.status == 0 and short.out.startswith("not converged: ")
    proposed = re.search(r"sample more \(`--samples`\) or ask for less accuracy \(`--rtol (.*)`\)", short.err)
    assert proposed is not None
    for more in (("--samples", "4000000"), ("--rtol", proposed[1], "--samples", "100000")):
        ran = potto(*asked, *more, main=program)
        assert ran.status == 0 and "not converged" not in ran.out and not ran.err


@pytest.mark.parametrize("method", ["quadrature", "mc"])
def test_a_condition_without_a_value_is_told_with_its_place(potto: Potto, method: str) -> None:
    program = "def f(a) integral [-3, 3] [sqrt(1 + x) < a] d(x)\n"
    ran = potto("eval", "--method", method, "main.po", "f(2)", main=program)
    assert ran.status == 0 and ran.out.startswith("nan")
    assert "warning[P0524]: this is not a number: a condition has no value at x = -" in ran.err
    assert "sign of a - sqrt(x + 1)" in ran.err and "guard the condition" in ran.err
