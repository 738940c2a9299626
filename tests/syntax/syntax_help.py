"""What the syntax tests share: short ways to parse and to say what is expected."""

from __future__ import annotations

import re
import textwrap

from potto.diagnostics import Diagnostic
from potto.syntax import ParsedChunk, parse_chunk, parse_expression, split
from potto.syntax.nodes import Expr, Item


def item(text: str, diffeo: bool = False) -> Item:
    """The item of a text of one chunk, which must have no errors."""
    (chunk,) = split(text)
    parsed = parse_chunk(chunk.text, diffeo)
    assert parsed.diagnostics == ()
    assert parsed.item is not None
    return parsed.item


def expression(text: str) -> Expr:
    """A text as an expression, which must have no errors."""
    parsed = parse_expression(text)
    assert parsed.diagnostics == ()
    return parsed.expr


def everything(text: str, diffeo: bool = False) -> list[tuple[int, ParsedChunk]]:
    """All chunks of a text, parsed, with their starts."""
    return [(chunk.start, parse_chunk(chunk.text, diffeo)) for chunk in split(text)]


def messages(text: str, diffeo: bool = False) -> list[tuple[Diagnostic, str]]:
    """The diagnostics of a text, each with the text under its span."""
    found = []
    for start, parsed in everything(text, diffeo):
        for diagnostic in parsed.diagnostics:
            place = diagnostic.span.shift(start)
            found.append((diagnostic, text[place.start : place.end]))
    return found


_EXPECTED = re.compile(r"^( *)#( *)(\^+) error\[(P\d{4})\]: (.*)$")


def check_messages(marked: str, diffeo: bool = False) -> None:
    """Carets in a comment under a line say what is wrong there: `# ^^^ error[P0101]: part of the message`.

    The comments are taken out before parsing; the diagnostics must be exactly the expected ones.
    """
    lines: list[str] = []
    expected: list[tuple[int, int, int, str, str]] = []
    for line in textwrap.dedent(marked).strip("\n").split("\n"):
        found = _EXPECTED.match(line)
        if found is None:
            lines.append(line)
            continue
        column = found.start(3)
        expected.append((len(lines) - 1, column, column + len(found[3]), found[4], found[5]))
    text = "\n".join(lines)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line) + 1)
    actual = []
    for start, parsed in everything(text, diffeo):
        for diagnostic in parsed.diagnostics:
            place = diagnostic.span.shift(start)
            row = max(number for number, at in enumerate(starts) if at <= place.start)
            at = place.start - starts[row]
            actual.append((row, at, at + len(place), diagnostic.code, diagnostic.message))
    shown = "\n".join(map(str, actual))
    assert len(actual) == len(expected), f"expected {len(expected)} messages, found:\n{shown}"
    for (row, begin, end, code, message), wanted in zip(sorted(actual), sorted(expected), strict=True):
        assert (row, begin, end, code) == wanted[:4], shown
        assert wanted[4] in message, shown
