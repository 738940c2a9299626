"""Every kind of diagnostic has a page, and the programs on the pages do what the pages say."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

import pytest

import potto
from potto import pages
from potto.diagnostics import KINDS, Diagnostic
from potto.pages import Example, Page
from potto.world import World

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
