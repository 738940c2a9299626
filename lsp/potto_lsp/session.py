"""What a session knows once its client has introduced itself.

Owns `ClientSession`: the client, the analysis, the publisher, the evaluation process and the way back to the client.
Everything but `notify` and `request` belongs to the thread that owns the database.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from potto_lsp import collector
from potto_lsp.client import Client
from potto_lsp.connection import Connection, Reply
from potto_lsp.presenting import Presenter
from potto_lsp.progress import WorkProgress
from potto_lsp.work import REST

if TYPE_CHECKING:
    from potto.query import Database
    from potto.reports.render import Located
    from potto_lsp.colouring import Colours
    from potto_lsp.live import LiveValues

TREES = 50  # checked files after which the trees of closed ones are forgotten
KEPT_ANEW, KEPT_BEFORE = 600.0, 20.0  # seconds until what is known of the workspace is kept again, or tried again


class ClientSession(Connection):
    """One client and what is known of its programs. `load_features` loads all that answers questions."""

    def __init__(
        self,
        client: Client,
        notify: Callable[[str, Any], None],
        request: Callable[[str, Any, Reply | None], None],
        later: Callable[[Callable[[], None]], None],
        load_features: Callable[[], None] = lambda: None,
    ) -> None:
        super().__init__(client, notify, request, later)
        self._features = load_features
        self.presenter = Presenter(self)
        self.tokens: dict[str, Colours] = {}
        self.checked = False
        self._looked = 0.0  # when files of data were looked at
        self.to_prepare: set[str] = set()  # files that were opened
        self._unknown_lints: list[str] = []
        self.to_keep: set[str] = set()  # saved files whose diagnostics are to be kept for later sessions
        self._news = False  # whether there is more to keep of the workspace than is kept
        self._keeping, self._keep_from = False, 0.0  # whether that is done next, and the time before which it is not
        self._progress = WorkProgress(self, "Potto: checking the workspace")

    def load(self) -> Database:
        """Load what the work needs. Runs on the thread that will own the database, after the greeting."""
        with collector.loading():
            from potto_lsp.analysis import Analysis
            from potto_lsp.evaluation import EvaluationQueue
            from potto_lsp.publishing import Publisher

            self.analysis = Analysis(self.client.encoding)
            self.analysis.settings = settings_of(self.client.options)
            self.publisher = Publisher(self.analysis, self.client, self.notify)
            self.evaluator = EvaluationQueue(self.analysis)
            self.publisher.further = self._of_values
            self.set_folders(self.client.folders)
        return self.analysis.db

    @cached_property
    def live(self) -> LiveValues:
        """The values of live expressions. Slow to import, so this waits for the first diagnostics."""
        with collector.loading():
            from potto_lsp.live import LiveValues
        return LiveValues(self)

    def _of_values(self, key: str) -> tuple[Located, ...]:
        """What is to be said about the live expressions of an open file, if it has any."""
        document = self.analysis.document(key)
        return () if document is None or "#>" not in document.text.text else self.live.diagnostics(key)

    def set_folders(self, uris: list[str]) -> None:
        """The folders of the workspace."""
        self.analysis.set_folders(uris)
        self.projects_changed()

    def projects_changed(self) -> None:
        """Tell what is wrong with project files."""
        self.publisher.push_projects(self.analysis.projects)

    def configure(self, settings: Any) -> None:
        """The client's settings under `potto`."""
        self.analysis.settings = settings_of(settings)
        self.publisher.whole_workspace = self.analysis.settings.get("diagnostics.scope") != "openFiles"
        self._tell_unknown_lints()

    def _tell_unknown_lints(self) -> None:
        """Report unknown lint codes in the client's settings, once each."""
        from potto.projects.project import LINTS

        lints = self.analysis.settings.get("lints")
        unknown = [code for code in lints if code not in LINTS] if isinstance(lints, Mapping) else []
        if unknown and unknown != self._unknown_lints:
            told = f"The setting potto.lints has {', '.join(unknown)}; lints are {', '.join(LINTS)}."
            self.notify("window/showMessage", {"type": 2, "message": told})
        self._unknown_lints = unknown

    def idle(self) -> Iterator[Callable[[], None] | None]:
        """The steps of idle work. Yields None once the diagnostics of open files have been sent."""
        keeping, self._keeping = self._keeping, False
        if self.checked:
            opened = len(self.analysis.documents)
            for number, step in enumerate(self.publisher.steps_again()):
                if number == opened:
                    yield None
                    yield collector.tidy
                yield step
            yield None
        else:
            yield from self._first_check()
        for key in [key for key in self.to_prepare if key in self.analysis.documents]:
            yield lambda key=key: self._prepare(key)  # type: ignore[misc]
        for key in [key for key in self.to_keep if key in self.analysis.documents]:
            yield lambda key=key: self._keep(key)  # type: ignore[misc]
        yield self.live.refresh
        if keeping:
            yield from self.analysis.keep_all(self._all_kept)

    def _first_check(self) -> Iterator[Callable[[], None] | None]:
        """The first check of the whole workspace. It may take a while, so it shows progress."""
        if self.publisher.whole_workspace:
            yield self.analysis.look_for_kept
            yield self._call_helpers  # they start while what is open is checked here
        steps = list(self.publisher.steps())
        for number, step in enumerate(steps):
            if number == len(self.analysis.documents):  # open files are done, and questions about them come next
                yield None
                yield self._load_features
                yield from self._take_kept()
                yield from steps[:number]  # what an earlier session found is found again, for the edits to come
            while self.analysis.helpers_have_found:
                yield self.analysis.take_over
            yield step
            self._progress.report(number + 1, len(steps))
            if number % TREES == TREES - 1:
                yield self.analysis.forget_trees
        yield None
        yield self._load_features
        yield self.analysis.forget_trees
        yield self._all_checked
        for key in self.analysis.documents:
            yield lambda key=key: self._keep(key)  # type: ignore[misc]

    def _call_helpers(self) -> None:
        if not self.analysis.has_kept:
            self.analysis.call_helpers()

    def _take_kept(self) -> Iterator[Callable[[], None]]:
        """Take over what an earlier session has found out. Helpers are called for the rest of it."""
        if self.analysis.has_kept:
            while self.analysis.has_kept:
                yield self.analysis.take_kept
            yield self._call_helpers

    def saved(self, key: str) -> None:
        """A file was saved: later sessions begin with it as it is now."""
        self.to_keep.add(key)
        self._news = True

    def keeps_next(self) -> bool:
        """Whether what is known of the workspace is kept after the next check, while nothing is to be done: it takes a
        tenth of the first check."""
        now, whole = time.monotonic(), self.checked and self.publisher.whole_workspace
        self._keeping = whole and self._news and now >= self._keep_from
        if self._keeping:
            self._keep_from = now + KEPT_BEFORE
        return self._keeping

    def _all_kept(self) -> None:
        self._news, self._keep_from = False, time.monotonic() + KEPT_ANEW

    def _prepare(self, key: str) -> None:
        self.analysis.prepare(key)
        self.analysis.prepare_users(key)
        self.to_prepare.discard(key)
        collector.tidy()

    def _keep(self, key: str) -> None:
        self.to_keep.discard(key)
        self.analysis.keep(key)

    def _load_features(self) -> None:
        """Load all adapters, so that the first question doesn't wait for its own."""
        with collector.loading():
            self._features()

    def _all_checked(self) -> None:
        self.analysis.dismiss_helpers()
        self.checked = self.analysis.settled = True
        self._news |= not self.analysis.known_before.issuperset(self.analysis.programs())
        self._progress.end()
        collector.begin_collecting()

    def close(self) -> None:
        """The session ends."""
        evaluator = getattr(self, "evaluator", None)
        if evaluator is not None:
            evaluator.close()
            self.analysis.dismiss_helpers()
        self.presenter.close()

    @property
    def watched(self) -> bool:
        """Whether the client tells what happens to files on disk."""
        return self.client.can("workspace.didChangeWatchedFiles.dynamicRegistration")

    @property
    def looks_at_data(self) -> bool:
        """Whether files of data change without a word: programs read some, and the client does not watch them."""
        return not self.watched and bool(self.analysis.files.data_files())

    def data_changed(self) -> bool:
        """Look at the files of data that programs read, once a second; whether any has changed."""
        now, files = time.monotonic(), self.analysis.files
        if now - self._looked < REST:
            return False
        self._looked = now
        changed = bool(files.refresh(files.data_files()))
        if changed:
            self.diagnostics_changed()
        return changed


def settings_of(settings: Any) -> Mapping[str, Any]:
    """Settings, with or without `potto` around them. Nested ones are also found under dotted names."""
    if isinstance(settings, Mapping) and isinstance(settings.get("potto"), Mapping):
        settings = settings["potto"]
    if not isinstance(settings, Mapping):
        return {}
    flat = dict(settings)
    for name, value in settings.items():
        if isinstance(value, Mapping) and name != "lints":
            flat.update({f"{name}.{inner}": item for inner, item in value.items()})
    return flat
