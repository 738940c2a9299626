"""What the README and the examples say is so."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from potto_lsp.features import FEATURES

from potto.__main__ import main
from potto.world import World

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", ROOT / "ARCHITECTURE.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"(?m)^```{language}\n(.*?)^```", text, re.DOTALL)


@pytest.mark.parametrize("number", range(len(blocks(README, "potto"))))
def test_the_programs_of_the_readme_hold(number: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "readme.po"
    file.write_text(blocks(README, "potto")[number], encoding="utf-8")
    assert main(["test", str(file)]) == 0, capsys.readouterr().err


PYTHON = [(page.name, block) for page in PAGES for block in blocks(page.read_text(encoding="utf-8"), "python")]


@pytest.mark.parametrize(("page", "block"), PYTHON, ids=lambda item: item[:12])
def test_the_python_of_the_pages_runs(page: str, block: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    exec(compile(block, page, "exec"), {})


def commands() -> list[str]:
    lines = "\n".join(blocks(README, "sh")).splitlines()
    return [line.partition(" #")[0] for line in lines if line.startswith("potto ") and "FILE" not in line]


@pytest.mark.parametrize("command", commands())
def test_the_commands_of_the_readme_run(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")  # some of them write files
    monkeypatch.chdir(tmp_path)
    status = main(shlex.split(command)[1:])
    said = capsys.readouterr()
    # `fmt --diff` ends with 1 where the paper's own layout is not ours
    assert status == 0 or (command.startswith("potto fmt") and said.out), said.err


def test_the_paper_is_quoted_to_the_letter() -> None:
    renderer = (ROOT / "examples" / "paper" / "renderer.po").read_text(encoding="utf-8")
    assert renderer.strip() in README


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_files_that_pages_name_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (page.parent / target).exists(), target
    for name in re.findall(r"`((?:potto|docs|examples|tests|lsp|repl)/[\w./-]*)`", text):
        assert "xxx" in name or name in FEATURES or (ROOT / name).exists(), name


EXAMPLES = sorted((ROOT / "examples").rglob("*.po"))


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: str(file.relative_to(ROOT)))
def test_the_examples_have_no_errors(file: Path) -> None:
    world = World([ROOT / "examples"])
    found = world.diagnostics(world.key(file))
    assert not [item.diagnostic.message for item in found if item.diagnostic.severity == "error"]


def test_the_live_expressions_of_the_examples_hold(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["test", str(ROOT / "examples")]) == 0, capsys.readouterr().err


@pytest.mark.slow
def test_the_demo_runs(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    monkeypatch.chdir(ROOT)  # the demo changes the folder; this brings it back
    import demo

    demo.run()
    shown = capsys.readouterr().out
    assert "(0, 0)" in shown and "P0301" in shown and "quadrature" in shown


def test_the_demos_closed_form() -> None:
    """Against mpmath, which integrates over s = x + y with its density."""
    import sys

    import mpmath as mp

    sys.path.insert(0, str(ROOT / "examples"))
    from demo import exact

    k = mp.sqrt(2)

    def value(c: mp.mpf) -> mp.mpf:
        return mp.quad(lambda s: s / (k * (s + c) + 2) ** 2, [-c, 1]) + mp.quad(
            lambda s: (2 - s) / (k * (s + c) + 2) ** 2, [1, 2]
        )

    mp.mp.dps = 25
    got, slope = exact(-0.7)
    assert abs(got - value(mp.mpf("-0.7"))) < 1e-15 and abs(slope - mp.diff(value, mp.mpf("-0.7"))) < 1e-14
