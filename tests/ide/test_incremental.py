"""What is remembered is what would be found anew, and an edit asks again only what it touches."""

from __future__ import annotations

import random

import pytest
from ide_fixture import fixture
from test_every_offset import mutated

import potto.ide as ide
from potto.source import Span

PROGRAM = """
    # file: low.po
    # A disc.
    def disc(x, y)(r) [x^2 + y^2 < r^2]
    # file: main.po
    from low import disc
    def area(r, k)
        s = k*2
        integral ([0, 1], [0, s]) disc(x, y)(r) d(x, y)
    darea = deriv(area)
    def other(a) area(a, k=1) + a
    print(darea(dr=(1, 1), 2), other(3))
    #> other(0.5)
    """


def everything(library, file: str, text: str) -> list[object]:
    db = library.db
    found: list[object] = [ide.semantic_tokens(db, file), ide.document_symbols(db, file), ide.folding_ranges(db, file)]
    whole = Span(0, len(text))
    found += [
        ide.inlay_hints(db, file, whole),
        ide.inline_values(db, file, whole),
        ide.code_lenses(db, file),
        ide.document_links(db, file),
    ]
    found += [ide.hover_at(db, file, offset) for offset in range(0, len(text), 5)]
    found += [ide.references(db, file, offset) for offset in range(0, len(text), 11)]
    return found


@pytest.mark.parametrize("seed", range(6))
def test_incremental_equals_from_scratch(seed: int) -> None:
    rng = random.Random(seed)
    f = fixture(PROGRAM)
    original = f.text()
    text = original
    for step in range(8):
        text = original if step % 4 == 3 else mutated(text, rng)
        f.library.files.set_text(f.file, text)
        fresh = fixture(PROGRAM)
        fresh.library.files.set_text(fresh.file, text)
        assert everything(f.library, f.file, text) == everything(fresh.library, fresh.file, text)


def test_an_edit_of_a_body_asks_nothing_of_other_definitions() -> None:
    f = fixture(PROGRAM)
    everything(f.library, f.file, f.text())
    edited = f.text().replace("+ a\n", "+ a*2\n")  # in `other`: its type stays
    f.library.files.set_text(f.file, edited)
    with f.db.recording() as events:
        everything(f.library, f.file, edited)
    names = ("definition_words", "definition_symbol", "definition_hints", "definition_markdown", "derivative_text")
    ran = {(e.query, e.args[1]) for e in events if e.kind == "executed" and e.query in names}
    assert {name for _, name in ran} == {"other"}


def test_moving_a_definition_asks_nothing_again() -> None:
    f = fixture(PROGRAM)
    everything(f.library, f.file, f.text())
    f.library.files.set_text(f.file, "\n\n" + f.text())
    with f.db.recording() as events:
        everything(f.library, f.file, "\n\n" + f.text())
    names = ("definition_words", "definition_symbol", "definition_hints", "definition_markdown", "condition_infos")
    assert [e for e in events if e.kind == "executed" and e.query in names] == []


def test_the_view_asks_for_no_formulas():
    """Equations and places are enough for it: where surfaces are, and inverses, take longer to write."""
    f = fixture(PROGRAM)
    with f.db.recording() as events:
        found = ide.viewed(f.db, f.file, f.find("integral"))
    assert found is not None and [c.equation for c in found.conditions] == ["x^2 + y^2 = r^2"]
    ran = {e.query for e in events if e.kind == "executed"}
    assert "condition_places" in ran and not ran & {"condition_infos", "derivative_text"}
