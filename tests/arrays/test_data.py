"""Files of data in programs: what `load` gives, on the command line, from Python; what an edited file changes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import potto
from potto.__main__ import main


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "people.csv").write_text("height,weight\n1.5,60\n1.75,80\n2,90\n")
    np.save(tmp_path / "grid.npy", np.arange(6.0).reshape(2, 3))
    np.savez(tmp_path / "mesh.npz", corners=np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), h=np.array(0.25))
    (tmp_path / "nested.json").write_text('{"a": [1, 2], "b": 3, "rows": [{"p": {"x": 4}}, {"p": {"x": 5}}]}')
    (tmp_path / "main.po").write_text("""
people = load("people.csv")
grid = load("grid.npy")
mesh = load("mesh.npz")
nested = load("nested.json")
tallest = max h in people.height (h)
def misfit(a, b) sum i in 0..len(people.height)-1 ((people.weight[i] - a - b*people.height[i])^2)
def below(t) integral [0, 3] sum h in people.height ([x < h*t]) d(x)
corner = grid[1, 2] + mesh.corners[1, 0] + mesh.h + nested.a[1] + nested.b
last = nested.rows.p.x[1]
""")
    return tmp_path


def test_what_files_hold(folder: Path) -> None:
    module = potto.load(folder / "main.po")
    assert module.tallest.value == 2
    assert module.corner.value == 5 + 1 + 0.25 + 2 + 3
    assert module.last.value == 5
    heights, weights = np.array([1.5, 1.75, 2]), np.array([60.0, 80, 90])
    found = potto.grad(module.misfit, ["a", "b"])(1.0, 2.0)
    rest = weights - 1 - 2 * heights
    assert found.value == pytest.approx((rest**2).sum(), rel=1e-15)
    assert found.tangent == pytest.approx((-2 * rest.sum(), -2 * (rest * heights).sum()), rel=1e-15)
    assert potto.grad(module.below)(0.9).tangent == pytest.approx(heights.sum(), rel=1e-14)


def test_types_come_from_the_file(folder: Path) -> None:
    (folder / "types.po").write_text('grid = load("grid.npy")\ndef row(i) grid[i]\nlast = grid[2, 0]\n')
    workspace = potto.Workspace(folder)
    with pytest.warns(potto.ProgramWarning, match="the index 2 is out of range: the array has 2 elements"):
        module = workspace.module("types")
    assert module.row.type == "(i: Real) -> [3] Real"


def test_an_edited_file_counts_again(folder: Path) -> None:
    workspace = potto.Workspace(folder)
    module = workspace.module("main")
    assert module.tallest.value == 2
    (folder / "people.csv").write_text("height,weight\n1.5,60\n2.25,80\n")
    assert workspace.reload()
    assert module.tallest.value == 2.25
    assert not workspace.reload()


@pytest.mark.parametrize(
    ("name", "content", "code", "place"),
    [
        ("people.csv", None, "P0801", "1:17"),
        ("people.csv", "a,b\n1,2\n3,x\n", "P0803", "1:17"),
        ("people.csv", "a,b\n1,2\n3\n", "P0803", "1:17"),
        ("people.json", "[1, 2", "P0805", "1:17"),
        ("people.docx", "1", "P0802", "1:17"),
    ],
)
def test_what_is_wrong_with_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: str | None, code: str, place: str
) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    (tmp_path / "main.po").write_text(f'people   = load("{name}")\n')
    assert main(["check", str(tmp_path / "main.po")]) == 1
    assert f"main.po:{place}: error[{code}]" in capsys.readouterr().out


def test_data_on_the_command_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "one.csv").write_text("1\n2\n4\n")
    program, table = str(folder / "main.po"), folder / "people.csv"
    assert main(["eval", program, "sum x in xs (x)", "--set", f"xs=@{folder / 'one.csv'}"]) == 0
    assert main(["eval", program, "sum h in hs (h)", "--set", f"hs=@{table}:height"]) == 0
    assert main(["eval", program, "len(t.weight) + k", "--set", f"t=@{table}", "--set", "k=0.5"]) == 0
    assert capsys.readouterr().out.split() == ["7", "5.25", "3.5"]


@pytest.mark.parametrize(
    ("name", "content", "place", "said"),
    [
        ("d.csv", "a,b\n1,2\n3, x\n", "d.csv:3:4", "expected a number"),
        ("d.csv", 'a,b\n"1",2\n"35",x\n', "d.csv:3:6", "expected a number"),
        ("d.csv", "a;b\r\n1;2\r\n3;4\r\nx;5\r\n", "d.csv:4:1", "expected a number"),
        ("d.tsv", "a\tb\n1\t2\n# three\n3\n", "d.tsv:4:1", "expected 2 values"),
        ("d.json", '{"a": [1],\n  "b": [true]}', "d.json:2:3", "expected a number"),
    ],
)
def test_a_bad_row_is_shown_where_it_stands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: str, place: str, said: str
) -> None:
    (tmp_path / name).write_bytes(content.encode())
    program = tmp_path / "main.po"
    program.write_text(f'd = load("{name}")\ndef f(t) d.a[0]*t\n')
    assert main(["check", str(program)]) == 1
    shown = capsys.readouterr().out
    assert f"{place}\n" in shown and said in shown
    assert "P0201" not in shown  # a part of what was not read is nothing that the program does wrong
    found = potto.Workspace(tmp_path)
    with pytest.raises(potto.PottoError, match=name):
        found.module("main")


@pytest.mark.parametrize(
    ("written", "code", "places"),
    [
        ("people.name", "P0332", ["text.po:2:8", "labels.csv:2:6"]),
        ("people.heigth", "P0332", ["text.po:2:8", "labels.csv:2:1"]),
        ("people.height[2]", "P0328", ["text.po:2:15", "`people` is defined here"]),
        ("def f(i) (let xs = people.height in xs[i] + xs[2])", "P0328", ["text.po:2:48", "`xs` has 2 elements"]),
    ],
)
def test_columns_of_text_and_places_beyond_the_end_are_shown_where_they_come_from(
    folder: Path, capsys: pytest.CaptureFixture[str], written: str, code: str, places: list[str]
) -> None:
    (folder / "labels.csv").write_text("# who\nyear,name,height\n1990,anna,1.5\n1991,ben,1.75\n")
    (folder / "text.po").write_text(f'people = load("labels.csv")\n{written}\n')
    assert main(["check", str(folder / "text.po")]) == 1
    shown = capsys.readouterr().out
    assert f"error[{code}]" in shown
    assert all(place in shown for place in places)


def test_what_nothing_reads_of_a_json_file_may_be_null(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "people.json").write_text('[{"height": 1.5, "weight": 60},\n {"height": 2, "weight": null}]')
    (folder / "means.po").write_text("""
