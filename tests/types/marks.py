"""Programs with their expected diagnostics written under the code.

    def f(t)
        integral [0, 1] (if x < t then 1 else 0) d(x)
        #                   ^^^^^ error[P0301]: depends on the variable

A mark underlines exactly the place of a diagnostic and gives a part of its message. All errors and warnings must be
marked; hints only where a mark says so. `# file: name.po` starts another file.
"""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass

from potto.diagnostics import Diagnostic
from potto.modules.misread import syntax_diagnostics
from potto.modules.texts import StatementRef, chunk_start, names, statements
from potto.query import Database
from potto.source import SourceText
from potto.types import Typed, check_definition, check_statement, format_type, interface, typed_names

FOLDER = "/project/"
_MARK = re.compile(r"^\s*#\s*(?P<carets>\^+) (?P<severity>error|warning|hint)\[(?P<code>P\d{4})\]: (?P<text>.*)$")
_FILE = re.compile(r"^# file: (\S+)$")


@dataclass(frozen=True, order=True)
class Place:
    """A place that a diagnostic or a mark underlines."""

    file: str
    line: int
    column: int
    length: int
    severity: str
    code: str


def project(text: str) -> tuple[dict[str, str], list[tuple[Place, str]]]:
    """The files of a snippet without their marks, and the marks."""
    files: dict[str, list[str]] = {}
    marks: list[tuple[Place, str]] = []
    current = "main.po"
    for line in textwrap.dedent(text).strip("\n").split("\n"):
        named = _FILE.match(line)
        if named:
            current = named.group(1)
            continue
        lines = files.setdefault(current, [])
        found = _MARK.match(line)
        if found:
            carets = found.group("carets")
            column, severity = found.start("carets") + 1, found.group("severity")
            where = Place(current, len(lines), column, len(carets), severity, found.group("code"))
            marks.append((where, found.group("text")))
        else:
            lines.append(line)
    return {name: "\n".join(lines) + "\n" for name, lines in files.items()}, marks


def database(text: str) -> Database:
    """A database with the files of a snippet."""
    db = Database()
    load(db, text)
    return db


def load(db: Database, text: str) -> None:
    for name, content in project(text)[0].items():
        db.set_input(("file", FOLDER + name), content)


def diagnostics(db: Database, file: str = "main.po") -> list[tuple[int, Diagnostic]]:
    """All that the types have to say about a file, with the starts of the chunks."""
    key = FOLDER + file
    found = [(chunk_start(db, key, name), d) for name in names(db, key) for d in check_definition(db, key, name)]
    for ref in statements(db, key):
        assert isinstance(ref, StatementRef)
        found += [(ref.start, d) for d in check_statement(db, key, ref.statement)]
    return found


def check(text: str) -> None:
    """Check that a snippet has exactly the diagnostics that are marked in it."""
    files, marks = project(text)
    db = database(text)
    got: dict[Place, str] = {}
    for name, content in files.items():
        assert not syntax_diagnostics(db, FOLDER + name), syntax_diagnostics(db, FOLDER + name)
        source = SourceText(name, content)
        for start, diagnostic in diagnostics(db, name):
            span = diagnostic.span.shift(start)
            at = source.position(span.start)
            place = Place(name, at.line + 1, at.column + 1, len(span), diagnostic.severity, diagnostic.code)
            got[place] = diagnostic.message
            assert diagnostic.message and diagnostic.label, diagnostic
    wanted = dict(marks)
    shown = {place: message for place, message in got.items() if place.severity != "hint" or place in wanted}
    assert sorted(shown) == sorted(wanted), "\n".join(f"{place}: {message}" for place, message in sorted(got.items()))
    for place, text_part in wanted.items():
        assert text_part in got[place], (text_part, got[place])


def only(text: str) -> Diagnostic:
    """The one error or warning of a snippet's main file."""
    found = [d for _, d in diagnostics(database(text)) if d.severity != "hint"]
    assert len(found) == 1, found
    return found[0]


def type_of(text: str, name: str | None = None, file: str = "main.po") -> str:
    """The printed type of a definition (the last one)."""
    db = database(text)
    key = FOLDER + file
    return format_type(interface(db, key, name or names(db, key)[-1]).type)


def local_types(text: str, name: str | None = None) -> dict[str, str]:
    """The printed types of the names that a definition binds."""
    db = database(text)
    key = FOLDER + "main.po"
    found = typed_names(db, key, name or names(db, key)[-1])
    assert all(isinstance(typed, Typed) for typed in found)
    return {typed.name: format_type(typed.type) for typed in found}
