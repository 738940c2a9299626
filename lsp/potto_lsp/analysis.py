"""The programs of a session: the database, its files, and what there is to say about each.

Owns `Analysis`. All of it belongs to the one thread that works with the database, see `work`.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from potto.checking.recalled import keep_said, said_earlier
from potto.diagnostics import Diagnostic
from potto.modules import chunk_start, module_diagnostics, names, open_files, source, statements
from potto.modules.graph import dependencies, imported_files
from potto.modules.lookup import bindings
from potto.modules.misread import syntax_diagnostics
from potto.modules.texts import chunk_text, chunks, imports, is_diffeo, parsed, pieces
from potto.projects.project import Project, Projects, read_project
from potto.query import Database
from potto.reports.render import Located
from potto_lsp.documents import Document
from potto_lsp.text import DocumentText, Encoding
from potto_lsp.uris import to_key, to_uri

if TYPE_CHECKING:
    from potto.checking.kept import KeptWorkspace
    from potto.crew import Crew

logger = logging.getLogger(__name__)


# Queries that are forgotten for closed files, by what they take: the text of a chunk, a file, or some definitions.
OF_TEXTS = frozenset({"parsed", "head", "chunk_references", "occurring_names"})
OF_FILES = frozenset({"definition", "core", "core_term"})
OF_GROUPS = frozenset({"_analyses"})
MOST_USERS = 50  # files to prepare because they import a file that was opened


class Analysis:
    """One database and what the client has open."""

    def __init__(self, encoding: Encoding) -> None:
        self.db = Database()
        self.files = open_files(self.db)
        self.encoding = encoding
        self.projects: tuple[Project, ...] = ()
        self._found, self.folders = Projects(), tuple[str, ...]()
        self._settings: Mapping[str, Any] = {}
        self._levels: dict[str, Mapping[str, str]] = {}
        self._documents: dict[str, Document] = {}
        self._texts: dict[str, DocumentText] = {}
        self._failing: dict[tuple[str, str], str] = {}
        self._checked: set[str] = set()  # files asked for; only the first answer may come from an earlier session
        self._ripe: set[str] = set()  # files checked since trees were last forgotten
        self.settled = False  # whether all files have been checked
        self._crew: Crew | None = None
        self._kept: KeptWorkspace | None = None  # what an earlier session has found out, until it is taken over
        self._looked = False  # whether that was looked for
        self.taken: set[str] = set()  # files that helpers or an earlier session have checked
        self.known_before: set[str] = set()  # those of an earlier session

    # What the client has

    @property
    def settings(self) -> Mapping[str, Any]:
        """The client's settings."""
        return self._settings

    @settings.setter
    def settings(self, settings: Mapping[str, Any]) -> None:
        self._settings = settings
        self._levels.clear()

    def set_folders(self, uris: Iterable[str]) -> None:
        """The folders of the workspace; their project files are read."""
        keys = [key for key in map(to_key, uris) if not key.startswith("<")]
        self.folders = tuple(dict.fromkeys(keys))
        self.reload_projects()

    def reload_projects(self) -> None:
        """Read the project files again."""
        self._found.forget()
        self._levels.clear()
        around = [self._found.of(key) or read_project(key) for key in self.folders]
        inside = [self._found.of(key) for key in self._documents]
        self.projects = tuple(
            {project.folder: project for project in (*around, *inside) if project is not None}.values()
        )
        roots = [root for project in self.projects for root in project.roots]
        self.files.set_roots([*roots, *self.folders])

    def put(self, document: Document) -> str:
        """Note that a document was opened or changed. Returns its key."""
        key = to_key(document.uri)
        self._documents.pop(key, None)
        self._documents[key] = document
        self._texts[key] = document.text
        self.files.set_text(key, document.text.text)
        self._tell_crew()
        return key

    def finds_project(self, key: str) -> bool:
        """Whether a file belongs to a project that was not known before."""
        project = self._found.of(key)
        known = project is None or any(project.folder == other.folder for other in self.projects)
        if not known:
            self.reload_projects()
        return not known

    def close(self, document: Document) -> str:
        """Note that a document was closed: from now on the file on disk counts."""
        key = to_key(document.uri)
        self._documents.pop(key, None)
        self._texts.pop(key, None)
        self.files.close(key)
        self._tell_crew()
        return key

    def document(self, key: str) -> Document | None:
        """The open document of a file."""
        return self._documents.get(key)

    @property
    def documents(self) -> Mapping[str, Document]:
        """The open documents by key, the least recently edited first."""
        return self._documents

    def uri(self, key: str) -> str:
        """The URI of a file; for an open one, as the client writes it."""
        document = self._documents.get(key)
        return document.uri if document is not None else to_uri(key)

    def text(self, key: str) -> DocumentText:
        """The text of a file with its lines; an empty one if there is none."""
        document = self._documents.get(key)
        if document is not None:
            return document.text
        found = source(self.db, key)
        written = "" if found is None else found.text
        known = self._texts.get(key)
        if known is None or known.text != written:
            known = self._texts[key] = DocumentText(written, self.encoding)
        return known

    def forget_trees(self) -> None:
        """Forget the trees, terms and analyses of closed files that were checked since the last call. They take most of
        the memory. What was found in them stays, and making them again takes less than a millisecond a definition."""
        closed = self._ripe - self._documents.keys()
        texts = {chunk.text for key in closed for chunk in chunks(self.db, key)}
        texts.difference_update(chunk.text for key in self._documents for chunk in chunks(self.db, key))
        self._ripe.clear()

        def is_closed(query: str, args: tuple[Any, ...]) -> bool:
            if query in OF_GROUPS:
                return all(target.file in closed for target in args[0])
            return args[0] in (texts if query in OF_TEXTS else closed)

        self.db.forget(is_closed, OF_TEXTS | OF_FILES | OF_GROUPS)

    def prepare(self, key: str) -> None:
        """Make the trees of a file that was opened, before the first keystroke asks for them."""
        for chunk in chunks(self.db, key):
            parsed(self.db, chunk.text, is_diffeo(key))

    def prepare_users(self, key: str) -> None:
        """Read and analyse the definitions in other files that use this file, before the first edit of a signature
        needs them all at once."""
        users = [file for file in self.programs() if file != key and key in imported_files(self.db, file)]
        for file in users[:MOST_USERS]:
            bound = {name.partition(".")[0] for item in imports(self.db, file) for name, _ in bindings(item)}
            for name in names(self.db, file):
                text = chunk_text(self.db, file, name) or ""
                if not any(word in text for word in bound):
                    continue  # uses nothing from elsewhere; this needs no tree
                if any(target.file == key for target in dependencies(self.db, file, name)):
                    self._analyse(file, name)

    def _analyse(self, key: str, name: str) -> None:
        from potto.types import check_definition

        try:
            check_definition(self.db, key, name)
        except Exception as error:
            self.failed(key, name, error)

    # What there is to say

    def programs(self) -> tuple[str, ...]:
        """All programs of the workspace and all that are open."""
        return tuple(dict.fromkeys([*self._documents, *self.files.all_files()]))

    def diagnostics(self, key: str) -> tuple[Located, ...]:
        """What is wrong with a file. A bug of ours in one definition loses the diagnostics of that definition only."""
        if not self.settled and key in self._documents and key not in self._checked:
            self._checked.add(key)
            known = said_earlier(self.db, key)
            if known is not None:
                return known
        from potto.checking import check  # slow to import, and not needed for what is known from earlier

        if key not in self.taken:
            self._ripe.add(key)
        try:
            self._share(key)
            return check.diagnostics(self.db, key)
        except Exception:
            from potto.checking.check import arranged

            return tuple(Located(key, said) for said in arranged(self._guarded(key)))

    # Helpers

    def call_helpers(self) -> None:
        """Let helper processes check the ends of open files and then the closed ones, if there is enough for that to
        pay."""
        from potto.crew import Crew, helpers_for

        known = self._documents.keys() | self.taken
        files, texts = [key for key in self.programs() if key not in known], self._open_texts()
        if self._crew is None and (helpers := helpers_for(files, sum(map(len, texts.values())))):
            ends = [(key, text) for key in texts for text in pieces(self.db, key)]
            self._crew = Crew(self.db, self.files.roots, files, helpers, texts, ends)

    def _share(self, key: str) -> None:
        """Check a file together with the helpers: if it is open, piece by piece, from its start here and from its end
        there."""
        from potto.checking.check import check_ahead

        crew = self._crew
        if crew is None:
            return
        crew.leave(key)
        for text in pieces(self.db, key) if key in self._documents and not self.settled else ():
            crew.leave(key, text)
            while crew.has_found:
                self.take_over()
            check_ahead(self.db, key, text)

    def _tell_crew(self) -> None:
        if self._crew is not None:
            self._crew.texts = self._open_texts()

    def _open_texts(self) -> dict[str, str]:
        return {key: document.text.text for key, document in self._documents.items()}

    @property
    def helpers(self) -> tuple[int, ...]:
        """The ids of the processes that help now."""
        return () if self._crew is None else self._crew.processes

    @property
    def helpers_have_found(self) -> bool:
        """Whether the helpers have results to take over."""
        return self._crew is not None and self._crew.has_found

    def take_over(self) -> None:
        """Take over what a helper found out about one file."""
        file = None if self._crew is None else self._crew.take()
        if file is not None:
            self.taken.add(file)

    def dismiss_helpers(self) -> None:
        """End the helpers: there is nothing left for them to do."""
        if self._crew is not None:
            self._crew.close()
        self._crew = None

    # Earlier and later sessions

    def look_for_kept(self) -> None:
        """Look for what an earlier session has found out about the workspace."""
        from potto.checking.kept import KeptWorkspace

        if not self._looked:
            self._kept, self._looked = KeptWorkspace(self.db, self.files.roots), True

    @property
    def has_kept(self) -> bool:
        """Whether there is more of that to take over."""
        return self._kept is not None and self._kept.is_left

    def take_kept(self) -> None:
        """Take over a part of it."""
        file = self._kept.take() if self._kept is not None else None
        if file is not None:
            self.taken.add(file)
            self.known_before.add(file)
        if not self.has_kept:
            self._kept = None

    def take_all_kept(self) -> None:
        """Take over all that is left of it."""
        while self.has_kept:
            self.take_kept()

    def keep_all(self, kept: Callable[[], None]) -> Iterator[Callable[[], None]]:
        """The steps by which what is known of the workspace is kept for later sessions. `kept` is called if nothing has
        come between them."""
        from potto.checking.kept import Keeper, Part, parts_of

        keeper = Keeper(self.db, self.files.roots)

        def add(part: Part) -> None:
            try:
                keeper.add(part)
            except Exception as error:
                self.failed(part[0], "keeping", error)

        def finish() -> None:
            if keeper.finish():
                kept()

        for file in self.programs():
            for part in parts_of(self.db, file):
                yield lambda part=part: add(part)  # type: ignore[misc]
        yield finish

    def keep(self, key: str) -> None:
        """Keep what was found out about a file for later sessions."""
        try:
            keep_said(self.db, key)
        except Exception as error:
            self.failed(key, "verdict", error)

    def _guarded(self, key: str) -> list[Diagnostic]:
        """The diagnostics of a file, part by part. A part that fails is logged, once for each error message."""
        from potto.checking.check import absolute, definition_diagnostics, statement_diagnostics

        db, found = self.db, list[Diagnostic]()
        for part in (syntax_diagnostics, module_diagnostics):
            try:
                found += part(db, key)
            except Exception as error:
                self.failed(key, part.__name__, error)
        for name in names(db, key):
            try:
                start = chunk_start(db, key, name)
                found += [absolute(db, key, said, start) for said in definition_diagnostics(db, key, name)]
            except Exception as error:
                self.failed(key, name, error)
        for reference in statements(db, key):
            try:
                found += statement_diagnostics(db, key, reference)
            except Exception as error:
                self.failed(key, "statement", error)
        return found

    def failed(self, key: str, name: str, error: Exception) -> None:
        """A check failed because of a bug of ours. Each message is logged once."""
        told = f"{type(error).__name__}: {error}"
        if self._failing.get((key, name)) != told:
            self._failing[key, name] = told
            logger.error("the check of %s in %s failed", name, key, exc_info=error)

    def levels(self, key: str) -> Mapping[str, str]:
        """The levels of lints in a file: the client's settings, then the innermost project."""
        levels = self._levels.get(key)
        if levels is None:
            project, lints = self._found.of(key), self._settings.get("lints")
            levels = {**(project.lints if project is not None else {}), **(lints if isinstance(lints, Mapping) else {})}
            self._levels[key] = levels
        return levels
