"""Where things stand in a text in TOML, of which Python's parser tells the values alone.

Owns `entry_at` and `mistake_at`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from potto.source import Span

_LINE = re.compile(r"[^\n]*\n?")
_HEADER = re.compile(r"\s*\[+\s*(?P<name>[^\]\n]*?)\s*\]")
_MISTAKE = re.compile(r"(?P<what>.*) \(at (?:line (?P<line>\d+), column (?P<column>\d+)|end of document)\)", re.DOTALL)


def entry_at(text: str, table: str, key: str) -> tuple[Span, Span]:
    """The places of a key of a table (empty: the top one) and of its value, as far as that goes on one line.

    A key that is a table itself has the name in its header for both. What is not found stands at the table's own place,
    or at the start.
    """
    quoted = f"(?P<quote>[\"']?)(?P<key>{re.escape(key)})(?P=quote)"
    plain = re.compile(rf"\s*{quoted}\s*(?:\.[^=\n]*)?=\s*(?P<value>[^\n]*)")
    within = re.compile(rf"\s*[\"']?{re.escape(table)}[\"']?\s*[.=].*?(?<![\w-]){quoted}\s*=\s*(?P<value>[^,}}\n]*)")
    header = re.compile(rf"(?:{re.escape(table)}\s*\.\s*)?{quoted}\s*(?:\.|$)" if table else rf"{quoted}\s*(?:\.|$)")
    whole: Span | None = None
    for start, line, section, name in _lines(text):
        if name is not None:
            found = header.match(section)
            if found is not None:
                place = Span(name + found.start("key"), name + found.end("key"))
                return place, place
            if section == table:
                whole = Span(name, name + len(section))
            continue
        found = plain.match(line) if section == table else within.match(line) if table and not section else None
        if found is not None:
            return Span(start + found.start("key"), start + found.end("key")), _value(start, found)
    place = whole or Span(0, 0)
    return place, place


def _lines(text: str) -> Iterator[tuple[int, str, str, int | None]]:
    """The lines of a text: where each starts, itself, the table that it stands in, and, if it is that table's header,
    where the name in it starts."""
    section = ""
    for found in _LINE.finditer(text):
        header = _HEADER.match(found.group())
        if header is not None:
            section = header["name"]
        yield found.start(), found.group(), section, found.start() + header.start("name") if header else None


def _value(start: int, found: re.Match[str]) -> Span:
    """The place of a value: without blanks and a comment behind it, and with its key if there is nothing else."""
    written = re.sub(r"\s+#[^\"']*$", "", found["value"]).rstrip()
    first = found.start("value") if written else found.start("key")
    return Span(start + first, start + max(found.start("value") + len(written), found.end("key")))


def mistake_at(text: str, message: str) -> tuple[str, Span]:
    """What the parser said without the place that it names, and that place: to the end of its line or of the text."""
    found = _MISTAKE.fullmatch(message)
    if found is None:
        return message, Span(0, 0)
    if found["line"] is None:
        return f"{found['what']} at the end of the file", Span(len(text.rstrip()), len(text.rstrip()))
    lines = text.split("\n")
    line = min(int(found["line"]) - 1, len(lines) - 1)
    start = sum(len(before) + 1 for before in lines[:line])
    end = start + len(lines[line].rstrip())
    return found["what"], Span(min(start + int(found["column"]) - 1, end), end)