people = load("people.json")
def height(t) t*(sum h in people.height (h))/2
""")
    assert float(potto.load(folder / "means.po").height(1.0)) == 1.75
    (folder / "heavy.po").write_text('people = load("people.json")\nheavy = people.weight\n')
    assert main(["check", str(folder / "heavy.po")]) == 1
    shown = capsys.readouterr().out
    assert "heavy.po:2:16: error[P0332]: `weight` of `people.json` has no value in line 2" in shown


def test_a_column_that_nothing_reads_may_lack_values(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The mean of the heights is known, whatever is not of the weights; who asks for these is told the line."""
    (folder / "people.csv").write_text("height,weight\n1.5,60\n1.75,\n2,90\n")
    (folder / "means.po").write_text("""
people = load("people.csv")
def height(t) t*(sum h in people.height (h))/3
""")
    assert float(potto.load(folder / "means.po").height(1.0)) == 1.75
    (folder / "heavy.po").write_text('people = load("people.csv")\nheavy = people.weight\n')
    assert main(["check", str(folder / "heavy.po")]) == 1
    shown = capsys.readouterr().out
    assert "heavy.po:2:16: error[P0332]: the column `weight` of `people.csv` has no value in line 3" in shown
    assert "people.csv:1:8" in shown
    (folder / "rows.po").write_text("""
record Person(height: Real, weight: Real)
people = load("people.csv")
def total(rows: [n] Person) sum p in rows (p.weight)
all = total(people)
""")
    assert main(["check", str(folder / "rows.po")]) == 1
    assert "its column `weight` has no value in line 3" in capsys.readouterr().out
    table = folder / "people.csv"  # not the heights without a word: the weights may be meant
    assert main(["eval", str(folder / "main.po"), "sum h in hs (h)", "--set", f"hs=@{table}"]) == 1
    assert "this is a record `people.csv`" in capsys.readouterr().err


def test_a_table_with_a_column_of_text_is_the_record_of_the_others(folder: Path) -> None:
    (folder / "people.csv").write_text('name,height,weight\nanna,1.5,60\nben,1.75,80\n"de Vries, C.",2,90\n')
    module = potto.load(folder / "main.po")
    assert module.tallest.value == 2
    assert module.misfit(0.0, 40.0).value == 0 + (80 - 70) ** 2 + (90 - 80) ** 2
