"""What is shown and proposed while programs with arrays, records and data are written."""

from __future__ import annotations

from pathlib import Path

import pytest
from ide_fixture import fixture

import potto.ide as ide
from potto.checking.library import Library
from potto.source import Span

HEAD = "record Vec(x: Real, y: Real)\nrecord Camera(eye: Vec, focal: Real)\nfront = Camera(Vec(1, 2), 3)\n"


@pytest.mark.parametrize(
    ("text", "fields"),
    [
        ("k = front.$0", ["eye", "focal"]),
        ("k = front.eye.$0", ["x", "y"]),
        ("k = (front).$0", ["eye", "focal"]),
        ("k = Camera(Vec(1, 2), 3).ey$0", ["eye", "focal"]),
        ("k = Camera(Vec(1, 2), 3).eye.$0", ["x", "y"]),
        ("def f(cs: [n] Camera) cs[0].$0", ["eye", "focal"]),
        ("def f(cs: [n] Camera, i) 2*cs[i + (1)].eye.$0", ["x", "y"]),
        ("def f(cs: [n] Camera) sum c in cs (c.$0)", ["eye", "focal"]),
        ("def f(n) fold c = front for i in 1..n (c.$0)", ["eye", "focal"]),
        ("#> (front).$0", ["eye", "focal"]),
        ("k = front with $0", ["eye", "focal"]),
        ("k = front with fo$0", ["eye", "focal"]),
        ("k = front with ($0)", ["eye", "focal"]),
        ("k = front with (focal = front.eye.x, $0", ["eye"]),
        ("k = front.eye with (x = 2, $0)", ["y"]),
        ("def f(cs: [n] Camera) [c with $0 for c in cs]", ["eye", "focal"]),
        ("def f(xs: [n] (Real, Real)) xs[0].$0", ["x", "y", "0", "1"]),
    ],
)
def test_fields_are_proposed(text: str, fields: list[str]) -> None:
    assert fixture(HEAD + text + "\n").labels() == fields


def test_where_no_field_can_stand() -> None:
    for text in ("k = front with (focal = $0)", "k = (front with focal = 1) + $0", "k = 2 + $0"):
        assert "eye" not in fixture(HEAD + text + "\n").labels() and "front" in fixture(HEAD + text + "\n").labels()
    assert fixture(HEAD + "k = (1 + 2).$0\n").labels() == []


def test_a_field_that_is_taken() -> None:
    f = fixture(HEAD + "k = front with fo$0\n")
    assert f.complete("focal")[1] == HEAD + "k = front with focal = \n"


def test_records_are_types() -> None:
    labels = fixture(HEAD + "def f(c: C$0)\n").labels()
    assert "Camera" in labels and "front" not in labels
    other = "# file: cameras.po\nrecord Camera(focal: Real)\n# file: main.po\nfrom cameras import Camera\n"
    assert "Camera" in fixture(other + "def f(c: $0)\n").labels()


def test_files_and_columns_of_data(tmp_path: Path) -> None:
    (tmp_path / "people.csv").write_text("height,weight\n1.8,80\n")
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "2020.json").write_text("[1]")
    (tmp_path / "notes.txt").write_text("")
    library = Library([tmp_path])

    def labels(text: str) -> list[str]:
        key = library.put(library.key(tmp_path / "main.po"), text.replace("|", ""))
        return [item.label for item in ide.completions(library.db, key, text.index("|")).items]

    assert labels('people = load("|")') == ["people.csv"]
    assert labels('people = load("peo|') == ["people.csv"]
    assert labels('people = load("data/20|")') == ["2020.json"]
    assert labels('people = load("people.csv")\nk = people.|') == ["height", "weight"]
    assert labels('people = load("people.csv")\nk = (people).we|') == ["height", "weight"]


@pytest.mark.parametrize(
    ("text", "label", "active"),
    [
        ("k = Camera($0", "Camera(eye: Vec, focal: Real*) -> Camera", "eye: Vec"),
        ("k = Camera(focal=2, $0)", "Camera(eye: Vec, focal: Real*) -> Camera", "eye: Vec"),
        ("k = front with ($0)", "front with (eye: Vec, focal: Real)", "eye: Vec"),
        ("k = front with (eye = Vec(1, 2), $0)", "front with (eye: Vec, focal: Real)", "focal: Real"),
        ("k = front with (focal = 2*$0)", "front with (eye: Vec, focal: Real)", "focal: Real"),
        ("k = fold $0", "fold state = start for i in lo..hi (step)", "state = start"),
        ("k = fold (x, v) = (1, $0", "fold state = start for i in lo..hi (step)", "state = start"),
        ("k = fold s = 0 for $0", "fold state = start for i in lo..hi (step)", "for i in lo..hi"),
        ("k = fold s = 0 for i in 1..3 ($0)", "fold state = start for i in lo..hi (step)", "(step)"),
        ("k = 1 + sum i in 0..$0", "sum i in lo..hi (body)", "i in lo..hi"),
        ("def f(n) sum i in 0..n ($0)", "sum i in lo..hi (body)", "(body)"),
        ("k = load($0", "load(file) : the name of a file -> a", "file"),
        ("k = dot((1, 2), $0)", "dot(u, v) : ([n] Real, [n] Real) -> Real", "v"),
        ("def f(n) sum i in 0..n (sin($0))", "sin(x: Real*) -> Real", "x: Real*"),
    ],
)
def test_signatures(text: str, label: str, active: str) -> None:
    f = fixture(HEAD + text + "\n")
    found = ide.signature_help(f.db, f.file, f.offset)
    assert found is not None
    signature = found.signatures[found.active]
    assert signature.label == label and signature.active is not None
    span = signature.parameters[signature.active].span
    assert label[span.start : span.end] == active


def test_what_is_finished_has_no_signature() -> None:
    for text in ("k = (fold s = 0 for i in 1..3 (s + i)) + $0", "k = (front with focal = 2) $0", "k = min $0"):
        f = fixture(HEAD + text + "\n")
        assert ide.signature_help(f.db, f.file, f.offset) is None, text


def test_hints_say_sizes_and_records() -> None:
    f = fixture(
        HEAD
        + """
        def f(xs: [n] Real, c: Camera, ys)
            doubled = [2*x for x in xs]
            near = c with focal = 2
            sum d in [near, c] (d.focal) + dot(ys, [1, 2]) + doubled[0]
        table = [[1, 2, 3], [4, 5, 6]]
        def g(xs) xs[0]
        """.replace("\n        ", "\n")
    )
    hints = ide.inlay_hints(f.db, f.file, Span(len(HEAD), len(f.text())))
    shown = {f.text()[: h.offset].split()[-1]: (h.label, [e.text for e in h.edits]) for h in hints}
    assert shown["doubled"] == (": [n] Real", []) and shown["near"] == (": Camera", [])
    assert shown["d"] == (": Camera", []) and shown["table"] == (": [2, 3] Real", [])
    assert shown["ys"] == (": [2] Real*", [": [2] Real*"])
    assert shown["g(xs)"] == ("-> a", [])  # a type that may be any is not written


def test_a_record_is_shown_as_one() -> None:
    f = fixture(HEAD)
    symbols = [(s.name, s.kind) for s in ide.document_symbols(f.db, f.file)]
    assert symbols[:2] == [("Vec", "record"), ("Camera", "record")]
    found = {(f.at(t.span), t.type) for t in ide.semantic_tokens(f.db, f.file)}
    assert ("Camera", "type") in found and ("front", "variable") in found
    item = next(i for i in ide.completions(f.db, f.file, len(f.text())).items if i.label == "Camera")
    assert item.kind == "record"
