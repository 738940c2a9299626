"""Several files in one snippet: `# file: name` begins each; without such a line it is `main.po`."""

from __future__ import annotations

import re
import textwrap

from potto.diagnostics import Diagnostic
from potto.modules import module_diagnostics
from potto.query import Database

FOLDER = "/ws"


def key(name: str) -> str:
    """The key of a file of the snippet; an absolute path stays."""
    return name if name.startswith(("/", "<")) else f"{FOLDER}/{name}"


def world(text: str, roots: tuple[str, ...] = (FOLDER,)) -> Database:
    """A database with the files of a snippet and no disk."""
    db = Database()
    parts = re.split(r"(?m)^# file: *(\S.*?) *\n", textwrap.dedent(text))
    named = list(zip(parts[1::2], parts[2::2])) or [("main.po", parts[0])]
    for name, body in named:
        db.set_input(("file", key(name)), body)
    db.set_input(("roots",), roots)
    db.set_input(("workspace",), tuple(sorted(key(name) for name, _ in named)))
    return db


def edit(db: Database, name: str, old: str, new: str) -> None:
    """Replace a piece of a file that occurs in it once."""
    text = db.get_input(("file", key(name)))
    assert text.count(old) == 1, old
    db.set_input(("file", key(name)), text.replace(old, new))


def said(db: Database, name: str = "main.po") -> list[tuple[str, str]]:
    """Code and underlined text of everything that is said about a file's modules."""
    text = db.get_input(("file", key(name)))
    return [(d.code, text[d.span.start : d.span.end]) for d in module_diagnostics(db, key(name))]


def only(db: Database, name: str = "main.po") -> Diagnostic:
    """The one thing that is said."""
    (found,) = module_diagnostics(db, key(name))
    return found
