"""Quick fixes for arrays, records and data: the edit that the diagnostic carries makes the program right."""

from __future__ import annotations

from pathlib import Path

import pytest
from ide_fixture import fixture
from test_actions import fixed

import potto.ide as ide
from potto.checking.check import diagnostics
from potto.checking.library import Library
from potto.reports.render import to_json
from potto.source import SourceText, Span

RECORD = "record Camera(eye: (Real, Real), focal: Real)\nfront = Camera(eye=(0, 0), focal=2)\n"


@pytest.mark.parametrize(
    ("text", "title", "after"),
    [
        ("k = [1, 2, 3][$03]", "Write `2`", "k = [1, 2, 3][2]"),
        ("k = [1, 2, 3][$0-1]", "Write `2`", "k = [1, 2, 3][2]"),
        ("k = [1, 2, 3][$0-3]", "Write `0`", "k = [1, 2, 3][0]"),
        ("def f(xs: [n] Real) xs[$0-1]", "Write `len(xs) - 1`", "def f(xs: [n] Real) xs[len(xs) - 1]"),
        ("def f(xs: [n] Real) xs[$0-2]", "Write `len(xs) - 2`", "def f(xs: [n] Real) xs[len(xs) - 2]"),
        ("k = [1, 2, 3][$01.5]", "Write `1`", "k = [1, 2, 3][1]"),
        ("k = [1, 2, 3][$01.5]", "Write `2`", "k = [1, 2, 3][2]"),
        ("def f(xs: [n] Real, i) $0xs(i)", "Write `xs[i]`", "def f(xs: [n] Real, i) xs[i]"),
        ("def f(xs: [n, m] Real) $0xs(0, 1)", "Write `xs[0, 1]`", "def f(xs: [n, m] Real) xs[0, 1]"),
        ("def f(xs: [n] Real) $0xs 0", "Write `xs[0]`", "def f(xs: [n] Real) xs[0]"),
        ("def f(x) $0sin[x]", "Write `sin(x)`", "def f(x) sin(x)"),
        ("def g(a, b) a*b\nk = $0g[1, 2]", "Write `g(1, 2)`", "def g(a, b) a*b\nk = g(1, 2)"),
        ("def f(u: (Real, Real)) $0u[1]", "Write `.1`", "def f(u: (Real, Real)) u.1"),
        ("def f(xs: [n] Real) xs.$00", "Write `[0]`", "def f(xs: [n] Real) xs[0]"),
    ],
)
def test_indices(text: str, title: str, after: str) -> None:
    assert fixed(text + "\n", title) == after + "\n"
    action = fixture(text + "\n").actions()[title]
    assert action.kind == "quickfix"


@pytest.mark.parametrize(
    ("text", "title", "after"),
    [
        ("k = front.$0fokal", "Change to `focal`", "k = front.focal"),
        ("k = (front).$0fokal", "Change to `focal`", "k = (front).focal"),
        ("k = front.$0eyes.x", "Change to `eye`", "k = front.eye.x"),
        ("k = front with $0foca = 3", "Change to `focal`", "k = front with focal = 3"),
        ("k = Camera(eye=(0, 0), $0focel=1)", "Change to `focal`", "k = Camera(eye=(0, 0), focal=1)"),
        ("def f(t, c) t*$0c.focal", "Write `c: Camera`", "def f(t, c: Camera) t*c.focal"),
    ],
)
def test_fields(text: str, title: str, after: str) -> None:
    assert fixed(RECORD + text + "\n", title) == RECORD + after + "\n"
    assert fixture(RECORD + text + "\n").actions()[title].preferred


def test_types() -> None:
    assert fixed("def f(x: $0float) x\n", "Change to `Real`") == "def f(x: Real) x\n"
    assert fixed(RECORD + "def f(c: $0Camra) c.focal\n", "Change to `Camera`") == RECORD + "def f(c: Camera) c.focal\n"
    assert fixed("record P($0x, y: Real)\n", "Write `x: Real`") == "record P(x: Real, y: Real)\n"


def test_a_name_of_elsewhere() -> None:
    assert fixed("def f(x) $0ln(x)\n", "Change to `log`") == "def f(x) log(x)\n"


def test_a_range_that_leads_out_of_an_array() -> None:
    ends = "def f(xs: [n] Real) sum i in {}..{} ({})\n"
    assert fixed(ends.format(0, "n", "xs[$0i]"), "Write `n - 1`") == ends.format(0, "n - 1", "xs[i]")
    assert fixed(ends.format(0, "n-1", "xs[$0i - 1]"), "Write `1`") == ends.format(1, "n-1", "xs[i - 1]")
    assert fixed(ends.format(0, "n-1", "xs[$0n - i]"), "Write `1`") == ends.format(1, "n-1", "xs[n - i]")


def test_no_last_element_where_there_is_none() -> None:
    assert not [title for title in fixture("k = [][$00]\n").actions() if title.startswith("Write")]


def test_an_index_of_what_has_no_name_is_left_to_the_author() -> None:
    f = fixture("def f(xs: [n] Real) (2*xs)[$0-1]\n")
    assert f.errors() == ["P0328"] and not [title for title in f.actions() if title.startswith("Write")]


def offered(library: Library, file: str, text: str) -> dict[str, str]:
    """The quick fixes for every diagnostic of a file, with the text after each."""
    out = {}
    for located in diagnostics(library.db, file):
        span = Span(located.diagnostic.span.start, located.diagnostic.span.start)
        for action in ide.code_actions(library.db, file, span, ("quickfix",)):
            done = ide.resolve_code_action(library.db, action)
            assert done.change is not None
            (edited,) = done.change.files
            after = text
            for edit in sorted(edited.edits, key=lambda e: e.span.start, reverse=True):
                after = after[: edit.span.start] + edit.text + after[edit.span.end :]
            out[action.title] = after
    return out


def test_columns_and_files_of_data(tmp_path: Path) -> None:
    (tmp_path / "people.csv").write_text("height,weight\n1.8,80\n1.6,60\n")
    file = tmp_path / "main.po"
    library = Library()
    library.files.set_roots((str(tmp_path),))
    for text, title, after in (
        ('people = load("people.csv")\nk = people.heigth[0]\n', "Change to `height`", "people.height[0]"),
        ('people = load("poeple.csv")\n', "Change to `people.csv`", 'people = load("people.csv")'),
        ('people = load("./poeple.csv")\n', "Change to `./people.csv`", 'load("./people.csv")'),
    ):
        key = library.put(library.key(file), text)
        found = offered(library, key, text)
        assert after in found[title], (text, found)
        library.put(key, found[title])
        assert not diagnostics(library.db, key)


def test_machines_get_the_edits() -> None:
    f = fixture("def f(xs: [n] Real) $0xs(0)\n")
    (located,) = diagnostics(f.db, f.file)
    shown = to_json(located, lambda _: SourceText("main.po", f.text()))
    place = {"line": 0, "character": 22}, {"line": 0, "character": 23}
    assert shown["suggestions"] == [
        {
            "title": "Write `xs[0]`",
            "edits": [
                {"range": {"start": place[0], "end": place[1]}, "text": "["},
                {"range": {"start": {**place[0], "character": 24}, "end": {**place[0], "character": 25}}, "text": "]"},
            ],
        }
    ]
