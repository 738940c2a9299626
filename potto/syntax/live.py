"""Live expressions: comments that ask for a value, `#> e`, and may say which, `#= v`.

Owns `Live` and `live_expressions`.
"""

from __future__ import annotations

import re

from msgspec import Struct

from potto.source import Span
from potto.syntax.tokens import normalized

_ASKED = re.compile(r"^[ \t]*#>[ \t]?(?P<text>[^\n]*)$(?:\n[ \t]*#=[ \t]?(?P<expected>[^\n]*)$)?", re.MULTILINE)


class Live(Struct, frozen=True):
    """One `#> e`: spans are absolute. `span` is from `#>` to its line's end; `text_span` is where e itself stands."""

    span: Span
    text: str
    text_span: Span
    expected: str | None
    expected_span: Span | None


def live_expressions(text: str) -> tuple[Live, ...]:
    """The live expressions of a file, in order. An empty `#>` asks for nothing."""
    out: list[Live] = []
    for found in _ASKED.finditer(normalized(text)):
        written, place = _trimmed(found, "text")
        if not written:
            continue
        start = found.start() + found.group().index("#")
        expected, expected_place = (None, None) if found["expected"] is None else _trimmed(found, "expected")
        out.append(Live(Span(start, place.end), written, place, expected or None, expected_place if expected else None))
    return tuple(out)


def _trimmed(found: re.Match[str], group: str) -> tuple[str, Span]:
    text = found[group]
    start = found.start(group) + len(text) - len(text.lstrip())
    return text.strip(), Span(start, start + len(text.strip()))
