"""Fields of records in the editor: where they are declared and named, in all files; parts of tuples; columns."""

from __future__ import annotations

from pathlib import Path

import pytest
from ide_fixture import Fixture, fixture

import potto.ide as ide
from potto.checking.check import diagnostics
from potto.checking.library import Library

SCENE = """
    # file: cameras.po
    record Vec(x: Real, y: Real)
    record Camera(eye: Vec, focal: Real)
    front = Camera(eye=Vec(0, 1), focal=2)
    def share(c: Camera, depth) c.focal / (depth - c.eye.x)
    # file: main.po
    from cameras import Camera, Vec, front
    import cameras
    near = front with focal = 3
    wide = cameras.front with (focal = 1, eye = Vec(1, 2))
    def total(cs: [n] Camera) sum c in cs (c.focal)
    def both(c: Camera, d: Camera) (c.focal + front.focal)*d.eye.y + front.eye.x + (near).focal
    def inner(c: Camera)
        b = c with focal = 2*c.focal
        b.focal
    #> cameras.share(near, near.focal)
    slope = fst(deriv(Camera)(deye=(Vec(0, 0), Vec(0, 0)), dfocal=(1, 1)))
    print(near.focal)
"""


def marked(before: str, by: str) -> Fixture:
    """The scene with the cursor in front of a text, in the place of `by`."""
    assert SCENE.count(before) == 1, before
    return fixture(SCENE.replace(before, by))


CURSORS = [
    ("focal: Real", "fo$0cal: Real"),
    ("front with focal = 3", "front with $0focal = 3"),
    ("with (focal = 1", "with ($0focal = 1"),
    ("sum c in cs (c.focal)", "sum c in cs (c.$0focal)"),
    ("c.focal + front.focal", "c.focal + front.$0focal"),
    ("(near).focal", "(near).foc$0al"),
    ("    b.focal", "    b.$0focal"),
    ("focal=2)", "$0focal=2)"),
    ("cameras.share(near, near.focal)", "cameras.share(near, near.$0focal)"),
    ("print(near.focal)", "print(near.focal$0)"),
]


@pytest.mark.parametrize(("before", "by"), CURSORS)
def test_a_field_is_renamed_everywhere(before: str, by: str) -> None:
    f = marked(before, by)
    change = ide.rename(f.db, f.file, f.offset, "zoom")
    after = f.after(change)
    plain = fixture(SCENE)
    for file, text in plain.texts.items():
        expected = text.replace("dfocal", "dzoom").replace("focal", "zoom")
        assert after[Path(file).name] == expected
        f.library.files.set_text(file, expected)
    assert not [d for file in plain.texts for d in diagnostics(f.db, file)]


def test_a_field_of_one_record_is_not_that_of_another() -> None:
    f = marked("eye: Vec, focal", "$0eye: Vec, focal")
    after = f.after(ide.rename(f.db, f.file, f.offset, "at"))
    assert "c.at.x" in after["cameras.po"] and "front.at.x" in after["main.po"] and "d.at.y" in after["main.po"]
    f = marked("x: Real, y", "$0x: Real, y")
    after = f.after(ide.rename(f.db, f.file, f.offset, "left"))
    assert "c.eye.left" in after["cameras.po"]
    assert "front.eye.left" in after["main.po"] and "d.eye.y" in after["main.po"]


def test_the_value_in_front_of_a_field_is_renamed_with_all_its_fields() -> None:
    f = marked("near = front with", "$0near = front with")
    after = f.after(ide.rename(f.db, f.file, f.offset, "close"))["main.po"]
    assert "(close).focal" in after and "cameras.share(close, close.focal)" in after and "print(close.focal)" in after
    f = fixture("record P(x: Real)\nrecord Q(p: P)\nq = Q(P(1))\nk = q.p.x + $0q.p.x\n")
    assert f.after(ide.rename(f.db, f.file, f.offset, "r"))["main.po"].endswith("r = Q(P(1))\nk = r.p.x + r.p.x\n")
    f = fixture("record P(x: Real)\nrecord Q(p: P)\ndef f($0q: Q) q.p.x\n")
    assert f.after(ide.rename(f.db, f.file, f.offset, "r"))["main.po"].endswith("def f(r: Q) r.p.x\n")


def test_what_a_rename_of_a_field_refuses() -> None:
    f = marked("focal: Real", "$0focal: Real")
    assert ide.rename(f.db, f.file, f.offset, "eye") == ide.Refused("`Camera` has a field `eye` already")
    f = fixture("def f(u: (Real, Real)) u.$0x\n")
    assert ide.rename(f.db, f.file, f.offset, "left") == ide.Refused("`x` is a part of a tuple")


@pytest.mark.parametrize(("before", "by"), CURSORS)
def test_to_the_definition_of_a_field(before: str, by: str) -> None:
    f = marked(before, by)
    found = ide.definition(f.db, f.file, f.offset)
    assert found is not None
    (target,) = found.targets
    assert Path(target.file).name == "cameras.po" and f.at(target.span, target.file) == "focal"
    assert target.span.start == f.text(target.file).index("focal: Real")


def test_references_and_highlights_of_a_field() -> None:
    f = marked("focal: Real", "$0focal: Real")
    found = ide.references(f.db, f.file, f.offset)
    assert {f.at(place.span, place.file) for place in found} == {"focal", "dfocal"}
    assert len(found) == sum(text.count("focal") for text in f.texts.values())
    assert len(ide.references(f.db, f.file, f.offset, declaration=False)) == len(found) - 1
    here = ide.highlights(f.db, f.file, f.offset)
    assert [f.at(place.span) for place in here] == ["focal"] * f.text().count("focal")


def test_hover_of_parts() -> None:
    for before, by in CURSORS:
        assert marked(before, by).hover() == "```potto\nfocal : Real\n```\n\nfield of `Camera`"
    said = fixture("def f(u: (Real, [n] Real)) u.$0y\n").hover()
    assert said == "```potto\ny : [n] Real\n```\n\npart of `(Real, [n] Real)`"


def test_parts_are_properties() -> None:
    f = fixture(SCENE)
    found = {(f.at(t.span), t.type) for t in ide.semantic_tokens(f.db, f.file)}
    assert {("focal", "property"), ("eye", "property"), ("x", "property")} <= found
    assert ("front", "variable") in found and ("focal", "variable") not in found
    assert ("cameras", "namespace") in found


def test_columns_of_a_table(tmp_path: Path) -> None:
    (tmp_path / "people.csv").write_text("height,weight\n1.8,80\n1.6,60\n")
    library = Library([tmp_path])
    text = 'people = load("people.csv")\ndef f(t) t*people.height[0]\nk = people.height[1]\n'
    key = library.put(library.key(tmp_path / "main.po"), text)
    at = text.index("height")
    hover = ide.hover_at(library.db, key, at)
    assert hover is not None and hover.markdown.startswith("```potto\nheight : [2] Real\n```\n\ncolumn of `people.csv`")
    assert "[2] from 1.6 to 1.8, mean 1.7" in hover.markdown
    assert [p.span.start for p in ide.references(library.db, key, at)] == [at, text.rindex("height")]
    refused = ide.rename(library.db, key, at, "size")
    assert refused == ide.Refused("`height` is a column of `people.csv`: rename it there")
