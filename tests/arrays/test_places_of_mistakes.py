"""Where an index or a size is wrong at run time: its place in a definition, beside what was evaluated."""

from __future__ import annotations

from pathlib import Path

import pytest

from potto.__main__ import main

PROGRAM = """\
xs = [1, 2, 3]
def pick(ys: [n] Real, i) ys[i] + ys[0]
def same(ys: [n] Real, i) ys[i] + ys[1]
def dots(us: [_] Real, vs: [_] Real) 1 + dot(us, vs)
def plus(us: [_] Real, vs: [_] Real) sum z in us + vs (z)
def outer(i) 2*pick(xs, i)
def under(i, t) integral [0, 1] xs[i]*[x < t] d(x)
def go(i) sum j in 0..i (xs[j])
def stepped(n) fold s = 0 for i in 1..n (s + xs[i])
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "main.po"
    path.write_text(PROGRAM)
    return path


@pytest.mark.parametrize(
    ("expression", "code", "place"),
    [
        ("pick(xs, 7)", "P0511", "2:27"),
        ("outer(7)", "P0511", "2:27"),
        ("same(xs, 7)", "P0511", "3:27"),
        ("dots(xs, [1, 2])", "P0513", "4:42"),
        ("plus(xs, [1, 2])", "P0513", "5:47"),
        ("under(5, 1/2)", "P0511", "7:33"),
        ("D(under, t)(5, 1/2)", "P0511", "7:33"),
        ("D(outer, i)(7)", "P0511", "2:27"),
        ("go(3)", "P0511", "8:26"),
        ("stepped(4)", "P0511", "9:46"),
    ],
)
def test_the_place_in_a_definition(
    program: Path, capsys: pytest.CaptureFixture[str], expression: str, code: str, place: str
) -> None:
    assert main(["eval", str(program), expression]) == 1
    shown = capsys.readouterr().err
    assert f"error[{code}]" in shown
    assert f"main.po:{place}\n" in shown


@pytest.mark.parametrize(("expression", "column"), [("1 + xs[k]*2", 5), ("1 + dot(xs, [i for i in 0..k])", 5)])
def test_the_place_in_the_expression_itself(
    program: Path, capsys: pytest.CaptureFixture[str], expression: str, column: int
) -> None:
    assert main(["eval", str(program), expression, "--set", "k=7"]) == 1
    assert f"<expression>:1:{column}\n" in capsys.readouterr().err


def test_what_a_program_defines_is_shown_where_it_stands(program: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program.write_text("record Camera(focal: Real)\nnear = Camera(focal=1)\n")
    assert main(["eval", str(program), "near with fokal = 3"]) == 1
    shown = capsys.readouterr().err
    assert "<expression>:1:11\n" in shown and "main.po:1:8\n" in shown


def test_in_a_script(program: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script = program.with_name("script.po")
    script.write_text("from main import outer\nk = 9\ndef g(t) t*outer(k)\nprint(g(1))\n")
    assert main(["run", str(script)]) == 1
    shown = capsys.readouterr().err
    assert "script.po:4:7\n" in shown and "main.po:2:27\n" in shown
