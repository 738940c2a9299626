"""Edits in programs with arrays: sizes and fields are parts of interfaces, and what keeps these re-checks nobody."""

from __future__ import annotations

import random

import pytest
from marks import FOLDER, database, diagnostics, load

from potto.modules.texts import names
from potto.query import Database
from potto.types import format_type, interface

PROGRAM = """
# file: lib.po
record Lens(centre: (Real, Real), power: Real)
def doubled(xs: [n] Real) [2*x for x in xs]
def shifted(xs: [n] Real, k) [xs[i] + k for i in 0..n-1]
def bent(lens: Lens, x) lens.power*(x - lens.centre.0)
# file: main.po
from lib import Lens, doubled, shifted, bent
def total(xs: [n] Real) sum x in doubled(xs) (x)
def pairs(xs: [n] Real) total(shifted(xs, 1))
def rays(lens: Lens, ts) [bent(lens, t) for t in ts]
def image(ts: [n] Real) integral [0, 1] sum i in 0..n-1 ([x > ts[i]]*x) d(x)
"""


def snapshot(db: Database) -> list[object]:
    found: list[object] = []
    for file in ("lib.po", "main.po"):
        for name in names(db, FOLDER + file):
            found.append((file, name, format_type(interface(db, FOLDER + file, name).type)))
        found.append(diagnostics(db, file))
    return found


def edited(old: str, new: str) -> list[str]:
    """The definitions that are analysed again after an edit, each once."""
    db = database(PROGRAM)
    assert not any(diagnostics(db, file) for file in ("lib.po", "main.po"))
    snapshot(db)
    text = PROGRAM.replace(old, new)
    assert text != PROGRAM
    with db.recording():
        load(db, text)
        assert snapshot(db) == snapshot(database(text))
        runs = [event for event in db.events if event.kind == "executed" and event.query == "_analyses"]
    return list(dict.fromkeys(target.name for event in runs for target in event.args[0]))  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("old", "new", "again"),
    [
        ("[2*x for x in xs]", "[x + x for x in xs]", ["doubled"]),  # [n] Real as before
        ("[xs[i] + k for i in 0..n-1]", "[k + xs[j] for j in 0..n-1]", ["shifted"]),
        ("sum x in doubled(xs) (x)", "sum x in doubled(xs) (x^2)", ["total"]),
        ("[x > ts[i]]*x", "[x > ts[i]]*x^2", ["image"]),
        ("[2*x for x in xs]", "[2*x for x in xs, k in 0..1]", ["doubled", "total", "pairs"]),  # [n, 2] Real
        ("in 0..n-1]", "in 1..n-1]", ["shifted", "pairs"]),  # [n - 1] Real
        ("power: Real)", "strength: Real)", ["Lens", "bent", "rays"]),
    ],
)
def test_an_edit_checks_those_who_see_a_type_change(old: str, new: str, again: list[str]) -> None:
    assert edited(old, new) == again


BODIES = [
    "[2*x for x in xs]", "[x for x in xs, y in xs]", "xs", "xs[0]", "[xs[i + 1] - xs[i] for i in 0..n-2]", "xs[n]",
    "fold s = 0 for i in 0..n-1 (s + xs[i])", "max x in xs (x)", "n", "[doubled(xs)]", "Lens(centre=(0, 0), power=1)",
    "(xs, n)", "total(xs)", "[", "dot(xs, xs)", "xs + xs", "rays(Lens((0, 1), 2), xs)",
]  # fmt: skip


@pytest.mark.parametrize("seed", range(8))
def test_incremental_is_from_scratch(seed: int) -> None:
    pick = random.Random(seed)
    db = database(PROGRAM)
    heads = {"lib.po": ["doubled(xs: [n] Real)", "shifted(xs: [n] Real, k)"], "main.po": ["total(xs: [n] Real)"]}
    bodies = {head: "[2*x for x in xs]" for own in heads.values() for head in own}
    for _ in range(12):
        head = pick.choice(list(bodies))
        bodies[head] = pick.choice(BODIES)
        text = "\n# file: lib.po\nfrom main import total, rays\nrecord Lens(centre: (Real, Real), power: Real)\n"
        text += "".join(f"def {head} {bodies[head]}\n" for head in heads["lib.po"])
        text += "def bent(lens: Lens, x) lens.power*(x - lens.centre.0)\n"
        text += "# file: main.po\nfrom lib import Lens, doubled, shifted, bent\n"
        text += "".join(f"def {head} {bodies[head]}\n" for head in heads["main.po"])
        text += "def rays(lens: Lens, ts: [m] Real) [bent(lens, t) for t in ts]\n"
        load(db, text)
        assert snapshot(db) == snapshot(database(text)), bodies
