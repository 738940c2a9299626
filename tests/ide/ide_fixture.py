"""Marked programs for tests of editor features.

    # file: shapes.po
    def disc(x) x
    # file: main.po
    from shapes import disc
    y = di$0sc(1)

`$0` is the cursor; `$<` and `$>` are the ends of a selection. The file with the cursor, else the last one, is the one
that is asked about. Names of files are without their folder on both sides.
"""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from pathlib import Path

import potto.ide as ide
from potto.checking.check import diagnostics
from potto.checking.library import Library
from potto.source import Span

FOLDER = "/nowhere/workspace"
_FILE = re.compile(r"^# file: (\S+)\n", re.MULTILINE)


@dataclass
class Fixture:
    """A workspace in memory, the file that is asked about, and the cursor."""

    library: Library
    file: str
    offset: int
    span: Span
    texts: dict[str, str]

    @property
    def db(self):
        return self.library.db

    def text(self, file: str | None = None) -> str:
        """The text of a file."""
        return self.texts[file or self.file]

    def key(self, name: str) -> str:
        """The key of a file of the fixture."""
        return f"{FOLDER}/{name}"

    def at(self, span: Span, file: str | None = None) -> str:
        """What stands at a place."""
        return self.text(file)[span.start : span.end]

    def find(self, needle: str, by: int = 0) -> int:
        """The offset of a text in the file, some characters into it."""
        return self.text().index(needle) + by

    def after(self, change: ide.Change | ide.Refused | None) -> dict[str, str]:
        """The texts of the files that a change touches, changed."""
        assert isinstance(change, ide.Change), change
        return {Path(f.file).name: edited(self.texts[f.file], f.edits) for f in change.files}

    def errors(self, file: str | None = None) -> list[str]:
        """The codes of the errors in a file."""
        found = diagnostics(self.db, file or self.file)
        return [item.diagnostic.code for item in found if item.diagnostic.severity == "error"]

    def hover(self, needle: str | None = None, by: int = 0) -> str:
        """The hover at the cursor or at a text."""
        found = ide.hover_at(self.db, self.file, self.offset if needle is None else self.find(needle, by))
        return "" if found is None else found.markdown

    def labels(self) -> list[str]:
        """The labels of the completions at the cursor."""
        return [item.label for item in ide.completions(self.db, self.file, self.offset).items]

    def complete(self, label: str) -> tuple[ide.Completion, str]:
        """A resolved completion, and the text of the file when it was taken (snippets as they are)."""
        found = {item.label: item for item in ide.completions(self.db, self.file, self.offset).items}[label]
        item = ide.resolve_completion(self.db, found)
        return item, edited(self.text(), (*item.edits, ide.Edit(item.span, item.insert)))

    def actions(self) -> dict[str, ide.CodeAction]:
        """The actions for the selection (or the cursor), resolved, by title."""
        found = ide.code_actions(self.db, self.file, self.span)
        return {action.title: ide.resolve_code_action(self.db, action) for action in found}

    def act(self, title: str) -> str:
        """The text of the file after an action."""
        action = self.actions()[title]
        assert not action.disabled, action.disabled
        return self.after(action.change)[Path(self.file).name]


def fixture(text: str) -> Fixture:
    """The workspace of a marked program."""
    text = textwrap.dedent(text).strip("\n") + "\n"
    parts = _FILE.split(text)
    given = dict(zip(parts[1::2], parts[2::2])) if len(parts) > 1 else {"main.po": text}
    library = Library([FOLDER])
    asked, offset, span, texts = "", 0, Span(0, 0), {}
    for name, source in given.items():
        file = f"{FOLDER}/{name}"
        plain, marks = unmarked(source)
        texts[file] = plain
        library.files.set_text(file, plain)
        if marks or not asked.endswith("$"):
            asked = file + ("$" if marks else "")
        if marks:
            offset = marks.get("0", marks.get("<", 0))
            span = Span(marks.get("<", offset), marks.get(">", offset))
    folders: dict[str, set[str]] = {}
    for name in given:
        path = Path(FOLDER, name)
        folders.setdefault(str(path.parent), set()).add(path.name)
        if str(path.parent) != FOLDER:
            folders.setdefault(FOLDER, set()).add(path.parent.name + "/")
    for folder, listed in folders.items():
        library.db.set_input(("folder", folder), tuple(sorted(listed)), 1)
    library.files.set_roots([FOLDER])
    return Fixture(library, asked.rstrip("$"), offset, span, texts)


def unmarked(text: str) -> tuple[str, dict[str, int]]:
    """A text without its marks, and their places."""
    marks: dict[str, int] = {}
    while (found := re.search(r"\$([0<>])", text)) is not None:
        marks[found.group(1)] = found.start()
        text = text[: found.start()] + text[found.end() :]
    return text, marks


def edited(text: str, edits) -> str:
    """A text with edits made, which must not overlap."""
    out, at = [], 0
    for edit in sorted(edits, key=lambda e: (e.span.start, e.span.end)):
        assert edit.span.start >= at, "edits overlap"
        out += [text[at : edit.span.start], edit.text]
        at = edit.span.end
    return "".join([*out, text[at:]])
