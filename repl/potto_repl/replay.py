"""Recorded sessions: entered again, and their answers compared with the recorded ones.

Owns `replayed`. Numbers may differ by what their error bars and their
last digits leave open; what was measured (times, evaluations) is not compared.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from msgspec import Struct

from potto_repl.backslash_symbols import readable
from potto_repl.recordings import Recorded, recorded
from potto_repl.respond import respond
from potto_repl.session import Conversation

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?")
_MEASURED = re.compile(
    r".*\b(?:evaluations|recompiled|compiled), .*|(?:quadrature|mc|qmc|exact)\b.*"
    r"|(?:parse|check|compile|link|plan|evaluate|total)\b.*|\d+ kernels? made.*|.*report: .*"
)
_DOUBT = re.compile(r"(?:±|\+/-|error at most) *(\([^)]*\)|[\d.e-]+)")


class ChangedAnswer(Struct, frozen=True):
    """An entry whose answer is another one now."""

    entry: Recorded
    now: str


def replayed(text: str) -> Iterator[tuple[Recorded, ChangedAnswer | None]]:
    """Enter each entry of a record again in a new session, and give what is different now."""
    session = Conversation(["."])
    for entry in recorded(text):
        if re.match(r":(record|rec|quit|q|edit|save|watch)\b", entry.text):
            continue  # it concerns files and terminals, not answers
        now = respond(session, readable(entry.text)).text
        yield entry, None if not entry.answer or same(entry.answer, now) else ChangedAnswer(entry, now)


def same(before: str, now: str) -> bool:
    """Whether two answers agree, up to the digits that hold."""
    lines = [[line.rstrip() for line in text.splitlines() if not _MEASURED.fullmatch(line)] for text in (before, now)]
    return len(lines[0]) == len(lines[1]) and all(map(_same_line, *lines))


def _same_line(before: str, now: str) -> bool:
    if before == now:
        return True
    here, there = _doubt(before), _doubt(now)
    a, b = (_DOUBT.sub("", line) for line in (before, now))
    if _words(a) != _words(b):
        return False
    pairs = zip(_NUMBER.findall(a), _NUMBER.findall(b), strict=True)
    return all(abs(float(x) - float(y)) <= _room(x, here) + _room(y, there) for x, y in pairs)


def _doubt(line: str) -> float | None:
    """The errors that a line names, together."""
    found = [float(number) for error in _DOUBT.findall(line) for number in _NUMBER.findall(error)]
    return sum(found) if found else None


def _room(number: str, doubt: float | None) -> float:
    """How far off a written number may be: its error, and rounding to the digits that hold."""
    unit = _unit(number)
    return unit if doubt is None else doubt + min(unit / 2, 10 * doubt)


def _words(line: str) -> list[str]:
    return _NUMBER.sub("#", line).split()


def _unit(number: str) -> float:
    """One unit of the last written digit after the point, for rounding; 0 for a whole number."""
    mantissa, _, exponent = number.partition("e")
    digits = len(mantissa.partition(".")[2])
    if not digits and not exponent:
        return 0.0
    return float(10.0 ** (int(exponent or 0) - digits)) + 1e-15 * math.fabs(float(number))
