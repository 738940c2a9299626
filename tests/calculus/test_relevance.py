"""Which definitions can have a condition under an integral: none that has one may be left out."""

from __future__ import annotations

from pathlib import Path

import pytest

from potto.calculus.checking.conditions import conditions_of
from potto.calculus.checking.diffeo import exported
from potto.calculus.inlining.relevance import may_integrate
from potto.checking.library import Library
from potto.elaborate import core_term
from potto.modules import names

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FILES = sorted(str(path) for path in EXAMPLES.rglob("*.po"))

PROGRAM = """
def area(f, c)
    integral [0, 1] f(x, c) d(x)

def step(x, c) [x < c]

def passes(c) area(step, c)

def in_part = area(step)

def given(f, c) f(c) + c

def locally(c)
    g = \\x . [x < c]
    given(g, c)

def numbers(c) passes(c) + step(c, 2)

def pairs(c)
    p = (c, 2)
    passes(p)

listed = [step, step]

def of_list(c) area(listed[0], c)

def own(c) ∫ [0, 1] [x < c] d(x)
"""


def relevant(text: str) -> list[str]:
    library = Library(["/relevance"])
    file = library.put("/relevance/main.po", text)
    return [name for name in names(library.db, file) if may_integrate(library.db, file, name)]


def test_numbers_that_are_given_to_others_are_not_relevant() -> None:
    assert relevant(PROGRAM) == ["area", "passes", "in_part", "locally", "of_list", "own"]


@pytest.mark.parametrize("file", FILES, ids=lambda file: Path(file).name)
def test_what_is_left_out_has_no_condition(file: str) -> None:
    library = Library([EXAMPLES])
    db = library.db
    for name in names(db, file):
        if not may_integrate(db, file, name):
            term = core_term(db, file, name)
            found = conditions_of(
                term, lambda g: exported(db, g.module, g.name), lambda g: core_term(db, g.module, g.name)
            )
            assert found == (), name
