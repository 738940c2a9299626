"""What the README and the examples say is so; programs and commands of all pages are in `test_pages`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from potto_lsp.features import FEATURES

from potto.evaluating.world import World

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", ROOT / "ARCHITECTURE.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"(?m)^```{language}\n(.*?)^```", text, re.DOTALL)


PYTHON = [(page.name, block) for page in PAGES for block in blocks(page.read_text(encoding="utf-8"), "python")]


@pytest.mark.parametrize(("page", "block"), PYTHON, ids=lambda item: item[:12])
def test_the_python_of_the_pages_runs(page: str, block: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    for library in ("jax", "optax", "torch"):
        if f"import {library}\n" in block:
            pytest.importorskip(library, reason=f"{library} is not installed: `make test-bridges` runs this")
    exec(compile(block, page, "exec"), {})


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
