"""The form of a recorded session: entries behind prompts, and the answers below them.

Owns `prompted` and `recorded`.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

PROMPT, CONTINUED = "po> ", "... "


class Recorded(Struct, frozen=True):
    """An entry, its line, and its answer; no answer if only the entry was kept."""

    line: int
    text: str
    answer: str


def prompted(text: str) -> str:
    """An entry as a record shows it."""
    return PROMPT + text.rstrip().replace("\n", f"\n{CONTINUED}")


def recorded(text: str) -> Iterator[Recorded]:
    """The entries of a record."""
    start, entry, answer = 0, list[str](), list[str]()
    for number, line in enumerate([*text.splitlines(), PROMPT], 1):
        if line.startswith(PROMPT):
            if entry:
                yield Recorded(start, "\n".join(entry), "\n".join(answer).strip("\n"))
            start, entry, answer = number, [line.removeprefix(PROMPT)], []
        elif entry and not answer and line.startswith(CONTINUED):
            entry.append(line.removeprefix(CONTINUED))
        else:
            answer.append(line)
