"""The prompt without a terminal: entries from a pipe, a file or the command line, answers to a pipe.

Owns `run` and `entries`. No prompts and no escape codes; results go to one stream, what is wrong to the other; the
first error ends it with status 1 unless it is to keep going. With JSON, each part is one object on one line.
"""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Iterable, Iterator
from typing import TextIO

from potto.syntax import goes_on
from potto_repl.backslash_symbols import readable
from potto_repl.paint import Screen, painted
from potto_repl.reply import Part
from potto_repl.respond import stream
from potto_repl.session import Conversation

PIPE = Screen(answers=False)
_ALONE = re.compile(r":|\S+\?{1,2}\s*$")


def entries(lines: Iterable[str]) -> Iterator[str]:
    """Lines as entries, as soon as each is over: a command is a line; a line in the first column starts a new one,
    unless the one above it ends with an operator or leaves a bracket open.

    Comments above a definition belong to it, and so do the indented lines below.
    """
    pending: list[str] = []
    for raw in lines:
        line = raw.rstrip("\r\n")
        starts = bool(line) and not line[0].isspace() and line[0] not in ")]"
        alone = starts and _ALONE.match(line) is not None
        if starts and pending and not _only_comments(pending) and (alone or not goes_on(_joined(pending), line)):
            yield _joined(pending)
            pending = []
        if alone:
            yield line
        elif line.strip() or pending:
            pending.append(line)
    if pending and not _only_comments(pending):
        yield _joined(pending)


def _only_comments(lines: list[str]) -> bool:
    return all(not line.strip() or line.startswith("#") for line in lines)


def _joined(lines: list[str]) -> str:
    return "\n".join(lines).rstrip()


def run(
    session: Conversation, texts: Iterable[str], out: TextIO, err: TextIO, *, look: Screen = PIPE,
    complain: Screen = PIPE, as_json: bool = False, keep_going: bool = False, load: str | None = None,
) -> int:  # fmt: skip
    """Answer entries one by one and return the exit status. A file that is loaded first only reports what is wrong with
    it."""
    status = 0
    loading = [] if load is None else [f":load {load}"]
    for number, text in enumerate(itertools.chain(loading, texts)):
        failed = False
        for part in stream(session, readable(text)):
            failed = failed or part.is_error
            if number < len(loading) and not part.is_complaint:
                continue
            if as_json:
                _write_json(session, part, out)
            elif part.kind != "tail":
                target = err if part.is_complaint else out
                target.write(painted(part, complain if part.is_complaint else look) + "\n")
                target.flush()
        if failed:
            status = 1
            if not keep_going:
                return status
        if session.leaving:
            break
    return status


def _write_json(session: Conversation, part: Part, out: TextIO) -> None:
    value = part.json()
    if value is not None:
        entry = {"entry": session.number} if session.number else {}
        out.write(json.dumps({**entry, **value}, ensure_ascii=False, default=str) + "\n")
        out.flush()
