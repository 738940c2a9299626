"""Conditions at the steps of loops over arrays: checked as those under sums are, also where calls lead to them."""

from __future__ import annotations

import textwrap

import pytest

from potto.calculus.checking.diffeo import check_conditions
from potto.modules import names
from potto.query import Database

FILE = "<text>"
LOOPS = {
    "a sum": "sum i in 0..n-1 ({})",
    "a sum over elements": "sum p in xs ({})",
    "a fold": "fold s = 0 for i in 0..n-1 (s + ({}))",
    "the start of a fold": "fold s = ({}) for i in 0..n-1 (2*s)",
    "an array": "[{} for i in 0..n-1][0]",
    "a list": "[{}, x][0]",
    "a product": "product i in 0..n-1 (1 + ({}))",
    "a largest": "max i in 0..n-1 ({})",
}


def codes(text: str) -> list[str]:
    db = Database()
    db.set_input(("overlay", FILE), textwrap.dedent(text).strip("\n") + "\n")
    return [d.code for name in names(db, FILE) for d in check_conditions(db, FILE, name)]


def integral(loop: str, body: str) -> str:
    return f"""
        def at(x, y, t) if diffeo(x + y + t, 2*x + 2*y) then 1 else 0
        def f(xs: [n] Real, t)
            integral ([0, 1], [0, 1]) ({LOOPS[loop].format(body)}) d(x, y)
    """


@pytest.mark.parametrize("loop", LOOPS)
def test_a_condition_that_cannot_be_inverted(loop):
    assert "P0401" in codes(integral(loop, "if diffeo(x + y + t, 2*x + 2*y) then 1 else 0"))


@pytest.mark.parametrize("loop", LOOPS)
def test_a_condition_that_a_call_leads_to(loop):
    assert "P0401" in codes(integral(loop, "at(x, y, t*xs[0])"))


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize("condition", ["[x + y < t]", "[x < t*xs[0]]", "[x*y < xs[1] + t]", "[x < len(xs)*y]"])
def test_what_can_be_is_passed_in_silence(loop, condition):
    assert codes(integral(loop, condition)) == []


def test_a_condition_on_the_state_passes():
    assert codes(integral("a fold", "[s + x < t]")) == []
    assert codes(integral("a fold", "[s < t]")) == []


def test_a_callee_that_loops_itself():
    text = """
        def every(x, y, ps: [n] Real)
            fold s = 0 for i in 0..n-1 (s + [x + y < ps[i]])
        def f(xs: [n] Real)
            integral ([0, 1], [0, 1]) every(x, y, xs) d(x, y)
        def singular(x, y, ps: [n] Real)
            [(if diffeo(x - y + ps[i], y - x) then 1 else 0) for i in 0..n-1][0]
        def g(xs: [n] Real)
            integral ([0, 1], [0, 1]) singular(x, y, xs) d(x, y)
    """
    assert codes(text) == ["P0401"]


STEPS = "[(fold s = x for i in 0..n-1 (if [s < t] then {} else s - xs[i])) < 1]"


def test_brackets_at_the_steps_of_a_condition():
    """They are told apart once the loop is written out, where each case can be searched for."""
    assert codes(integral("a sum", STEPS.format("s + xs[i]"))) == ["P0616"]
    assert codes(integral("a sum", STEPS.format("s + (integral [0, 1] exp(-x*z^2) d(z))"))) == ["P0402"]
