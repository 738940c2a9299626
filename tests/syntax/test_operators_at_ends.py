"""A line of a block that ends with an operator goes on with the next one."""

from __future__ import annotations

import pytest

import potto
from potto.syntax import completeness, format_source, live_expressions, parse_chunk, split

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


@pytest.mark.parametrize(
    "program",
    ["a = 3 *\n4\n", "a = 3 *  # why\n\n# and what\n4\n", "a = 3 +\n  1 +\n8\n", "def f(x) x +\n11\na = f(1)\n",
     "a = [1 < 2 and\n3 < 4] * 12\n", "a = 2 > 1 ?\n12 :\n0\n", "a = 24/\n2\nb: Real = 2\n"],
)  # fmt: skip
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_operand_may_stand_in_the_first_column(program: str, end: str) -> None:
    module = potto.compile(program.replace("\n", end))
    assert not any(d.severity == "error" for d in module.diagnostics) and module.a.value == 12
    assert potto.compile(format_source(program)).a.value == 12


def test_what_starts_an_item_or_stands_below_a_block_is_no_operand() -> None:
    for program in (
        "a = 1 +\nb = 2\n",
        "a = 1 +\nb: Real = 2\n",
        "a = 1 +\ndef f(x) x\n",
        "def f(x)\n    x +\n2\n",
        "f: Real ->\n2\n",
        "from m import *\n2\n",
    ):
        assert len(split(program)) == 2


def test_a_live_expression_goes_on_behind_operators_and_within_brackets() -> None:
    text = "def f(t) t\n#> f(1) +\n#>   2\n#= 3\n    #> f(\n    #> 4)\n#> 1\n#> + 1\n"
    found = live_expressions(text)
    assert [" ".join(live.text.split()) for live in found] == ["f(1) + 2", "f( 4)", "1", "+ 1"]
    assert [live.expected for live in found] == ["3", None, None, None]
    for live in found:
        assert text[live.text_span.start : live.text_span.end].replace("#>", "  ") == live.text
