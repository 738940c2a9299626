"""`potto explain`: the long text of a diagnostic."""

from __future__ import annotations

import argparse
import difflib
from typing import TYPE_CHECKING, Any

from potto.cli.console import Console, wants_color

if TYPE_CHECKING:
    from potto.reports.pages import Page

SUMMARY = "what a diagnostic means, with a wrong and a right program"
EXAMPLE = "  potto explain P0301\n  potto explain limits"


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("codes", nargs="*", metavar="CODE", help="such as P0301, or `limits`; without one, a list")


def run(options: argparse.Namespace, console: Console) -> int:
    from potto.reports import pages

    wanted = [code.lower() if code.lower() in pages.TOPICS else code.upper() for code in options.codes]
    if not wanted:
        return _list(options, console)
    found = [page for page in map(pages.page, wanted) if page is not None]
    missing = [code for code in wanted if code not in {page.code for page in found}]
    for code in missing:
        near = difflib.get_close_matches(code, pages.codes(), 3)
        hint = f"; similar codes: {', '.join(near)}" if near else "; `potto explain` lists them all"
        console.complain(f"potto explain: there is no diagnostic {code}{hint}")
    if options.json:
        console.answer_json({"pages": [_page_json(page) for page in found]})
    else:
        bold = wants_color(options.color, console.out)
        console.answer("\n".join(_for_people(page.text, bold) for page in found)) if found else None
    return 2 if missing else 0


def _list(options: argparse.Namespace, console: Console) -> int:
    from potto.reports import pages

    found = [page for page in map(pages.page, pages.codes()) if page is not None]
    if options.json:
        console.answer_json({"codes": [{"code": page.code, "title": page.title} for page in found]})
    else:
        console.answer("\n".join(f"{page.code}  {page.title}" for page in found))
    return 0


def _page_json(page: Page) -> dict[str, Any]:
    return {
        "code": page.code,
        "title": page.title,
        "text": page.text,
        "examples": [{"heading": example.heading, "program": example.text} for example in page.examples],
    }


def _for_people(text: str, bold: bool) -> str:
    """Markdown as a terminal shows it: headings stand out, programs are indented, fences are gone."""
    on, off = ("\x1b[1m", "\x1b[0m") if bold else ("", "")
    lines, inside = [], False
    for line in text.rstrip("\n").split("\n"):
        if line.startswith("```"):
            inside = not inside
        elif inside:
            lines.append(f"    {line}".rstrip())
        elif line.startswith("#"):
            lines.append(f"{on}{line.lstrip('# ')}{off}")
        else:
            lines.append(line)
    return "\n".join(lines)
