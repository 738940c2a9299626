"""The programs and commands that the pages show do what the pages say; what the README shows is tested beside this."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from potto.__main__ import main
from potto.cli import COMMANDS
from potto.cli.command_line import dispatch
from potto.evaluating.world import World
from potto.types import format_type, interface

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
NOT_PROGRAMS = "lsp.md"  # whose blocks are answers, and are held against those of the server
LAMP = r"""
lin = \x . x
def light(angle, height) height*cos(angle)
def loss(angle, height, shader) (angle - 0.5)^2 + (shader(height) - 2)^2
"""
MEASURED = "height,brightness\n1,0.8\n2,1.6\n3,2.4\n"


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"(?m)^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL)


PROGRAMS = [
    pytest.param(block, id=f"{page.stem}-{number}")
    for page in PAGES
    if page.name != NOT_PROGRAMS
    for number, block in enumerate(blocks(page, "potto"))
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with all files that the pages take for given."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for file in (ROOT / "examples" / "paper").iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "lamp.po").write_text(LAMP, encoding="utf-8")
    (tmp_path / "measured.csv").write_text(MEASURED, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("program", PROGRAMS)
def test_the_programs_of_the_pages_have_no_errors_and_hold(
    program: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "page.po").write_text(program, encoding="utf-8")
    world = World([folder])
    found = [item.diagnostic for item in world.diagnostics(world.key(folder / "page.po"))]
    assert [d.message for d in found if d.severity == "error"] == []
    if "#>" in program:
        assert main(["test", "page.po"]) == 0, capsys.readouterr().err


COMMAND_LINES = [
    line.partition(" #")[0].strip()
    for page in PAGES
    for line in "\n".join(blocks(page, "sh")).splitlines()
    if line.startswith("potto ")
]
LONG = ("potto bench", "potto repl")  # minutes, or a prompt


@pytest.mark.parametrize("line", [line for line in COMMAND_LINES if "FILE" not in line and not line.startswith(LONG)])
def test_the_commands_of_the_pages_run(line: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = main(shlex.split(line)[1:])
    said = capsys.readouterr()
    assert status == 0 or (line.startswith("potto fmt --diff") and said.out), said.err


@pytest.mark.parametrize("line", [line for line in COMMAND_LINES if line.startswith(LONG)])
def test_the_options_of_long_commands_exist(
    line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With `--help` at the end a command line is read up to there, and answers without doing anything."""
    command, *words = shlex.split(line)[1:]
    assert command in COMMANDS
    with pytest.raises(SystemExit) as ended:
        dispatch([command, *words, "--help"])
    assert ended.value.code == 0
    known = set(re.findall(r"(?<!\w)--?[a-z][a-z-]*", capsys.readouterr().out))
    assert {word for word in words if re.fullmatch("--?[a-z].*", word)} <= known


def test_every_command_has_its_line_in_the_table() -> None:
    listed = set(re.findall(r"^\| `potto (\w+)", (ROOT / "docs" / "command-line.md").read_text("utf-8"), re.MULTILINE))
    assert listed == set(COMMANDS)


def test_the_message_of_the_readme_is_that_of_the_command(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "wrong.po").write_text("def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\n")
    (shown,) = re.findall(r"\$ potto check wrong.po\n(.*)\n", PAGES[0].read_text(encoding="utf-8"))
    assert main(["check", "wrong.po"]) == 1
    assert capsys.readouterr().out.startswith(shown + "\n")


def test_the_type_of_the_paper_s_renderer_is_that_of_the_page(folder: Path) -> None:
    world = World([folder])
    type = format_type(interface(world.db, world.key(folder / "renderer.po"), "renderer").type)
    assert f"\n{type}\n" in (ROOT / "docs" / "types.md").read_text(encoding="utf-8")
