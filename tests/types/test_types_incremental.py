"""Edits: an incremental answer is the one from scratch, and a body edit that keeps an interface re-checks nobody."""

from __future__ import annotations

import random

from marks import FOLDER, database, diagnostics, load

from potto.modules.texts import names
from potto.query import Database
from potto.types import check_definition, format_type, interface

MAIN = FOLDER + "main.po"
LIB = FOLDER + "lib.po"

PROGRAM = r"""
# file: lib.po
def step(y) if y > 0 then 1 else 0
def soft(y) [y > 0]*y
# file: main.po
from lib import step, soft
def f(t) integral [0, 1] soft(x - t) d(x)
def g(t) f(t)*step(t)
def h(t) 2*g(t)
"""


def snapshot(db: Database) -> list[object]:
    """All that the types say about the two files."""
    found: list[object] = []
    for file in ("lib.po", "main.po"):
        for name in names(db, FOLDER + file):
            found.append((file, name, format_type(interface(db, FOLDER + file, name).type)))
        found.append(diagnostics(db, file))
    return found


def analysed(db: Database) -> list[str]:
    """What was analysed since recording began: the names of definitions."""
    runs = [event for event in db.events if event.kind == "executed" and event.query == "_analyses"]
    return [target.name for event in runs for target in event.args[0]]  # type: ignore[attr-defined]


def edited(db: Database, old: str, new: str) -> list[str]:
    """The definitions that are analysed again after an edit."""
    snapshot(db)
    text = PROGRAM.replace(old, new)
    assert text != PROGRAM
    with db.recording():
        load(db, text)
        snapshot(db)
        return analysed(db)


def test_a_body_edit_checks_that_definition_only() -> None:
    assert edited(database(PROGRAM), "[y > 0]*y", "[y > 0]*y + 0*y") == ["soft"]


def test_a_renamed_local_and_a_moved_condition_check_that_definition_only() -> None:
    assert edited(database(PROGRAM), "if y > 0 then 1 else 0", "if (y) > 1 then 3 else 0") == ["step"]
    assert edited(database(PROGRAM), "integral [0, 1] soft(x - t) d(x)", "integral [0, 2] soft(u - t) d(u)") == ["f"]


def test_lines_above_check_nothing() -> None:
    assert edited(database(PROGRAM), "def f(t)", "# a comment\n\n\ndef f(t)") in (["f"], [])
    assert edited(database(PROGRAM), "def step", "z = 1\ndef step") == ["z"]


def test_a_changed_interface_checks_who_uses_it() -> None:
    plain = edited(database(PROGRAM), "[y > 0]*y", "(if y > 0 then y else 0)")
    assert plain == ["soft", "f", "g"]  # now the t of f must be plain as well


def test_a_definition_that_breaks_and_heals() -> None:
    db = database(PROGRAM)
    before = snapshot(db)
    load(db, PROGRAM.replace("[y > 0]*y", "[y > 0]* (y +"))
    assert diagnostics(db) == [] and diagnostics(db, "lib.po") == []  # the parser has spoken, nobody else suffers
    load(db, PROGRAM)
    assert snapshot(db) == before


def test_interfaces_have_no_places() -> None:
    db, moved = database(PROGRAM), database(PROGRAM.replace("def step(y) if y", "def step(y)\n    if     y"))
    assert interface(db, LIB, "step") == interface(moved, LIB, "step")
    assert interface(db, MAIN, "f") == interface(moved, MAIN, "f")


BODIES = [
    "y",
    "y + 1",
    "if y > 0 then y else 0",
    "if [y > 0] then y else 0",
    "floor(y)",
    "(y, y)",
    "soft(y)",
    "step(y) + undefined",
    "integral [0, 1] x*y d(x)",
    "integral [0, 1] step(x - y) d(x)",
    "integral [0, 1] soft(x*y) d(x)",
    "deriv(soft)(y, 1)",
    "g(y) + f(y)",
    "\\z . y*z",
    "if y > 0 then h(y - 1) else 1",
    "y y",
    "sin(y, y)",
    "(y +",
    "delta(y - 1)",
]


def test_incremental_is_from_scratch() -> None:
    """Random edits of bodies, heads and order; the seeds are fixed, so that a failure stays."""
    for seed in range(12):
        rng = random.Random(seed)
        program = {name: rng.choice(BODIES) for name in ("step", "soft", "f", "g", "h")}
        db = Database()
        for _ in range(8):
            program[rng.choice(list(program))] = rng.choice(BODIES)
            order = rng.sample(["f", "g", "h"], 3)
            library = "".join(f"def {name}(y) {program[name]}\n" for name in ("step", "soft"))
            main = "from lib import step, soft\n" + "".join(f"def {name}(y) {program[name]}\n" for name in order)
            db.set_input(("file", LIB), library)
            db.set_input(("file", MAIN), main)
            fresh = Database()
            fresh.set_input(("file", LIB), library)
            fresh.set_input(("file", MAIN), main)
            assert snapshot(db) == snapshot(fresh), (library, main)


def test_only_what_is_needed_is_analysed() -> None:
    db = database(PROGRAM)
    with db.recording():
        check_definition(db, MAIN, "f")
        assert sorted(analysed(db)) == ["f", "soft"]


def test_recursion_across_modules() -> None:
    db = database("""
        # file: lib.po
        from main import odd
        def even(n) if n > 0 then odd(n - 1) else 1
        # file: main.po
        from lib import even
        def odd(n) if n > 0 then even(n - 1) else 0
    """)
    assert format_type(interface(db, MAIN, "odd").type) == "(n: Real) -> Real"
    assert format_type(interface(db, LIB, "even").type) == "(n: Real) -> Real"
    assert diagnostics(db) == diagnostics(db, "lib.po") == []


def renamed(db: Database, text: str, old: str, new: str) -> tuple[list[str], list[object]]:
    """The definitions that are analysed again after an edit, and what is said then; it is what is said from scratch."""
    load(db, text)
    snapshot(db)
    with db.recording():
        load(db, text.replace(old, new))
        found = snapshot(db)
        again = analysed(db)
    assert found == snapshot(database(text.replace(old, new)))
    return again, found


def test_a_parameter_that_is_renamed_is_told_to_callers_without_a_new_analysis() -> None:
    db = database(PROGRAM)
    text = PROGRAM.replace("soft(x - t)", "soft(x - t, 1)").replace("2*g(t)", "2*g((t, t))").replace("f(t)*", "f()*")
    again, found = renamed(
        db, text.replace("def g(t) f()*step(t)", "def g(t) f()*step(t, 1)"), "def soft(y) [y", "def soft(y2) [y2"
    )
    assert again == ["soft"] and "its parameters are (y2)" in str(found)
    again, found = renamed(db, text, "def g(t) f()*step(t)", "def g(tau) f()*step(tau)")
    assert again == ["g"] and "`tau` of `g` must be" in str(found)


def test_who_needs_the_names_of_parameters_sees_them_change() -> None:
    for uses in ("h(t) 2*g(t=t)", "h(t) 2*fst(deriv(g)((t, 1)))", "h = g", "h(t) let k = g in k(t)"):
        text = PROGRAM.replace("h(t) 2*g(t)", uses)
        if uses.startswith("h = "):
            text = text.replace("def h", "h")
        again, _ = renamed(database(text), text, "def g(t) f(t)*step(t)", "def g(tau) f(tau)*step(tau)")
        assert again == ["g", "h"]
