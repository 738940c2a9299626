"""What is said on screens of any width: prose broken between words, nothing wider than the screen."""

from __future__ import annotations

import os
import re

import pytest
from potto_repl.banner import greeting
from potto_repl.paint import Screen, painted
from potto_repl.registry import COMMANDS
from potto_repl.terminal import Terminal

from potto.reports.excerpt import width
from potto.reports.render import broken

RULE = "def g(t) integral [0, 1] (if x < t then 1 else 0) d(x)"


def lines(reply, columns, **look):
    shown = "\n".join(painted(part, Screen(width=columns, breaks=True, **look)) for part in reply.parts)
    return shown.split("\n")


@pytest.mark.parametrize("columns", [30, 40, 60, 80, 100])
def test_help_fits_and_breaks_between_words(talk, columns):
    talk.session.width = lambda: columns
    shown = lines(talk(":help"), columns)
    longest = max(len(word) for line in shown for word in line.split())
    assert all(width(line) <= max(columns, longest + 6) for line in shown)
    words = " ".join(shown).split()
    for entry in COMMANDS.values():
        assert " ".join(entry.summary.split()) in " ".join(words), entry.name
    for name in COMMANDS:
        told = lines(talk(f":help {name}"), columns)
        assert " ".join(" ".join(told).split()).startswith(COMMANDS[name].usage)
        assert all(width(line) <= columns or " " not in line.strip() for line in told)


def test_types_and_times_break_between_words(talk):
    talk("def f(c: Real, shader: (Real*, Real*) -> Real -> Real) integral [0, 1] shader(x, x)(c) d(x)")
    for text in (":type f", ":timeit 1 + 1", "def g(c: Real, shader: (Real*, Real*) -> Real -> Real) shader(c, c)(c)"):
        reply = talk(text)
        shown = lines(reply, 40)
        assert all(width(line) <= 40 for line in shown)
        assert " ".join(" ".join(shown).split()) == reply.text


@pytest.mark.parametrize("columns", [20, 44, 80])
def test_the_greeting_breaks_between_words(columns, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    shown = greeting().split("\n")
    assert all(len(line) <= columns for line in shown) and " ".join(shown).endswith("can be done, Ctrl-D leaves")


@pytest.mark.parametrize("columns", [20, 30, 40, 60, 80])
def test_messages_fit(talk, columns):
    for text in (
        RULE,
        "x + 1",
        "def f(" + "very_long_name, " * 9 + "t) nothing",
        ":tpye 1",
        "1" + " + 1" * 99 + " + y",
    ):
        shown = lines(talk(text), columns)
        code = [line for line in shown if "|" in line]
        assert all(width(line) <= columns for line in code), (text, code)
        assert all(width(line) <= columns or len(line.split()) <= 3 or "`" in line for line in shown), (text, shown)


def test_carets_stand_under_what_is_meant_where_the_line_is_cut(talk):
    for columns in (20, 30, 40, 50):
        shown = lines(talk(RULE), columns)
        code = next(line for line in shown if line.startswith(("1 | ", "10 | ")) or " | " in line[:5])
        carets = shown[shown.index(code) + 1]
        assert code[carets.index("^") : carets.rindex("^") + 1] == "x < t"[: carets.count("^")]
        assert any("varies inside" in line for line in shown)


def test_wide_screens_and_pipes_are_as_before(talk):
    reply = talk(RULE)
    assert "\n".join(lines(reply, 200)) == reply.text
    assert painted(reply.parts[0], Screen(width=20)) == reply.parts[0].plain()


def test_prose_is_broken_between_words_and_not_in_code():
    assert broken("one two three four", 10, 2) == "one two\n  three\n  four"
    assert broken("write `a b` there", 14, 0) == "write `a b`\nthere"
    assert broken("see `f(x, y)` now", 11, 0).split("\n") == ["see `f(x,", "y)` now"]  # too long to be kept together
    assert broken("one two three", None, 2) == broken("one two three", 80, 2) == "one two three"
    assert broken("three four five", 12, 2, used=5) == "three\n  four five"


def test_explanations_leave_programs_alone(talk):
    page = talk(":explain P0301").text
    told = lines(talk(":explain P0301"), 50)
    code = [line for block in page.split("```")[1::2] for line in block.split("\n")[1:]]
    assert code and all(line in told for line in code)
    assert all(len(line) <= 50 or line in code for line in told)


@pytest.mark.parametrize("columns", [20, 40, 80])
def test_pictures_fit(talk, columns):
    talk.session.width = lambda: columns
    for text in (":plot sin(9*x)", ":plot x^2, deriv(\\u . u^2) -1 1", ":fit (a - 3)^4 + a a=9"):
        reply = talk(text)
        assert not reply.failed, reply.text
        drawn = [line for line in lines(reply, columns) if any("\u2800" <= c <= "\u28ff" or c in "▀│" for c in line)]
        assert drawn and max(map(width, drawn)) <= columns, text
    for look in ({}, {"unicode": False}):
        *rows, _ = lines(talk(":image x + y 128"), columns, **look)
        assert len(rows) > 4 and max(map(width, rows)) == columns
    coloured = lines(talk(":image x + y 128"), columns, color=True)
    assert {row.count("▀") for row in coloured[:-1]} == {columns}


@pytest.mark.parametrize("columns", [40, 50, 60, 80])
def test_numbers_stay_whole(talk, columns):
    talk("def f(a, t) integral ([0, 1], [0, 1]) a*[x + y < t]*exp(x) d(x, y)")
    for text in (":check f(2.5, 0.7)", ":grad f(2.5, 0.7)", "deriv(f)((2.5, 0), (0.7, 1))", "f(1/3, 0.7)"):
        reply = talk(text)
        shown = lines(reply, columns)
        assert all(width(line) <= columns for line in shown), shown
        numbers = re.findall(r"[\d.]*\d(?:e-?\d+)?(?: ± [\d.]+(?:e-?\d+)?)?", reply.parts[0].plain())
        assert all(any(number in line for line in shown) for number in numbers)


def test_a_terminal_that_does_not_know_its_width(monkeypatch):
    monkeypatch.setattr("os.get_terminal_size", lambda *_: os.terminal_size((0, 0)))
    monkeypatch.delenv("COLUMNS", raising=False)
    assert Terminal.columns() == 80
