"""Diagnostics on their way to the client: pushed as they are found, or returned when it asks.

Owns `Publisher`. Open files come first, the last edited one in front, then the rest of the workspace. What has not
changed is not sent again. A client that asks by itself (`textDocument/diagnostic`) is pushed nothing.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from potto_lsp import convert, protocol
from potto_lsp.text import DocumentText
from potto_lsp.uris import to_uri

if TYPE_CHECKING:
    from potto.projects.project import Project
    from potto.reports.render import Located
    from potto_lsp.analysis import Analysis
    from potto_lsp.client import Client
    from potto_lsp.documents import Document

TOGETHER = 20  # closed files per step
Notify = Callable[[str, Any], None]


class Report(Struct, frozen=True):
    """What there is to say about a file, as messages. The same `id` means the same messages.

    found: what the checks have said, and what others have.
    """

    found: tuple[tuple[Located, ...], tuple[Located, ...]]
    text: DocumentText
    levels: Mapping[str, str]
    items: list[protocol.Diagnostic]
    id: str


class Publisher:
    """The reports on all files, and which of them the client has. For the thread that owns the database."""

    def __init__(self, analysis: Analysis, client: Client, notify: Notify) -> None:
        self._analysis, self._client, self._notify = analysis, client, notify
        self._reports: dict[str, Report] = {}
        self._sent: dict[str, tuple[str, Document | None]] = {}
        self._ids = itertools.count(1)
        self._wrong_projects: set[str] = set()
        self._shown: set[str] = set()  # files with errors that a client which asks was told of
        self.whole_workspace = True
        self.further: Callable[[str], tuple[Located, ...]] = lambda key: ()  # what others have to say about a file

    def report(self, key: str) -> Report:
        """What there is to say about a file now."""
        from potto.projects.project import levelled

        analysis = self._analysis
        found = checked, further = analysis.diagnostics(key), self.further(key)
        old = self._reports.get(key)
        if old is not None and not checked and not further and not old.items:
            return old  # the usual case: nothing was wrong, and nothing is
        text, levels = analysis.text(key), analysis.levels(key)
        elsewhere = any(located.diagnostic.related for said in found for located in said)  # in files that may differ
        if old is not None and old.found == found and old.text is text and old.levels == levels and not elsewhere:
            return old
        items = convert.diagnostics(analysis, self._client, levelled((*checked, *further), levels), key, text)
        if old is not None and old.items == items:
            new = Report(found, text, levels, old.items, old.id)
        else:
            new = Report(found, text, levels, items, f"potto-{next(self._ids)}")
        self._reports[key] = new
        return new

    def known(self, key: str) -> str:
        """The id of the last report of a file."""
        report = self._reports.get(key)
        return "" if report is None else report.id

    # Pushing

    def steps(self) -> Iterator[Callable[[], None]]:
        """Check the files one by one and push what is new."""
        yield from self._each(1)

    def steps_again(self) -> Iterator[Callable[[], None]]:
        """The same once all files have been checked. Most closed files then take microseconds, so one step handles
        several."""
        yield from self._each(TOGETHER)

    def _each(self, together: int) -> Iterator[Callable[[], None]]:
        for key in list(self._analysis.documents)[::-1]:
            yield lambda key=key: self.push(key)  # type: ignore[misc]
        if not self.whole_workspace:
            return
        closed = [key for key in self._analysis.programs() if key not in self._analysis.documents]
        for first in range(0, len(closed), together):
            yield lambda first=first: self._push_all(closed[first : first + together])  # type: ignore[misc]
        yield self._clear_gone

    def _push_all(self, keys: list[str]) -> None:
        for key in keys:
            self.push(key)

    def push(self, key: str) -> None:
        """Check a file, and send the client whatever is new. After an edit it is always sent: the client has guessed
        where its marks moved."""
        report = self.report(key)
        document = self._analysis.document(key)
        sent = self._sent.get(key)
        if sent is not None and sent[0] == report.id and (document is None or document is sent[1]):
            return
        if sent is None and not report.items and document is None:
            return
        self._sent[key] = (report.id, document)
        if not self._client.pulls:
            self._publish(self._analysis.uri(key), report.items, document)

    def closed(self, document: Document, key: str) -> None:
        """A document was closed. Its URI is cleared, since now the file on disk counts."""
        self._sent.pop(key, None)
        if not self._client.pulls:
            self._publish(document.uri, [], None)

    def _clear_gone(self) -> None:
        programs = set(self._analysis.programs())
        for key in [key for key in self._sent if key not in programs]:
            del self._sent[key]
            self._reports.pop(key, None)
            if not self._client.pulls:
                self._publish(self._analysis.uri(key), [], None)

    def _publish(self, uri: str, items: list[protocol.Diagnostic], document: Document | None) -> None:
        params: dict[str, Any] = {"uri": uri, "diagnostics": items}
        if document is not None and document.version is not None:
            params["version"] = document.version
        self._notify("textDocument/publishDiagnostics", params)

    # Being asked

    def answer(self, key: str, previous: object) -> dict[str, Any]:
        """The answer to `textDocument/diagnostic`."""
        report = self.report(key)
        if report.items:
            self._shown.add(key)
        if previous == report.id:
            return {"kind": "unchanged", "resultId": report.id}
        return {"kind": "full", "resultId": report.id, "items": report.items}

    def workspace_answer(self, key: str, previous: object) -> dict[str, Any]:
        """One file's part of the answer to `workspace/diagnostic`."""
        document = self._analysis.document(key)
        version = None if document is None else document.version
        return {"uri": self._analysis.uri(key), "version": version, **self.answer(key, previous)}

    def gone(self, known: Iterable[str]) -> list[dict[str, Any]]:
        """Empty reports for files that a client knows, or may still show, and that are no longer programs.

        A client that asks for a file one last time before it closes it keeps showing that answer until it hears of the
        file again, without telling us. So files that were deleted or renamed while open are listed every time.
        """
        programs = set(self._analysis.programs())
        keys = [key for key in dict.fromkeys((*known, *sorted(self._shown))) if key not in programs]
        return [{"uri": self._analysis.uri(key), "version": None, "kind": "full", "items": []} for key in keys]

    # Project files

    def push_projects(self, projects: tuple[Project, ...]) -> None:
        """What is wrong with project files. Nobody asks for that, so it is pushed to every client."""
        from potto.projects.project import problems_of

        for project in projects:
            text = DocumentText(project.text, self._analysis.encoding)
            items = convert.diagnostics(self._analysis, self._client, problems_of(project), project.path, text)
            if items or project.folder in self._wrong_projects:
                self._publish(to_uri(project.path), items, None)
        self._wrong_projects = {project.folder for project in projects if project.problems}
