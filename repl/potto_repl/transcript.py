"""A session as a program: definitions, and what was asked as live expressions that `potto test` runs again.

Owns `program`. A file defines a name once: a definition that a later entry shadows gets another name, in its own text
and in those that use it. An answer that later entries use becomes a definition.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator

from potto.evaluating.session import Defined, Imported, Valued
from potto.integrate.events import ROUGH
from potto.modules import statements
from potto.modules.texts import chunks
from potto.syntax import nodes, tokenize
from potto_repl.session import Conversation, Entry, plain_names

_ANSWER = re.compile(r"_([0-9]*)$")


def program(session: Conversation, folder: str) -> tuple[str, list[str]]:
    """The text of a file in a folder that contains what was entered, and anything its reader should know."""
    notes: list[str] = []
    lines: list[str] = []
    for file in session.loaded:
        brought = _loaded(session, file, folder)
        if brought is None:
            notes.append(f"{file} lies outside of {folder}: its names are not imported")
        elif brought:
            lines.append(brought)
    writer = _Writer(session)
    for entry in session.entries:
        if any(isinstance(o, Defined | Imported | Valued) for o in entry.outcomes):
            lines += writer.entry(entry)
    return "\n\n".join(lines) + "\n", notes


def _loaded(session: Conversation, file: str, folder: str) -> str | None:
    """The import that brings what `:load` brought; None where the file cannot be imported from the folder."""
    from potto.modules import names

    relative = os.path.relpath(file, folder)
    stem = os.path.splitext(relative)[0]
    parts = stem.split(os.sep)
    if not all(part.isidentifier() for part in parts):
        return None
    own = {o.name for entry in session.entries for o in entry.outcomes if isinstance(o, Defined)}
    found = [name for name in names(session.db, file) if name not in own]
    return f"from {'.'.join(parts)} import {', '.join(found)}" if found else ""


class _Writer:
    """Writes entries one by one. `current` says under which name in the file a name of the session is to be found."""

    def __init__(self, session: Conversation) -> None:
        self.session = session
        self.current: dict[str, str] = {}
        self.taken: set[str] = set()
        self.used = self._used_answers()
        self.last_of = self._last_definitions()

    def _last_definitions(self) -> dict[str, str]:
        """The entry that defines each name last: there it keeps its name."""
        return {o.name: e.file for e in self.session.entries for o in e.outcomes if isinstance(o, Defined)}

    def _used_answers(self) -> set[int]:
        """The entries whose answers later ones use, as `_` or by number."""
        used: set[int] = set()
        last = 0
        for entry in self.session.entries:
            for token in tokenize(plain_names(entry.text)):
                found = _ANSWER.fullmatch(token.text)
                if found is not None:
                    used.add(int(found[1]) if found[1] else last)
            if any(isinstance(o, Valued) and o.names for o in entry.outcomes):
                last = entry.number
        return used

    def entry(self, entry: Entry) -> Iterator[str]:
        values = iter([o for o in entry.outcomes if isinstance(o, Valued)])
        asked = {ref.start: ref.statement for ref in statements(self.session.db, entry.file)}
        defined = [o.name for o in entry.outcomes if isinstance(o, Defined)]
        before = dict(self.current)
        for name in defined:
            fresh = name if self.last_of[name] == entry.file else self._fresh(name)
            self.current[name] = fresh
            self.taken.add(fresh)
        for chunk in chunks(self.session.db, entry.file):
            statement = asked.get(chunk.start)
            scope = self.current if defined else before
            if statement is None:
                yield self._renamed(chunk.text.strip("\n"), scope)
            elif isinstance(statement, nodes.ExpressionStatement):
                value = next(values, None)
                if value is not None:
                    yield self._live(entry, chunk.text.strip(), value)
            else:
                yield from self._printed(chunk.text, statement, values)

    def _live(self, entry: Entry, text: str, value: Valued) -> str:
        """An expression with its answer; also a definition if the answer is used later."""
        comments = [token for token in tokenize(text) if token.kind == "COMMENT"]
        lines = [token.text for token in comments if not text[: token.start].rpartition("\n")[2].strip()]
        for token in reversed(comments):
            text = text[: token.start] + text[token.end :]
        one_line = " ".join(self._renamed(text, self.current).split())
        if entry.number in self.used:
            answer = self._fresh(f"answer_{entry.number}")
            self.taken.add(answer)
            self.current[f"_{entry.number}"] = self.current["_"] = answer
            lines.append(f"{answer} = {one_line}\n")
            one_line = answer
        lines.append(f"#> {one_line}")
        expected = _expected(value)
        if expected is not None:
            lines.append(f"#= {expected}")
        return "\n".join(lines)

    def _printed(self, text: str, statement: nodes.Statement, values: Iterator[Valued]) -> Iterator[str]:
        """What prints is kept as it is; its arguments, where they stand at the top, are live expressions."""
        yield self._renamed(text.strip("\n"), self.current)
        if isinstance(statement, nodes.Print):
            next(values, None)

    def _fresh(self, name: str) -> str:
        number, known = 1, self.taken | set(self.last_of)
        while f"{name}_{number}" in known:
            number += 1
        return f"{name}_{number}" if name in known or not name.startswith("answer_") else name

    def _renamed(self, text: str, scope: dict[str, str]) -> str:
        """The text with the names of the session as they are called in the file; names that it binds itself stay."""
        from potto.ide.names.index import index

        pieces, at = [], 0
        for found in index(self.session.db, text, False).occurrences:
            new = scope.get(found.name) if found.binder < 0 and found.role in ("use", "define") else None
            if new is not None and new != found.name:
                pieces += [text[at : found.span.start], new]
                at = found.span.end
        return "".join([*pieces, text[at:]])


def _expected(value: Valued) -> str | None:
    """The digits that hold, as `#=` takes them; None if it is not a number."""
    if not value.estimates or "<" in value.text or "unknown" in value.text or "nan" in value.text:
        return None
    estimate = value.estimates[0]
    if "mc" in estimate.method or ROUGH in estimate.shortfalls or not estimate.converged:
        return None  # it was sampled, or made of what was: another seed, other digits; or it missed its tolerance
    return value.text
