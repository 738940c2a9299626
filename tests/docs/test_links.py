"""Every link of the pages leads somewhere: files, pictures, and headings, on the site and where the files themselves
are read. This needs no mkdocs; what it says beyond this is in `test_site`."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CODE, LARGE = ROOT / "potto", ("calculus", "integrate", "runtime")
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]


def prose(page: Path) -> str:
    """Without blocks of code, whose lines may look like headings and links."""
    return re.sub(r"(?ms)^```.*?^```", "", page.read_text("utf-8"))


def targets(page: Path) -> Iterator[tuple[str, str]]:
    """The files and the headings that a page leads to; addresses elsewhere are left out."""
    text = re.sub(r"`[^`\n]*`", "", prose(page))
    found = re.findall(r"\]\(([^)\s]+)\)", text) + re.findall(r'(?:src|srcset|href)="([^"]+)"', text)
    for target in found:
        if not re.match(r"\w+:", target):
            file, _, heading = target.partition("#")
            yield file, heading


def headings(page: Path) -> Iterator[str]:
    for title in re.findall(r"(?m)^#+ (.+)$", prose(page)):
        yield re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title).replace("`", "").strip()


def on_the_site(title: str) -> str:
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode()
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", plain).strip().lower())


def in_the_repository(title: str) -> str:
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for file, heading in targets(page):
        there = (page.parent / file).resolve() if file else page
        assert there.exists(), file
        if heading:
            titles = list(headings(there))
            for slug in (on_the_site, in_the_repository):
                assert heading in map(slug, titles), f"{file}#{heading}"


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent.name != "errors"], ids=lambda page: page.name)
def test_code_that_pages_name_is_there(page: Path) -> None:
    """`integrate/plan`, `rules/jets.py`, `calculus/solving/solve.factors`: in `potto`, or in one of its large rooms."""
    for room, rest in re.findall(r"`(\w+)/([\w/]+)(?:\.\w+)?`", prose(page)):
        homes = [home / room for home in (CODE, *(CODE / large for large in LARGE)) if (home / room).is_dir()]
        named = [path for home in homes for path in (home / rest, home / f"{rest}.py")]
        assert not named or any(path.exists() for path in named), f"{room}/{rest}"


def test_the_check_itself(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "# One `two`: three\n[a](#one-two-three) [b](gone.md)\n```\n[c](no.md)\n```\n`[d](no.md)` [e](https://x.y)\n"
    )
    assert list(targets(page)) == [("", "one-two-three"), ("gone.md", "")]
    assert (
        [on_the_site(t) for t in headings(page)] == [in_the_repository(t) for t in headings(page)] == ["one-two-three"]
    )
