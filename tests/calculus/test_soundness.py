"""Conditions that rest on what is only guessed wait until it is mended: then they are told as before."""

from __future__ import annotations

import pytest

from potto.calculus.checking.diffeo import check_conditions
from potto.modules import open_files
from potto.query import Database

FILE = "/soundness.po"
USING = """
from measured import scale

def height(x) x^2 + 1

def above(t)
    integral [-2, 2] [x^5 - x + 1 < t] * height(x) * scale(t) d(x)
"""  # a quintic is solved by searching, which is told
MEASURED = "def scale(t) 2*t"


def told(text: str, measured: str | None = MEASURED) -> list[str]:
    """The codes of what is said of the conditions of `above`."""
    db = Database()
    files = open_files(db)
    files.set_text(FILE, text)
    if measured is not None:
        files.set_text("/measured.po", measured)
    return [said.code for said in check_conditions(db, FILE, "above")]


def test_a_condition_over_definitions_that_are_right_is_told_of() -> None:
    assert told(USING) == ["P0616"]


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("x^2 + 1", "x^2 + (1"),  # cannot be read
        ("x^2 + 1", "[x < 1](x)"),  # has no type
        ("import scale", "import scales as scale"),  # is not there
        ("from measured", "from measures"),
    ],
)
def test_nothing_is_told_of_a_condition_while_something_in_it_is_guessed(right: str, wrong: str) -> None:
    assert told(USING.replace(right, wrong)) == []


def test_of_a_definition_with_a_mistake_whose_type_is_known_conditions_are_told() -> None:
    """Who only calls it is told what is wrong with their own conditions."""
    assert told(USING, "def scale(t) 2*sin(t, t)") == told(USING)
