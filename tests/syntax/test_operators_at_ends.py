"""A line of a block that ends with an operator goes on with the next one."""

from __future__ import annotations

import pytest

import potto
from potto.syntax import completeness, format_source, parse_chunk

# Each gives 8 for `f(3)`
PROGRAMS = [
    "def f(t)\n    t +\n    5\n",
    "def f(t)\n    t*\n    2 -\n    -2\n",
    "def f(t)\n    s = t +\n    1\n    s*2\n",
    "def f(t)\n    s = t +  # why\n    # and what\n\n    1\n    s*2\n",
    "def f(t)\n    if t > 2 and\n    t < 4 then 8 else 0\n",
    "def f(t)\n    (t > 2) ?\n    8 :\n    0\n",
    "def f(t)\n    integral [0, t]\n        1 +\n        x*10/9 d(x)\n",
    "def f(t)\n    2^\n    t\n",
]


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_operand_may_stand_on_the_next_line(program: str, end: str) -> None:
    module = potto.compile((program + "g = f(3)\n").replace("\n", end))
    assert module.diagnostics == () and module.g.value == pytest.approx(8, rel=1e-12)


@pytest.mark.parametrize("program", PROGRAMS)
def test_formatting_keeps_it_and_indents_what_goes_on(program: str) -> None:
    once = format_source(program + "g = f(3)\n")
    assert potto.compile(once).g.value == pytest.approx(8, rel=1e-12)
    assert format_source(once) == once


def test_what_goes_on_is_indented() -> None:
    assert format_source("def f(t)\n    t +\n    5\n") == "def f(t)\n    t +\n        5\n"


@pytest.mark.parametrize(
    "program",
    [
        "def f(t)\n    s = t +\n    r = 1\n    s + r\n",  # a binding is no operand: the mistake is in its own line
        "f = 1 +\ng = 2\n",
    ],
)
def test_a_binding_does_not_go_on(program: str) -> None:
    (said,) = (d for chunk in program.split("\ng") for d in parse_chunk(chunk).diagnostics if "`+`" in d.message)
    assert said.message == "expected an expression after `+`"
    assert program[said.span.start] == "+" or program[said.span.start - 1] == "+"


def test_a_prompt_waits_for_the_operand() -> None:
    assert completeness("1 +") == completeness("def f(t)\n    t*") == "incomplete"
    assert completeness("def f(t)\n    t*\n    2") == "complete"
