"""Going to places: definitions, references, symbols, hierarchies, links."""

from __future__ import annotations

from pathlib import Path

from ide_fixture import Fixture, fixture

import potto.ide as ide
from potto.checking.library import Library
from potto.source import Span

FILES = """
# file: half_plane.diffeo
cond = \\(x, y) . \\c . (x + y + c, x - y + c)
# file: shapes.po
from half_plane import cond as half
# A disc.
def disc(x, y)(r) [x^2 + y^2 < r^2]
def cut(x, y)(c) if half(x, y)(c) then 1 else 0
# file: main.po
from shapes import disc as round, cut
import shapes
def area(r)
    integral ([0, 1], [0, 1]) round(x, y)(r) d(x, y)
def other(c)
    inside = half_of(c)
    integral ([0, 1], [0, 1]) (cut(x, y)(c) + shapes.disc(x, y)(r=c) + inside) d(x, y)
def half_of(c) c/2
darea = deriv(area)
print(darea(dr=(1, 1)), area(0.5))
"""


def places(f: Fixture, found) -> list[tuple[str, str]]:
    if found is None:
        return []
    return [(Path(t.file).name, f.at(t.span, t.file)) for t in found.targets]


def at(needle: str, by: int = 0) -> tuple[Fixture, int]:
    f = fixture(FILES)
    return f, f.find(needle, by)


def test_definition_goes_through_aliases_members_and_keywords():
    for needle, expected in [
        ("round(x", ("shapes.po", "disc")),
        ("disc(x", ("shapes.po", "disc")),
        ("half_of(c)\n    integral", ("main.po", "half_of")),
        ("inside) d", ("main.po", "inside")),
        ("r=c", ("shapes.po", "r")),
        ("dr=(", ("main.po", "r")),
        ("shapes.disc", ("shapes.po", "")),
        ("x, y)(r) d", ("main.po", "x")),
    ]:
        f, offset = at(needle)
        assert places(f, ide.definition(f.db, f.file, offset)) == [expected], needle


def test_declaration_is_the_import():
    f, offset = at("round(x")
    found = ide.declaration(f.db, f.file, offset)
    assert places(f, found) == [("main.po", "round")] and found.targets[0].span.start == f.find("round")


def test_implementation_of_a_condition_and_of_another_name():
    f = fixture(FILES)
    shapes = f.key("shapes.po")
    text = f.text(shapes)
    for needle in ("if half", "half(x"):
        found = ide.implementation(f.db, shapes, text.index(needle))
        assert [(Path(t.file).name, f.at(t.span, t.file)) for t in found.targets] == [("half_plane.diffeo", "cond")]
    f, offset = at("darea(dr")
    assert places(f, ide.implementation(f.db, f.file, offset)) == [("main.po", "area")]


def test_references_in_all_files():
    f, offset = at("round(x")
    found = ide.references(f.db, f.file, offset)
    names = sorted((Path(r.file).name, f.at(r.span, r.file)) for r in found)
    here = [("main.po", name) for name in ("disc", "disc", "round", "round")]
    assert names == [*here, ("shapes.po", "disc")]
    assert len(ide.references(f.db, f.file, offset, False)) == 4


def test_references_of_a_parameter_are_its_keywords_too():
    f, offset = at("dr=(")
    found = ide.references(f.db, f.file, offset)
    assert sorted(f.at(r.span) for r in found) == ["dr", "r", "r"]


def test_highlights_stay_in_the_file_and_tell_writes():
    f, offset = at("inside) d")
    found = [(f.at(h.span), h.kind) for h in ide.highlights(f.db, f.file, offset)]
    assert found == [("inside", "write"), ("inside", "read")]
    f, offset = at("area(0.5)")
    assert len(ide.highlights(f.db, f.file, offset)) == 3


