"""The page of each kind of diagnostic, shipped with Potto: what it means, a wrong program and a right one.

Owns finding and reading the pages (`docs/errors/P*.md`, in an installed Potto `potto/_docs/errors`).
"""

from __future__ import annotations

import re
from pathlib import Path

from msgspec import Struct

HERE = Path(__file__).resolve().parent.parent
FOLDERS = (HERE / "_docs" / "errors", HERE.parent / "docs" / "errors")  # installed; in a clone


TOPICS = ("limits",)  # pages beside those of codes


class Example(Struct, frozen=True):
    """A program of a page. `heading` is what it stands under: `Wrong`, `Right`, `Wrong (run)`, …"""

    heading: str
    text: str

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """The program's files, by their `# file: name` lines; `main.po` alone if there are none."""
        parts = re.split(r"(?m)^# file: *(\S+) *\n", self.text)
        if len(parts) == 1:
            return (("main.po", self.text),)
        return tuple(zip(parts[1::2], parts[2::2], strict=True))


class Page(Struct, frozen=True):
    """The page of one code."""

    code: str
    title: str
    text: str

    @property
    def examples(self) -> tuple[Example, ...]:
        found: list[Example] = []
        heading = ""
        block: list[str] | None = None
        for line in self.text.splitlines():
            if block is not None:
                if line.startswith("```"):
                    found.append(Example(heading, "".join(block)))
                    block = None
                else:
                    block.append(line + "\n")
            elif line.startswith("## "):
                heading = line[3:].strip()
            elif line.startswith("```"):
                block = []
        return tuple(found)


def folder() -> Path | None:
    """Where the pages are."""
    return next((place for place in FOLDERS if place.is_dir()), None)


def codes() -> tuple[str, ...]:
    """The codes that have a page."""
    place = folder()
    return () if place is None else tuple(sorted(path.stem for path in place.glob("P[0-9]*.md")))


def page(code: str) -> Page | None:
    """The page of a code, or of a topic; None if there is none."""
    place = folder()
    if place is None or not (re.fullmatch(r"P\d{4}", code) or code in TOPICS):
        return None
    path = (place.parent if code in TOPICS else place) / f"{code}.md"
    if not path.is_file():
        return None
    text = path.read_text(encoding="utf-8")
    first = text.partition("\n")[0].lstrip("# ")
    return Page(code, first.partition(":")[2].strip() or first, text)
