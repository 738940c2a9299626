"""`--set NAME=EXPR`: programs with other values for their names, in every command that evaluates."""

from __future__ import annotations

from pathlib import Path

import pytest

from potto.__main__ import main

PROGRAM = """\
# a scene
c = 1  # grey
def shade(x)
    c*x
def pixel(x, y) shade(x + y)
#> shade(2)
def loss(a) (a - c)^2
"""


@pytest.fixture
def program(tmp_path: Path) -> str:
    path = tmp_path / "scene.po"
    path.write_text(PROGRAM)
    return str(path)


def answered(capsys: pytest.CaptureFixture[str], *words: str, status: int = 0) -> str:
    assert main(list(words)) == status
    found = capsys.readouterr()
    return found.out + found.err


@pytest.mark.parametrize(
    ("given", "value"),
    [
        ([], "2"),
        (["c=3"], "6"),
        (["c=k + 1", "k=4"], "10"),
        (["shade=\\x . 7*x"], "14"),
        (["shade=\\x . c*x^2", "c=5"], "20"),
    ],
)
def test_who_uses_a_name_gets_its_value(
    program: str, capsys: pytest.CaptureFixture[str], given: list[str], value: str
) -> None:
    options = [word for text in given for word in ("--set", text)]
    assert answered(capsys, "eval", program, "shade(2)", *options).strip() == value
    assert Path(program).read_text() == PROGRAM


def test_a_column_is_called_as_the_file_does_or_as_programs_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("people.csv").write_text('# measured\nname,"height (cm)"\n"Ann, B",170\n"Cy ""x""",180\n')
    for column in ("height (cm)", "height_cm"):
        said = answered(capsys, "eval", "sum x in xs (x)", "--set", f"xs=@people.csv:{column}")
        assert said.strip() == "350"


def test_names_without_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert answered(capsys, "eval", "f(2) + k", "--set", "f=\\x . k*x", "--set", "k=3").strip() == "9"


def test_a_script_leaves_a_name_to_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "people.csv").write_text("height,weight\n1.8,80\n1.6,60\n")
    script = tmp_path / "summary.po"
    script.write_text("print(sum h in people.height (h))\nprint(len(xs))\n")
    options = ["--set", f"people=@{tmp_path / 'people.csv'}", "--set", "xs=[1, 2, 3]"]
    assert answered(capsys, "run", str(script), *options).split() == ["3.4", "3"]
    assert "P0201" in answered(capsys, "run", str(script), status=1)


def test_pictures_fits_and_derivatives(program: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import numpy as np

    target = str(tmp_path / "picture.npy")
    answered(capsys, "render", program, "pixel", "--set", "c=2", "--size", "2x2", "-o", target)
    assert np.allclose(np.sort(np.load(target).ravel()), [1, 2, 2, 3])  # 2*(x + y) at the quarters
    assert "a = 4" in answered(capsys, "fit", program, "loss", "a=1", "--set", "c=4")
    assert "interior  2*x*dx" in answered(capsys, "deriv", program, "shade", "--set", "shade=\\x . x^2")


def test_parameters_are_given_by_it_as_well(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "by a: 4" in answered(capsys, "deriv", program, "loss", "--set", "a=3")
    assert "by y: 5" in answered(capsys, "deriv", program, "pixel", "--set", "y=1", "--set", "c=5", "x=0")
    assert "a = 4" in answered(capsys, "fit", program, "\\(a, b) . (a*b - c)^2", "a=1", "--set", "b=2", "--set", "c=8")


TWO = "def line(x, c) c*x\n"


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["render", "line", "--set", "c=2"], "given nothing are: `x`"),  # it is no axis
        (["render", "line", "--set", "c=2", "--axes", "x,c"], "`c` is given a value and is an axis, too"),
        (["render", "line", "--set", "c=2", "--over", "c=0..1"], "`c` is given a value and moves, too"),
        (["render", "line", "c=2", "--set", "c=3"], "`c` is given twice, `2` and `3`"),
        (["render", "line", "--set", "c=2", "--set", "c=3"], "`c` is given twice, `2` and `3`"),
        (["deriv", "line", "c=2", "c=3"], "`c` is given twice, `2` and `3`"),
        (["fit", "line", "c=2", "--with", "c=3"], "`c` is given twice, `2` and `3`"),
        (["render", "line", "--set", "cc=2"], "P0232"),
        (["eval", "line(1, 2)", "--set", "c=3"], "the program has no `c`"),  # nothing asks for it: line binds its own
    ],
)
def test_what_nothing_or_more_than_one_thing_is_meant_by(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: list[str], said: str
) -> None:
    (tmp_path / "two.po").write_text(TWO)
    name, *rest = command
    assert said in answered(capsys, name, str(tmp_path / "two.po"), *rest, status=1)


