"""What people try who come from other prompts: `quit()`, `:!ls`, `:timeit`, several lines at once."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize("word", ["quit", "exit", "quit()", "exit()", ":quit"])
def test_ways_to_leave(talk, word):
    assert not talk(word).text and talk.session.leaving


def test_names_that_are_defined_go_first(talk):
    talk.all("quit = 3")
    assert "3" in talk("quit").text and not talk.session.leaving


def test_commands_of_the_system(talk):
    talk.write("a.po", "")
    assert talk(":!ls").text == "a.po"
    assert talk(":! echo one; echo two >&2").text == "one\ntwo"
    assert talk.data(":shell echo hi") == {"output": "hi", "status": 0}
    assert talk(":!exit 3").failed and "status 3" in talk(":!exit 3").text
    assert "a command is missing" in talk(":!").text
    assert talk(":!cat").text == ""  # it has nothing to read


def test_timing_again_and_again(talk):
    talk("def f(t) integral [0, 1] [x < t] d(x)")
    data = talk.data(":timeit f(0.3)")
    assert 0 < data["least"] <= data["median"] < 1 and data["rounds"] == 7 and data["times"] >= 1
    assert "`g` is not defined" in talk(":timeit g(1)").text and "missing" in talk(":timeit").text


def test_values_of_one_paste_have_numbers_of_their_own(talk):
    said = talk("a = 1\na + 1\na + 2\na + 3").text
    assert [line.split(" ")[0] for line in said.splitlines()] == ["a", "_1", "_2", "_3"]
    assert talk("_1*100 + _2*10 + _3").text == "_4 = 234 : Real"
    assert "Out[2]" not in talk("Out[2]").text and talk("_").text.startswith("_6 = 3")
    assert "`<In 7>`" not in talk("nothing\n1 + 1").text
    assert "there is no answer 99" in talk("_99").text
    assert talk("5").text == "_9 = 5 : Real"


def test_the_missing_bracket_is_what_is_told(talk):
    told = talk("def f(r) integral ([0, 1], [0, 1]) [x^2 + y^2 < r^2 d(x, y)").text
    assert told.startswith("error[P0102]: this `[` is never closed") and told.count("error") == 1
    assert "a `]` is missing here" in told


def test_an_exclamation_mark_is_told_what_to_write(talk):
    text = talk("!ls -l").text
    assert "nothing begins with `!`" in text and "`:!ls …`" in text and "`not …`" in text and "P0201" not in text
