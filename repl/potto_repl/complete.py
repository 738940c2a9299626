"""Completion: what can stand at the cursor, with its type and what it is for.

Owns `candidates`. Knows no terminal. Reads the same queries as hover and the language server, so it may be called from
another thread than the one that evaluates.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass

from potto import pages
from potto.measures import MEASURES
from potto.modules import DefinitionTarget, names
from potto.modules.lookup import find_module, resolve_module
from potto.primitives import PRIMITIVES
from potto.settings import METHODS
from potto.syntax import RESERVED
from potto.types import format_type, interface
from potto_repl import options
from potto_repl.commands.settings import NUMBERS
from potto_repl.documentation import WORDS, described, leading_comment
from potto_repl.registry import COMMANDS, Completes, find
from potto_repl.reply import Refusal
from potto_repl.respond import command_words
from potto_repl.session import Conversation

_WORD = re.compile(r"[^\W\d][\w']*(?:\.[^\W\d][\w']*)*\.?$|_[0-9]*$")
_IMPORT = re.compile(r"^\s*(?:from\s+(?P<module>[\w.]+)\s+import\s+(?:[\w\s,]*,)?\s*\w*|(?:from|import)\s+[\w.]*)$")
PROGRAMS = (".po", ".diffeo")


@dataclass(frozen=True, slots=True)
class Candidate:
    """What could be inserted: it replaces `length` characters before the cursor."""

    text: str
    length: int
    type: str = ""
    doc: str = ""


def candidates(session: Conversation, before: str) -> list[Candidate]:
    """What can stand where the text ends."""
    line = before.rpartition("\n")[2]
    if before.lstrip().startswith(":"):
        return list(_command(session, before.lstrip()))
    imported = _IMPORT.match(line)
    if imported is not None:
        return list(_import(session, line, imported["module"]))
    return list(_names(session, line))


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
            yield from _names(session, text)
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
    found = METHODS if words[0] == "method" else options.choices(words[0]) if words[0] in options.NAMES else ()
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


def _import(session: Conversation, line: str, module: str | None) -> Iterator[Candidate]:
    last = re.split(r"[\s,]+", line)[-1]
    if module is not None:
        file = find_module(session.db, session.file, module)
        for name in names(session.db, file) if file is not None else ():
            if name.startswith(last):
                yield _definition(session, name, DefinitionTarget(file or "", name), len(last))
        return
    seen = set()
    for folder in session.world.files.roots:
        base = os.path.join(folder, *last.split(".")[:-1])
        for name in sorted(os.listdir(base)) if os.path.isdir(base) else ():
            stem, suffix = os.path.splitext(name)
            dotted = ".".join([*last.split(".")[:-1], stem])
            if suffix in PROGRAMS and dotted.startswith(last) and dotted not in seen:
                seen.add(dotted)
                yield Candidate(dotted, len(last), "module")


def _names(session: Conversation, line: str) -> Iterator[Candidate]:
    found = _WORD.search(line)
    word = found[0] if found is not None else ""
    path, dot, last = word.rpartition(".")
    if dot:
        yield from _members(session, path, last)
        return
    if not word:
        return
    seen = set()
    for name, target in session.names().items():
        if name.startswith(word):
            seen.add(name)
            yield _definition(session, name, target, len(word))
    yield from (c for c in _builtins(word) if c.text not in seen)


def _members(session: Conversation, path: str, last: str) -> Iterator[Candidate]:
    file = resolve_module(session.db, session.file, path)
    for name in names(session.db, file) if file is not None else ():
        if name.startswith(last):
            yield _definition(session, name, DefinitionTarget(file or "", name), len(last))


def _definition(session: Conversation, name: str, target: DefinitionTarget | None, length: int) -> Candidate:
    from potto.modules.texts import chunk_text

    if target is None:
        return Candidate(name, length, "module")
    type = format_type(interface(session.db, target.file, target.name).type)
    comment = leading_comment(chunk_text(session.db, target.file, target.name) or "")
    return Candidate(name, length, type, comment.partition("\n")[0])


def _builtins(word: str) -> Iterator[Candidate]:
    for name, entry in sorted(PRIMITIVES.items()):
        if entry.surface and not entry.truth and name.isidentifier() and name.startswith(word):
            yield Candidate(name, len(word), "builtin", entry.doc)
    for name in sorted({*MEASURES, *WORDS, *RESERVED}):
        if name.startswith(word):
            kind = "measure" if name in MEASURES else "word" if name in RESERVED else "builtin"
            yield Candidate(name, len(word), kind, described(name))
