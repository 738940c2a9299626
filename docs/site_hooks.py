"""What the site needs beside its pages: one page a diagnostic in the navigation; links out of `docs` as plain text."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
_OUTSIDE = re.compile(r"\[([^\]]*)\]\(\.\./(?!\.)[^)]*\)")

_WORDS = re.compile(r"(?m)^(```\w+) .+$")  # what tests are told of a block, behind its language


def on_config(config: Any) -> Any:
    """Every diagnostic below one heading, by its code."""
    pages = sorted((HERE / "errors").glob("P*.md"))
    config.nav.append({"Diagnostics": [{page.stem: f"errors/{page.name}"} for page in pages]})
    return config


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Programs and pages at the head of the repository are not part of the site."""
    markdown = _WORDS.sub(r"\1", markdown)
    return markdown if "/" in page.file.src_uri else _OUTSIDE.sub(r"\1", markdown)
