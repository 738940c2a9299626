"""Long definitions are laid out in time proportional to their length. Held by counting calls, not by the clock."""

from __future__ import annotations

import pytest
from call_counts import calls_in

from potto.syntax import format_source

SHAPES = {
    "a sum on one line": lambda n: "f = " + "+".join(f"a{i % 7}" for i in range(n)),
    "a sum over many lines": lambda n: "def f(a)\n    a\n" + "".join(f"    +a*{i}\n" for i in range(n)),
    "alternating lines": lambda n: "def f(a)\n    a\n" + "".join(("    + a\n", "    +a\n")[i % 2] for i in range(n)),
    "differences of quotients": lambda n: "f = " + " - ".join("a/b" for _ in range(n)),
    "a product": lambda n: "f = " + "*".join("a" for _ in range(n)),
    "and": lambda n: "f = \\(a) . if " + " and ".join("a<1" for _ in range(n)) + " then 1 else 0",
    "or on lines": lambda n: "def f(a)\n    if a<0\n" + "".join("    or a<1\n" for _ in range(n)) + "    then 1 else 2",
    "comparisons": lambda n: "f = " + "<".join("a" for _ in range(n)),
    "calls": lambda n: "f = " + "+".join("g(a,b)*2" for _ in range(n)),
    "integrals": lambda n: "f = " + "+".join("integral [0,1] x d(x)" for _ in range(n // 4)),
    "sums": lambda n: "f = " + "+".join("sum i in 1..3 (i)" for _ in range(n // 4)),
    "a list": lambda n: "f = [" + ",".join("1" for _ in range(n)) + "]",
    "arguments": lambda n: "f = g(" + ",".join("a" for _ in range(n)) + ")",
    "local names": lambda n: "def f(a)\n" + "".join(f"    b{i}=a+{i}\n" for i in range(n)) + "    a",
    "comments": lambda n: "def f(a)\n" + "".join(f"    # c\n    b{i}=a # d\n" for i in range(n)) + "    a",
}  # fmt: skip


def calls(text: str) -> int:
    """How many functions are called while a text is laid out."""
    return calls_in(lambda: format_source(text))


@pytest.mark.parametrize("shape", SHAPES)
def test_four_times_the_terms_take_four_times_the_calls(shape: str) -> None:
    text = SHAPES[shape]
    format_source(text(8))  # loads what is loaded once
    assert calls(text(1600)) <= 4.1 * calls(text(400)) + 100


@pytest.mark.parametrize("shape", SHAPES)
def test_nothing_but_blanks_changes_and_no_line_stays_too_long(shape: str) -> None:
    text = SHAPES[shape](600)
    found = format_source(text)
    assert found.split() != text.split() and "".join(found.split()) == "".join(text.split())
    assert max(map(len, found.splitlines())) <= 100
    assert format_source(found) == found


@pytest.mark.parametrize("written", ["a{i}\n    + ", "a * {i} - "])
def test_twenty_thousand_terms(written: str) -> None:
    terms = "".join(written.format(i=i % 10) for i in range(20_000))
    found = format_source(f"def f(a)\n    {terms}a\n")
    assert "".join(found.split()) == "".join(f"def f(a){terms}a".split())
    assert max(map(len, found.splitlines())) <= 100
    assert format_source(found) == found


def test_a_line_goes_where_the_bracket_was_opened_that_holds_it() -> None:
    """The line of the opening bracket is itself broken: what follows is indented by its new line, at once."""
    before = "x = " + " + ".join(["value"] * 11) + " + function(one, two, another(three, four),\nfive)\n"
    found = format_source(before)
    assert found == (
        "x = " + " + ".join(["value"] * 11) + "\n    + function(one, two, another(three, four),\n        five)\n"
    )
    assert format_source(found) == found
