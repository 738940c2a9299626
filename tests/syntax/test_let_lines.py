"""`let s = e in` with its result on the next line, indented or not."""

from __future__ import annotations

import pytest

import potto
from potto.evaluating.world import World
from potto.syntax import completeness, format_source, parse_chunk
from potto.syntax.chunks import split

# Each gives 8 for `f(3)`
PROGRAMS = [
    "def f(t)\n    let s = t + 1 in\n    s*2\n",
    "def f(t)\n    let s = t + 1 in\n        s*2\n",
    "def f(t)\n    let s = t + 1\n    in\n    s*2\n",
    "def f(t)\n    let s = t + 1\n    in s*2\n",
    "def f(t)\n    let s = t in\n    let r = s + 1 in\n    r*2\n",
    "def f(t)\n    let s = t; r = s + 1 in\n    r*2\n",
    "def f(t)\n    let\n        s = t\n        r = s + 1\n    in\n    r*2\n",
    "def f(t)\n    let s = t + 1 in  # why\n    # and what\n\n    s*2\n",
    "def f(t)\n    let (a, b) = (t, 1) in\n    (a + b)*2\n",
    "def f(t)\n    u = let s = t in\n    s + 1\n    u*2\n",
    "def f(t)\n    u = 2\n    let s = t + 1 in\n    s*u\n",
    "def f(t)\n    let s = t + 1 in\n    if s > 3 then s*2 else 0\n",
    "def f(t)\n    let s = t + 1 in\n    -s*(-2)\n",
    "def f(t)\n    let s = t + 1 in\n    integral [0, s] 2 d(_x)\n",
    "def f(t)\n    let s = t + 1 in\n    sum i in 1..2 (s)\n",
    "def f(t) (\nlet s = t + 1 in\ns*2\n)\n",
    "def f(t) let s = t + 1 in\n    s*2\n",
    "f = \\t .\n    let s = t + 1 in\n    s*2\n",
    "f = \\t . let s = t + 1 in\ns*2\n",
    "f = \\t . let s = t + 1 in  # a word on it\n# and more\n\ns*2\n",
    "f = \\t .\n  let s = t in\n  let r = s + 1 in\nr*2\n",
    "def f(t)\n\tlet s = t + 1 in\n\ts*2\n",
]


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_the_result_may_stand_on_the_next_line(program: str, end: str) -> None:
    text = (program + "g = f(3)\n").replace("\n", end)
    module = potto.compile(text)
    assert module.diagnostics == () and module.g.value == 8


@pytest.mark.parametrize("program", PROGRAMS)
def test_formatting_keeps_it(program: str) -> None:
    once = format_source(program + "g = f(3)\n")
    assert potto.compile(once).g.value == 8
    assert format_source(once) == once
    assert [line.strip() for line in once.splitlines() if "#" in line and line.strip().startswith("#")] == [
        line.strip() for line in program.splitlines() if line.strip().startswith("#")
    ]


def test_the_results_of_several_stand_below_each_other() -> None:
    text = "def f(t)\n    let s = t in\n    let r = s + 1 in\n    r*2\n"
    assert format_source(text) == text.replace("r*2", "r * 2")
    assert format_source("f = \\t . let s = t + 1 in\ns\n") == "f = \\t . let s = t + 1 in\n    s\n"


def test_a_result_in_the_first_column_belongs_to_its_chunk() -> None:
    text = "a = let x = 1 in\nx + 1\nlet y = 2 in\n# of both\ny\nz = 3\n"
    chunks = [chunk.text for chunk in split(text)]
    assert chunks == ["a = let x = 1 in\nx + 1", "let y = 2 in\n# of both\ny", "z = 3"]
    assert all(not parse_chunk(chunk).diagnostics for chunk in chunks)


@pytest.mark.parametrize(
    "text",
    [
        "let x = 1 in\ny = 2\n",
        "let x = 1 in\ndef f(t) t\n",
        "let x = 1 in\nfrom m import f\n",
        "let x = 1 in\nfor v in [1]:\n    print(v)\n",
        "a = begin\nx + 1\n",  # no word of ours ends the line
        "a = b.in\nx\n",
    ],
)
def test_what_begins_something_of_its_own_is_no_result(text: str) -> None:
    assert len(split(text)) == 2


@pytest.mark.parametrize(
    "text",
    [
        "def f(t)\n    let s = t in\n    u = 2\n    u\n",  # a binding is no result
        "def f(t)\n    let s = t in\n",
        "def f(t)\n        let s = t in\n    s\n",
        "let s = 1 in\ny = 2\n",
    ],
)
def test_where_there_is_none_the_message_says_where_it_goes(text: str) -> None:
    world = World(["."])
    world.put("/p.po", text)
    said = [located.diagnostic for located in world.diagnostics("/p.po") if located.diagnostic.code == "P0101"]
    assert said and said[0].message == "expected an expression after `in`"
    assert "on its line or on the next" in said[0].help and "needs no `let`" in said[0].help


def test_a_prompt_waits_for_it() -> None:
    assert completeness("let x = 1 in") == "incomplete"
    assert completeness("let x = 1 in\nx + 1") == "complete"
    assert completeness("def f(t)\n    let s = t in") == "incomplete"
    assert completeness("def f(t)\n    let s = t in\n    s") == "complete"


def test_typing_it_line_by_line_gives_what_all_at_once_gives() -> None:
    whole = PROGRAMS[4] + "g = f(3)\n"
    world = World(["."])
    for end in range(0, len(whole) + 1, 3):
        world.put("/typed.po", whole[:end])
        said = [located.diagnostic for located in world.diagnostics("/typed.po")]
        fresh = World(["."])
        fresh.put("/typed.po", whole[:end])
        assert said == [located.diagnostic for located in fresh.diagnostics("/typed.po")]
    world.put("/typed.po", whole)
    assert world.diagnostics("/typed.po") == ()
