"""Every kind of diagnostic has a page, and the programs on the pages do what the pages say."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

import pytest

import potto
from potto.__main__ import main
from potto.diagnostics import KINDS, Diagnostic
from potto.evaluating.world import World
from potto.reports import pages
from potto.reports.pages import Example, Page
from potto.reports.render import Located

ROOT = Path(__file__).resolve().parents[2]


def import_everything() -> None:
    """So that every kind is declared."""
    for module in pkgutil.walk_packages(potto.__path__, "potto."):
        if module.name != "potto.__main__":
            importlib.import_module(module.name)


import_everything()
PAGES = {code: page for code in pages.codes() if (page := pages.page(code)) is not None}


def test_every_kind_has_a_page_and_every_page_a_kind() -> None:
    assert sorted(KINDS) == sorted(PAGES)


@pytest.mark.parametrize("code", sorted(PAGES))
def test_a_page_is_complete(code: str) -> None:
    page = PAGES[code]
    assert page.text.startswith(f"# {code}: "), "the first line names the code"
    headings = [example.heading for example in page.examples]
    assert any(heading.startswith("Wrong") for heading in headings)
    assert any(heading.startswith("Right") for heading in headings)
    lead = page.text.partition("\n## ")[0].partition("\n")[2].strip()
    assert len(lead) > 80, "a page says what the diagnostic means before it shows one"


CHECKED = [
    pytest.param(page, example, id=f"{page.code}-{number}-{example.heading}")
    for page in PAGES.values()
    for number, example in enumerate(page.examples)
    if example.heading in ("Wrong", "Right")
]


def found_in(example: Example, folder: Path) -> list[Diagnostic]:
    """The diagnostics of all files of an example, those of its first file first."""
    for name, text in example.files:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    world = World([folder])
    return [
        located.diagnostic
        for name, _ in example.files
        if name.endswith((".po", ".diffeo"))
        for located in world.diagnostics(world.key(folder / name))
    ]


@pytest.mark.parametrize(("page", "example"), CHECKED)
def test_the_programs_of_a_page(page: Page, example: Example, tmp_path: Path) -> None:
    found = found_in(example, tmp_path)
    if example.heading == "Right":
        assert not found, [(d.code, d.message) for d in found]
        return
    severity = KINDS[page.code].severity
    first = next((d for d in found if d.severity == severity), None)
    assert first is not None, f"no {severity}: {[(d.code, d.message) for d in found]}"
    assert first.code == page.code, first.message


def of_pages(suffix: str) -> list[object]:
    return [
        pytest.param(page, example, id=f"{page.code}-{number}-{example.heading}")
        for page in PAGES.values()
        for number, example in enumerate(page.examples)
        if example.heading.endswith(suffix)
    ]


@pytest.mark.parametrize(("page", "example"), of_pages("(run)"))
def test_what_only_shows_when_a_program_runs(page: Page, example: Example, tmp_path: Path) -> None:
    assert not found_in(example, tmp_path), "the checker sees nothing yet"
    world = World([tmp_path])
    said = [event for event in world.run(world.key(tmp_path / example.files[0][0])) if isinstance(event, Located)]
    assert (page.code in [item.diagnostic.code for item in said]) == (example.heading == "Wrong (run)")


@pytest.mark.parametrize(("page", "example"), of_pages("(Python)"))
def test_what_only_shows_from_python(page: Page, example: Example) -> None:
    if example.heading == "Right (Python)":
        exec(example.text, {"potto": potto})
        return
    with pytest.raises(potto.PottoError) as caught:
        exec(example.text, {"potto": potto})
    assert caught.value.diagnostics[0].code == page.code


@pytest.mark.parametrize("page", [page for page in PAGES.values() if "(run)" in page.text], ids=lambda page: page.code)
def test_the_right_programs_of_such_pages_run_without_a_word(page: Page, tmp_path: Path) -> None:
    for example in page.examples:
        if example.heading == "Right":
            found_in(example, tmp_path)
            world = World([tmp_path])
            events = list(world.run(world.key(tmp_path / example.files[0][0])))
            assert not [event for event in events if isinstance(event, Located)]


def test_a_budget_that_is_too_small_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """P0501, whose page shows a command."""
    waves = tmp_path / "waves.po"
    waves.write_text("def wave(t)\n    integral [0, 1] sin(1e5*t*x)/(x + 0.001) d(x)\n")
    assert main(["eval", str(waves), "wave(3)", "--max-evals", "100"]) == 0
    assert "warning[P0501]" in capsys.readouterr().err


@pytest.mark.parametrize(("written", "status"), [("0.34", 1), ("0.33", 0)])
def test_a_live_expression_holds_to_the_digits_that_were_written(written: str, status: int, tmp_path: Path) -> None:
    """P0530, whose page shows a command."""
    thirds = tmp_path / "thirds.po"
    thirds.write_text(f"def third(x) x/3\n#> third(1)\n#= {written}\n")
    assert f"#= {written}" in PAGES["P0530"].text
    assert main(["test", str(thirds)]) == status