def test_a_name_that_is_a_parameter_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "two.po").write_text("c = 1\ndef scaled(x) c*x\ndef f(x, c) scaled(x) + c\n")
    assert "give the parameter its value without --set: `c=3`" in answered(
        capsys, "deriv", str(tmp_path / "two.po"), "f", "x=1", "--set", "c=3", status=1
    )
    assert "f = 5" in answered(capsys, "deriv", str(tmp_path / "two.po"), "f", "x=1", "c=2", "--set", "c=3")


def test_live_expressions_with_other_data(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "xs.csv").write_text("7\n8\n")
    path = tmp_path / "mean.po"
    path.write_text("xs = [1, 2, 3]\ndef mean(v: [n] Real) sum x in v (x)/n\n#> mean(xs)\n#= 7.5\n")
    assert "expected 7.5, got 2" in answered(capsys, "test", str(path), status=1)
    assert "all hold" in answered(capsys, "test", str(path), "--set", f"xs=@{tmp_path / 'xs.csv'}")


def test_what_is_wrong_with_a_value(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = answered(capsys, "eval", program, "shade(2)", "--set", "c=1 +", status=1)
    assert "--set c=1 +\n" in said and "<command line>:1:11" in said and "P0101" in said
    said = answered(capsys, "eval", program, "shade(2)", "--set", "c=1 + grey", status=1)
    assert "--set c=1 + grey\n" in said and "<command line>:1:13" in said and "P0201" in said
    # what follows stands in the lines where it was
    said = answered(capsys, "eval", program, "loss(1)", "--set", "shade=\\x . x", "--set", "c=(1, 2)", status=1)
    assert "scene.po:7:" in said


POINTS = """\
record Point(x: Real, y: Real)
def total(ps: [n] Point, k) k*(sum p in ps (p.x*p.y))
"""


def test_a_table_is_an_array_of_records_by_the_names_of_its_columns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("points.po").write_text(POINTS)
    Path("points.csv").write_text("y,x\n2,1\n20,10\n")  # 2 + 200
    Path("more.csv").write_text("x,Y\n2,1\n")
    asked = ("deriv", "points.po", "total", "k=2", "--wrt", "k")
    assert "total = 404" in answered(capsys, *asked, "ps=@points.csv")
    assert "total = 404" in answered(capsys, *asked, "--set", "ps=@points.csv")
    said = answered(capsys, *asked, "ps=@more.csv", status=1)
    assert "`ps` is [n] Point, but what is given has no `y` and has `Y`" in said
    for file, told in (
        ("points.csv", "write its rows, `[Point(x=ps.x[i], y=ps.y[i]) for i in 0..1]`"),
        ("more.csv", "it has no column `y`, which `Point` needs; its columns are `x`, `Y`"),
    ):
        assert told in answered(capsys, "eval", "points.po", "total(ps, 2)", "--set", f"ps=@{file}", status=1)


def test_a_table_stands_for_an_array_of_records_that_the_program_hands_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("points.po").write_text(POINTS + "mine = [Point(0, 0)]\ndef whole(k) total(mine, k)\n")
    Path("points.json").write_text('[{"name": "a", "y": 2, "x": 1}, {"name": "b", "y": 20, "x": 10}]')
    plain = answered(capsys, "deriv", "points.po", "total", "k=2", "--wrt", "k", "ps=@points.json")
    handed_on = answered(capsys, "deriv", "points.po", "whole", "k=2", "--set", "mine=@points.json")
    assert "total = 404" in plain and "whole = 404" in handed_on


def test_a_file_that_is_wrong_is_told_in_the_words_of_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("points.po").write_text(POINTS)
    Path("bad.csv").write_text("x,y\n1,2\n3,abc\n")
    said = answered(capsys, "eval", "points.po", "ps.x[0]", "--set", "ps=@bad.csv", status=1)
    assert "bad.csv: line 3, column `y`" in said and "bad.csv:3:3" in said
    assert "--set ps=@bad.csv\n" in said and "<command line>:1:10" in said and str(tmp_path) not in said
    said = answered(capsys, "deriv", "points.po", "total", "k=2", "ps=@bad.csv:z", "--wrt", "k", status=1)
    assert "| ps=@bad.csv:z\n" in said and "<command line>:1:4" in said and "bad.csv:3:3" in said
