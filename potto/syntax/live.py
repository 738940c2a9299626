"""Live expressions: comments that ask for a value, `#> e`, and may say which, `#= v`. Like other code, `e` goes on with
the next line, which begins with `#>` as well, behind an operator and within brackets.

Owns `Live` and `live_expressions`.
"""

from __future__ import annotations

import re

from msgspec import Struct

from potto.source import Span
from potto.syntax.chunks import goes_on
from potto.syntax.tokens import normalized

_ASKED = re.compile(r"^[ \t]*#>[ \t]?(?P<text>[^\n]*)$", re.MULTILINE)
_MORE = re.compile(r"\n(?P<blanks>[ \t]*)#>(?P<text>[^\n]*)$", re.MULTILINE)
_EXPECTED = re.compile(r"\n[ \t]*#=[ \t]?(?P<text>[^\n]*)$", re.MULTILINE)


class Live(Struct, frozen=True):
    """One `#> e`: spans are absolute. `span` is from `#>` to the end of its last line; `text_span` is where e itself
    stands. `text` is what stands there, with blanks for each `#>` of a further line: places in it are places there."""

    span: Span
    text: str
    text_span: Span
    expected: str | None
    expected_span: Span | None


def live_expressions(text: str) -> tuple[Live, ...]:
    """The live expressions of a file, in order. An empty `#>` asks for nothing."""
    out: list[Live] = []
    text, at = normalized(text), 0
    while (found := _ASKED.search(text, at)) is not None:
        written, place = _trimmed(found)
        at = found.end()
        if not written:
            continue
        while goes_on(written, " ") and (more := _MORE.match(text, at)) is not None:
            written += f"\n{more['blanks']}  {more['text']}"
            at = more.end()
        written = written.rstrip()
        expected, expected_place = None, None
        below = _EXPECTED.match(text, at)
        if below is not None:
            at = below.end()
            expected, expected_place = _trimmed(below)
        start = found.start() + found.group().index("#")
        span, place = Span(start, place.start + len(written)), Span(place.start, place.start + len(written))
        out.append(Live(span, written, place, expected or None, expected_place if expected else None))
    return tuple(out)


def _trimmed(found: re.Match[str]) -> tuple[str, Span]:
    text = found["text"]
    start = found.start("text") + len(text) - len(text.lstrip())
    return text.strip(), Span(start, start + len(text.strip()))
