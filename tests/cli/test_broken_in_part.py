"""An error spoils its own definition only: what does not need it is answered, and the error shown beside it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from command_runs import Potto

PROGRAM = """\
from nowhere import g
def wrong(t) integral [0, 1] (if x < t then 1 else 0) d(x)
def half(t = 2 + * t
def over(t) wrong(t) + 1
def good(t) integral [0, 1] [x < t] d(x)
twice = 1
twice = 2
"""


@pytest.mark.parametrize("expression", ["good(0.25)", "0.25", "sqrt(1/16)"])
def test_what_does_not_need_an_error_is_answered(potto: Potto, expression: str) -> None:
    ran = potto("eval", "main.po", expression, main=PROGRAM)
    assert (ran.status, ran.out) == (1, "0.25\n")
    assert all(f"error[{code}]" in ran.err for code in ("P0202", "P0301", "P0206"))


@pytest.mark.parametrize(
    ("expression", "code", "line", "note"),
    [
        ("wrong(1)", "P0301", 2, "`wrong` is broken by this; it is needed here"),
        ("over(1)", "P0301", 2, "`wrong` is broken by this; it is needed through `over` here"),
        ("deriv(over)((1, 1))", "P0301", 2, "`wrong` is broken by this; it is needed through `over` here"),
        ("if 1 > 0 then 1 else over(1)", "P0301", 2, "`wrong` is broken by this; it is needed through `over` here"),
        ("g(1)", "P0202", 1, "`g` is broken by this"),
        ("twice", "P0206", 7, "`twice` is broken by this"),
    ],
)
def test_what_leads_to_an_error_says_to_which(potto: Potto, expression: str, code: str, line: int, note: str) -> None:
    ran = potto("eval", "main.po", expression, main=PROGRAM)
    assert (ran.status, ran.out) == (1, "")
    assert f"error[{code}]" in ran.err and f"main.po:{line}:" in ran.err and note in ran.err
    assert ran.err.count("error[") == 1


def test_a_definition_that_cannot_be_read(potto: Potto) -> None:
    ran = potto("eval", "main.po", "half(1)", main=PROGRAM)
    assert (ran.status, ran.out) == (1, "") and "main.po:3:" in ran.err and "`half` is broken" in ran.err


def test_errors_in_other_modules_count_where_they_are_needed(potto: Potto) -> None:
    files = {"main": "from other import good, over\n", "other": PROGRAM}
    assert potto("eval", "main.po", "good(0.25)", **files).out == "0.25\n"
    ran = potto("eval", "main.po", "over(1)", **files)
    assert ran.status == 1 and "other.po:2:" in ran.err and "through `over`" in ran.err


def test_as_json_errors_stand_beside_the_answer(potto: Potto) -> None:
    ran = potto("eval", "--json", "main.po", "good(0.25)", main=PROGRAM)
    assert ran.status == 1 and abs(ran.json["value"] - 0.25) < 1e-15
    assert {d["code"] for d in ran.json["diagnostics"]} >= {"P0202", "P0301", "P0206"}


def test_other_commands_answer_too(potto: Potto) -> None:
    ran = potto("deriv", "main.po", "good", main=PROGRAM)
    assert ran.status == 1 and ran.out.startswith("good : ") and "P0301" in ran.err
    ran = potto("deriv", "main.po", "over", main=PROGRAM)
    assert ran.status == 1 and ran.out == "" and "through `over`" in ran.err
    ran = potto("test", "main.po", main=PROGRAM + "#> good(0.5)\n#= 0.5\n")
    assert ran.status == 1 and ran.out.startswith("1 live expression in 1 file: all hold") and "P0301" in ran.err


@pytest.mark.parametrize(
    "statement", ["[x for x in v if x > 1]", "v[1..2]", "print [q for q in w if z > 1]", "for i in 0..2 print(i) if"]
)
def test_of_a_statement_that_is_guessed_at_only_the_parser_speaks(potto: Potto, tmp_path: Path, statement: str) -> None:
    """As of a definition: what it was taken for has types that nobody meant."""
    (tmp_path / "script.po").write_text(f"v = [1, 2, 3]\n{statement}\n", encoding="utf-8")
    ran = potto("check", "script.po")
    codes = re.findall(r"error\[(P\d+)\]", ran.out + ran.err)
    assert codes and all(code.startswith("P01") for code in codes), codes