def test_document_symbols_have_types_and_children():
    f = fixture(FILES)
    found = ide.document_symbols(f.db, f.file)
    assert [s.name for s in found[:4]] == ["area", "other", "half_of", "darea"] and found[4].kind == "statement"
    assert found[0].detail == "(r: Real) -> Real" and [c.name for c in found[0].children] == ["r", "x", "y"]
    assert f.at(found[1].selection) == "other" and f.at(found[1].span).startswith("def other")


def test_workspace_symbols_by_letters():
    f = fixture(FILES)
    assert [s.name for s in ide.workspace_symbols(f.db, "disc")] == ["disc"]
    assert [s.name for s in ide.workspace_symbols(f.db, "ho")] == ["half_of"]
    assert {s.name for s in ide.workspace_symbols(f.db, "")} >= {"cond", "disc", "area"}
    assert ide.workspace_symbols(f.db, "cond")[0].kind == "diffeo"


def test_call_hierarchy():
    f, offset = at("half_of(c)\n    integral")
    item = ide.prepare_call_hierarchy(f.db, f.file, offset)
    assert item.name == "half_of"
    assert [(c.item.name, len(c.spans)) for c in ide.incoming_calls(f.db, *item.data)] == [("other", 1)]
    outgoing = ide.outgoing_calls(f.db, f.file, "other")
    assert [c.item.name for c in outgoing] == ["half_of", "cut", "disc"]
    incoming = ide.incoming_calls(f.db, f.file, "area")
    assert [c.item.name for c in incoming] == ["darea", "main.po"]


def test_document_links():
    f = fixture(FILES)
    found = ide.document_links(f.db, f.file)
    assert [(f.at(link.span), Path(link.target).name) for link in found] == [("shapes", "shapes.po")] * 2


def test_linked_editing_of_local_names_only():
    f, offset = at("inside) d")
    assert [f.at(s) for s in ide.linked_editing(f.db, f.file, offset)] == ["inside", "inside"]
    f, offset = at("x, y)(r) d")
    assert len(ide.linked_editing(f.db, f.file, offset)) == 2
    f, offset = at("area(0.5)")
    assert ide.linked_editing(f.db, f.file, offset) == ()


def test_selection_grows():
    f, offset = at("r) d(x, y)\ndef other")
    found = [f.at(s) for s in ide.selection_ranges(f.db, f.file, offset)]
    assert found[0] == "r" and "round(x, y)(r)" in found and found[-1] == f.text()
    assert found[-2].startswith("def area")


def test_folding():
    f = fixture("# a\n# b\n\nfrom m import a\nfrom n import b\n\ndef f(x)\n    g(x,\n        1)\n")
    kinds = [(fold.kind, f.at(fold.span).count("\n")) for fold in ide.folding_ranges(f.db, f.file)]
    assert kinds == [("comment", 1), ("imports", 1), ("region", 2), ("region", 1)]


def test_broken_chunks_keep_their_names():
    f = fixture("def f(a) a\ndef g(\ny = f($0 + 1\n")
    assert [s.name for s in ide.document_symbols(f.db, f.file)] == ["f", "g", "y"]
    assert len(ide.references(f.db, f.file, f.find("f("))) == 2


def test_a_column_is_defined_in_its_file(tmp_path: Path) -> None:
    (tmp_path / "flights.csv").write_text("time,fast time,signal\n1,2,3\n")
    text = 'data = load("flights.csv")\nfirst = data.signal[0]\n'
    (tmp_path / "main.po").write_text(text)
    library = Library([tmp_path])
    file = library.key(tmp_path / "main.po")
    column = ide.definition(library.db, file, text.index("signal"))
    named = ide.definition(library.db, file, text.index("flights"))
    assert column is not None and named is not None
    ((where, span),) = [(Path(target.file).name, target.span) for target in column.targets]
    assert where == "flights.csv" and "time,fast time,signal"[span.start : span.end] == "signal"
    assert [(Path(target.file).name, target.span) for target in named.targets] == [("flights.csv", Span(0, 0))]
