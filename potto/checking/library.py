"""Files and what is wrong with them: a database that reads from disk, for whoever needs no numbers.

Owns `Library`. Everything may be called from several threads.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from functools import lru_cache

from potto.checking.check import diagnostics, errors_of
from potto.checking.spoiled import standing_in_the_way
from potto.diagnostics import declare
from potto.modules import Unreadable, module_diagnostics, names, open_files, source
from potto.modules.files import MAX_BYTES, decode
from potto.modules.import_checks import unreadable
from potto.modules.texts import content
from potto.projects.project import Project, Projects, levelled, problems_of
from potto.projects.settings import DEFAULTS, Settings
from potto.query import Database
from potto.reports.render import Located, ProgramError
from potto.source import NOWHERE, SourceText
from potto.syntax import nodes

NO_PROGRAMS = declare("P0230", "a folder without programs")
NO_SUCH_DEFINITION = declare("P0232", "a name on the command line that the file does not define")
_absolute = lru_cache(maxsize=1024)(os.path.isabs)  # every call asks for the settings of its file


class Library:
    """Programs from disk and from memory, checked."""

    def __init__(self, roots: Sequence[str | os.PathLike[str]] = ()) -> None:
        self.db = Database()
        self.files = open_files(self.db, roots)
        self.projects = Projects()
        for root in self.files.roots:
            self._adopt(root)

    def key(self, path: str | os.PathLike[str]) -> str:
        """How the database calls a file."""
        return self.files.key(path)

    def put(self, key: str, text: str) -> str:
        """Give a file, or a pseudo file such as `<text>`, a text that counts instead of what is on disk."""
        self.files.set_text(key, text)
        return key

    def put_bytes(self, key: str, data: bytes) -> Located | None:
        """The same from bytes; the diagnostic if they are not text."""
        text = decode(data) if len(data) <= MAX_BYTES else Unreadable("too large", f"{len(data):,} bytes")
        if isinstance(text, Unreadable):
            return Located(key, unreadable(text, key, NOWHERE, "standard input"))
        self.put(key, text)
        return None

    def project(self, file: str) -> Project | None:
        """The project of a file, or of the folder that a pseudo file stands for: the first root's."""
        if not _absolute(file):
            file = next(iter(self.files.roots), "")
        return self.projects.of(file)

    def settings(self, file: str) -> Settings:
        """How numbers are asked for in a file where nothing else is said."""
        project = self.project(file)
        return DEFAULTS if project is None else project.settings

    def project_problems(self, file: str) -> tuple[Located, ...]:
        """What is wrong with the project file that counts for a file."""
        project = self.project(file)
        return () if project is None else problems_of(project)

    def _adopt(self, path: str) -> None:
        """Let modules be found in the roots of a file's project."""
        project = self.projects.of(path)
        missing = [] if project is None else [root for root in project.roots if root not in self.files.roots]
        if missing:
            self.files.set_roots([*self.files.roots, *missing])

    def unreadable(self, key: str) -> Located | None:
        """What keeps a file from being read as a program, if anything does."""
        if isinstance(content(self.db, key), str):
            return None
        return Located(key, module_diagnostics(self.db, key)[0])

    def must_exist(self, key: str) -> None:
        """Raise ProgramError if a file cannot be read as a program, or its project file is wrong."""
        self._adopt(key)
        problem = self.unreadable(key)
        problems = self.project_problems(key) if problem is None else (problem,)
        if problems:
            raise ProgramError(problems, self.source)

    def refresh(self) -> bool:
        """Read again what has changed on disk; True if anything had."""
        self.projects.forget()
        return bool(self.files.refresh())

    def stands(self, key: str) -> bool:
        """Whether everything known rests on the text of one pseudo file, and on a project file that has not changed."""
        inputs = set(self.db.input_keys())
        return inputs <= {("roots",), ("overlay", key)} and Projects().of(key) == self.project(key)

    def source(self, file: str) -> SourceText | None:
        """The text of a file."""
        return source(self.db, file)

    def diagnostics(self, file: str) -> tuple[Located, ...]:
        """Everything there is to say about a file, lints as its project says."""
        found, project = diagnostics(self.db, file), self.project(file)
        return found if project is None or not project.lints else tuple(levelled(found, project.lints))

    def all_diagnostics(self, files: Sequence[str]) -> Iterator[tuple[Located, ...]]:
        """The same for many files, one after the other, with the help of other processes if that pays."""
        from potto.crew import Crew, helpers_for

        with Crew(self.db, self.files.roots, files, helpers_for(files)) as crew:
            for file in files:
                while crew.has_found:
                    crew.take()
                crew.leave(file)
                yield self.diagnostics(file)

    def errors(self, file: str) -> tuple[Located, ...]:
        """The errors in a file."""
        return errors_of(diagnostics(self.db, file))

    def has_sound(self, file: str) -> bool:
        """Whether there is a definition in a file that no error spoils."""
        return any(self.is_sound(file, name) for name in names(self.db, file))

    def is_sound(self, file: str, name: str) -> bool:
        """Whether no error spoils what a name means in a file."""
        return not standing_in_the_way(self.db, file, nodes.Name(NOWHERE, name))

    def need(self, file: str, expr: nodes.Expr) -> None:
        """Raise ProgramError if an expression with a file's names in scope leads to a definition with an error."""
        wrong = standing_in_the_way(self.db, file, expr)
        if wrong:
            raise ProgramError(wrong, self.source)
