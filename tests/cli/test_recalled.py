"""What commands know of programs from before: told without a look at texts that stay the same, and only then."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from command_runs import Potto, Ran

from potto.checking.library import Library

LOADED = "import sys; from potto.__main__ import main; main(sys.argv[1:]); print(*sys.modules)"
AREA = """
from shapes import width
def area(t)
    integral [0, 1] [x < width(t)] d(x)
"""
WIDTH = "def width(t) t/2"


def _without_times(answer: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in answer.items() if "seconds" not in key}


COMMANDS = (
    ("eval", "main.po", "deriv(area)((0.5, 1))"),
    ("deriv", "main.po", "area"),
    ("deriv", "main.po", "area", "--typeset"),
    ("check", "main.po", "shapes.po"),
)


@pytest.mark.parametrize("form", [(), ("--json",)])
@pytest.mark.parametrize("command", COMMANDS)
def test_the_same_is_told_without_a_look_at_the_text(
    potto: Potto, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...], form: tuple[str, ...]
) -> None:
    def told(ran: Ran) -> Any:
        return _without_times(ran.json) if form else (ran.status, ran.out, ran.err)

    first = potto(*command, *form, main=AREA, shapes=WIDTH)
    assert first.status == 0
    monkeypatch.setattr(Library, "__init__", None)  # whoever makes one fails
    assert told(potto(*command, *form)) == told(first)


def test_a_second_process_loads_no_syntax(potto: Potto, tmp_path: Path) -> None:
    command = "eval", "main.po", "area(0.5)"
    assert potto(*command, main=AREA, shapes=WIDTH).out == "0.25\n"
    ran = subprocess.run([sys.executable, "-c", LOADED, *command], capture_output=True, text=True, check=True)
    answer, loaded = ran.stdout.splitlines()
    assert answer == "0.25"
    assert "numpy" in loaded.split()
    assert not [name for name in loaded.split() if name.startswith(("potto.syntax", "potto.modules", "lark"))]


@pytest.mark.parametrize(
    "changed, answer",
    [
        ({"shapes": "def width(t) t/4"}, "0.125"),  # of what is imported
        ({"main": AREA + "def other() 1\n"}, "0.25"),
        ({"main": "def area(t) 3*t"}, "1.5"),
    ],
)
def test_an_edit_is_seen(potto: Potto, changed: dict[str, str], answer: str) -> None:
    command = "eval", "main.po", "area(0.5)"
    assert potto(*command, main=AREA, shapes=WIDTH).out == "0.25\n"
    assert potto(*command, **changed).out == f"{answer}\n"
    assert potto(*command, main=AREA, shapes=WIDTH).out == "0.25\n"


def test_an_error_that_appears_is_told(potto: Potto) -> None:
    for command in COMMANDS:
        assert potto(*command, main=AREA, shapes=WIDTH).status == 0
        assert potto(*command, shapes="def width(t) u").status == 1


def test_a_file_that_appears_where_an_import_looks_first_is_seen(potto: Potto, tmp_path: Path) -> None:
    (tmp_path / "near").mkdir()
    (tmp_path / "near" / "main.po").write_text("from shapes import width\ndef f(t) width(t)\n")
    command = "eval", "near/main.po", "f(1)"
    assert potto(*command, shapes=WIDTH).out == "0.5\n"
    (tmp_path / "near" / "shapes.po").write_text("def width(t) 7*t\n")
    assert potto(*command).out == "7\n"


def test_a_file_that_is_gone_is_missed(potto: Potto, tmp_path: Path) -> None:
    command = "eval", "main.po", "area(0.5)"
    assert potto(*command, main=AREA, shapes=WIDTH).status == 0
    (tmp_path / "shapes.po").unlink()
    assert potto(*command).status == 1


def test_data_that_changes_is_seen(potto: Potto, tmp_path: Path) -> None:
    data = tmp_path / "heights.csv"
    command = "eval", "main.po", "total()"
    data.write_text("height\n1\n2\n")
    program = 'heights = load("heights.csv")\ndef total() sum k in 0..1 (heights.height[k])\n'
    assert potto(*command, main=program).out == "3\n"
    data.write_text("height\n1\n5\n")
    assert potto(*command).out == "6\n"


def test_the_project_counts(potto: Potto, tmp_path: Path) -> None:
    """A lint that a project switches on is told, though nothing was said before."""
    program = "def f(unused, t) t\n"
    project = tmp_path / "potto.toml"
    project.write_text('[lints]\nP0620 = "off"\n')
    assert "no problems" in potto("check", "main.po", main=program).err
    project.write_text('[lints]\nP0620 = "warning"\n')
    ran = potto("check", "main.po")
    assert "P0620" in ran.out or "no problems" in ran.err
    project.write_text("nonsense = 1\n")
    assert "P0231" in potto("check", "main.po").out


def test_other_settings_count(potto: Potto) -> None:
    command = "eval", "main.po", "f(1)"
    main = "def f(t) integral [0, 1] exp(t*x) d(x)\n"  # e - 1
    assert potto(*command, "--json", main=main).json["method"] == "quadrature"
    ran = potto(*command, "--json", "--method", "mc", "--samples", "1000").json
    assert ran["method"] == "mc" and abs(ran["value"] - 1.718281828459045) <= ran["error"] < 0.2


def test_names_of_fields_are_told_again(potto: Potto) -> None:
    """The name of a record's field is not kept: where a remark has one, the text is read for it."""
    main = """
record Ball(centre: Real, radius: Real)
def inside(b: Ball)
    integral [0, 1] [x < b.radius] d(x)
"""
    ball = "Ball(centre=0, radius=1)"
    command = "eval", "main.po", f"deriv(inside)(({ball}, {ball}))"
    for _ in range(2):
        ran = potto(*command, main=main)
        assert ran.out == "(1, 0)\n"
        assert "the surface x = b.radius lies on a bound" in ran.err
