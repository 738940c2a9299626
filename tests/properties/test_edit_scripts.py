"""Random edits: the incremental front end says what one says that has never seen another text; and a body edit runs
nothing that is not its own.

`make fuzz` runs more of them.
"""

from __future__ import annotations

import random
from collections.abc import Hashable
from typing import Any

import pytest
from edited_programs import WORKSPACE, edited, library
from how_many import examples

import potto.ide as ide
from potto.checking.library import Library
from potto.modules import definition, names, statements
from potto.modules.texts import content
from potto.types import interface

ROOT = "/edited"
SCRIPTS = examples(30, 500)


def seen(lib: Library, offsets: dict[str, list[int]]) -> dict[Hashable, Any]:
    """Trees, interfaces, diagnostics and hovers."""
    found: dict[Hashable, Any] = {}
    for name in WORKSPACE:
        file = f"{ROOT}/{name}"
        found[name, "diagnostics"] = lib.diagnostics(file)
        found[name, "statements"] = statements(lib.db, file)
        for each in names(lib.db, file):
            found[name, each] = (definition(lib.db, file, each), interface(lib.db, file, each))
        for offset in offsets[name]:
            found[name, offset] = ide.hover_at(lib.db, file, offset)
    return found


def run_script(seed: int) -> None:
    rng = random.Random(seed)
    texts = dict(WORKSPACE)
    lib = library(ROOT, texts)
    seen(lib, {name: [] for name in texts})
    for step in range(rng.randrange(1, 6)):
        for _ in range(rng.randrange(1, 3)):
            name = rng.choice(list(texts))
            texts[name] = WORKSPACE[name] if rng.random() < 0.2 else edited(texts[name], rng)
            lib.put(f"{ROOT}/{name}", texts[name])
        offsets = {name: [rng.randrange(len(text) + 1) for _ in range(2)] for name, text in texts.items()}
        assert seen(lib, offsets) == seen(library(ROOT, texts), offsets), (seed, step)


@pytest.mark.parametrize("seed", range(20))
def test_incremental_is_from_scratch(seed: int) -> None:
    run_script(seed)


FOUND = [506559]  # a diffeomorphism that calls its parameter made the check fail


@pytest.mark.parametrize("seed", FOUND)
def test_what_was_found(seed: int) -> None:
    run_script(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(1000, 1000 + SCRIPTS, 100))
def test_incremental_is_from_scratch_for_long(first: int) -> None:
    for seed in range(first, min(first + 100, 1000 + SCRIPTS)):
        run_script(seed)


BODY_EDITS = [
    ("shapes.po", "exp(-u)", "exp(-2*u)", "smooth"),
    ("shapes.po", "1/(1 + s)", "2/(1 + s) + 0*u", "smooth"),
    ("middle.po", "s = k*2", "s = k*3 + 1", "area"),
    ("middle.po", "step(x - t)*x", "step(x - t)*x^2", "left"),
    ("middle.po", "h(h(x))", "(let y = h(x) in h(y))", "twice"),
    ("main.po", "(x, y)(c) d(x, y)", "(x, y)(c)*x d(x, y)", "render"),
    ("main.po", "v + 1", "v + 2", "both"),
]
OF_TEXTS = {
    "parsed", "head", "chunk_references", "occurring_names", "piece", "piece_diagnostics", "occurring_in_piece",
    "_group", "_group_diagnostics", "_import_texts",
}  # fmt: skip
OF_FILES = {
    "content", "source", "pieces", "groups_of_pieces", "chunks", "import_texts", "layout", "outline", "texts",
    "syntax_diagnostics", "module_diagnostics", "statements", "used_imports", "unused_imports", "_words_at", "exists",
    "problem", "diagnostics",
}  # fmt: skip


@pytest.mark.parametrize(("name", "old", "new", "defined"), BODY_EDITS)
def test_a_body_edit_runs_no_interface_of_another_and_nothing_of_other_modules(
    name: str, old: str, new: str, defined: str
) -> None:
    lib, file = library(ROOT, dict(WORKSPACE)), f"{ROOT}/{name}"
    everything = [f"{ROOT}/{each}" for each in WORKSPACE]
    before = [lib.diagnostics(each) for each in everything]
    text = content(lib.db, file)
    assert isinstance(text, str) and text.count(old) == 1
    lib.put(file, text.replace(old, new))
    with lib.db.recording() as events:
        after = [lib.diagnostics(each) for each in everything]
    assert before == after == [()] * len(everything)
    ran = [(event.query, event.args) for event in events if event.kind == "executed"]
    assert any(query == "_analyses" for query, _ in ran), "the definition itself is checked"
    for query, args in ran:
        match args:
            case (str(where), str(what)) if where in everything:
                assert (where, what) == (file, defined), (query, args)
            case (str(where),) if where in everything:
                assert where == file and query in OF_FILES, (query, args)
            case (str(where), tuple(run)) if where in everything:  # some neighbouring definitions of one file
                assert where == file and defined in run and query == "_mentioned", (query, args)
            case (tuple(group),):
                assert [(target.file, target.name) for target in group] == [(file, defined)], (query, args)
            case _:
                assert query in OF_TEXTS, (query, args)
