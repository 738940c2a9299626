"""Completion: what can stand at the cursor, with its type and purpose.

Owns `candidates`. The arguments of commands are known here; names and words are those that `potto.ide` proposes to
editors. Knows no terminal, and may be called from another thread than the one that evaluates.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator

from msgspec import Struct

from potto.ide import completions, resolve_completion
from potto.projects.settings import CHOICES, METHODS
from potto.reports import pages
from potto_repl import options
from potto_repl.commands.settings import NUMBERS
from potto_repl.documentation import plain
from potto_repl.registry import COMMANDS, Completes, find
from potto_repl.reply import Refusal
from potto_repl.respond import command_words
from potto_repl.session import Conversation

_ASKED = re.compile(r"(?:^(?:from|import)\s+|\bimport\s+|[\w)]\.|~\s*)$")  # behind these there is something to list
MOST_RESOLVED = 200  # proposals whose types are looked up
COMPLETING = "<completing>"  # the pseudo file that what is typed stands in
PROGRAMS = (".po", ".diffeo")


class Candidate(Struct, frozen=True):
    """What can be inserted in place of the `length` characters before the cursor."""

    text: str
    length: int
    type: str = ""
    doc: str = ""


def candidates(session: Conversation, before: str) -> list[Candidate]:
    """What can stand where the text ends."""
    if before.lstrip().startswith(":"):
        return list(_command(session, before.lstrip()))
    return list(_code(session, before))


def _command(session: Conversation, text: str) -> Iterator[Candidate]:
    word = text[1:]
    if not re.search(r"\s", word):
        for entry in COMMANDS.values():
            if entry.name.startswith(word):
                yield Candidate(f":{entry.name}", len(word) + 1, entry.argument, entry.summary)
        return
    head, _ = command_words(text)
    argument = re.split(r"\s+", text, maxsplit=1)[1]
    try:
        entry = find(head)
    except Refusal:
        return
    yield from _argument(session, entry.name, entry.completes, argument)


def _argument(session: Conversation, command: str, kind: Completes, text: str) -> Iterator[Candidate]:
    last = re.split(r"\s+", text)[-1]
    match kind:
        case "file":
            yield from _files(text, everything=command in ("save", "record"))
        case "expression" | "name":
            yield from _code(session, text)
        case "code":
            yield from (Candidate(code, len(last), "", _title(code)) for code in pages.codes()
                        if code.startswith(last.upper()))  # fmt: skip
        case "method":
            yield from (Candidate(name, len(last)) for name in METHODS if name.startswith(last))
        case "command":
            yield from (Candidate(e.name, len(last), e.argument, e.summary) for e in COMMANDS.values()
                        if e.name.startswith(last.lstrip(":")))  # fmt: skip
        case "setting":
            yield from _settings(session, text)


def _title(code: str) -> str:
    page = pages.page(code)
    return page.title if page is not None else ""


def _settings(session: Conversation, text: str) -> Iterator[Candidate]:
    words = re.split(r"[\s=]+", text)
    if len(words) == 1:
        for name in (*NUMBERS, *options.NAMES):
            if name.startswith(words[0]):
                value = getattr(session.settings, name) if name in NUMBERS else options.shown(session.options, name)
                yield Candidate(name, len(words[0]), str(value))
        return
    found = options.choices(words[0]) if words[0] in options.NAMES else CHOICES.get(words[0], ())
    yield from (Candidate(value, len(words[-1])) for value in found if value.startswith(words[-1]))


def _files(text: str, everything: bool) -> Iterator[Candidate]:
    folder, _, start = text.rpartition("/")
    place = os.path.expanduser(f"{folder}/" if folder or text.startswith("/") else ".")
    try:
        found = sorted(os.scandir(place), key=lambda entry: entry.name)
    except OSError:
        return
    for entry in found:
        if not entry.name.startswith(start) or (entry.name.startswith(".") and not start):
            continue
        if entry.is_dir():
            yield Candidate(f"{entry.name}/", len(start), "folder")
        elif everything or entry.name.endswith(PROGRAMS):
            yield Candidate(entry.name, len(start))


def _code(session: Conversation, text: str) -> Iterator[Candidate]:
    """What can stand where a piece of Potto ends: what the editor would propose, as far as it begins like the word."""
    session.put_aside(COMPLETING, text)
    found = completions(session.db, COMPLETING, len(text))
    word = text[found.span.start :]
    everything = word or _ASKED.search(text)
    shown = [item for item in found.items if everything or item.kind == "argument"]
    for number, item in enumerate(shown):
        name = item.insert if item.kind == "symbol" else item.label
        if not (item.filter or item.label).startswith(word.removeprefix("\\")) or item.data[:1] == ("import",):
            continue
        resolved = resolve_completion(session.db, item) if number < MOST_RESOLVED else item
        doc = next((line for line in plain(_prose(resolved.documentation)).splitlines() if line.strip()), "")
        yield Candidate(name, len(word), resolved.detail or resolved.description, doc)


def _prose(markdown: str) -> str:
    """Markdown without its blocks of code, which repeat the type."""
    return re.sub(r"```.*?```", "", markdown, flags=re.DOTALL)
