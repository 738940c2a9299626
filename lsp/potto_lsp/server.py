"""The conversation with a client, from its first message to the exit status.

Owns `Server`: the life of a session (`initialize` … `exit`), the documents, and one answer to every request. pygls
carries it (`carrier`). It runs on the reading thread, which never waits: what needs the database is a job for `work`,
and its answer a future that a cancellation ends at once.
"""

from __future__ import annotations

import itertools
import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from functools import partial
from typing import Any

from potto_lsp import collector, failures
from potto_lsp.asking import Ask, about, uri_of
from potto_lsp.carrier import StreamServer, settle
from potto_lsp.client import Client
from potto_lsp.connection import Reply
from potto_lsp.crashes import Crashes, Version
from potto_lsp.deferred import Deferred
from potto_lsp.documents import Document, Documents
from potto_lsp.failures import RequestError
from potto_lsp.features import FEATURES, Feature, load_features
from potto_lsp.greeting import answer
from potto_lsp.notifications import NOTIFICATIONS, Handler
from potto_lsp.session import ClientSession
from potto_lsp.wire import Outbox
from potto_lsp.work import Job, Worker

logger = logging.getLogger(__name__)


def leave() -> None:
    """End at once, since no question would ever be answered. The client notices, and may start another server."""
    logging.shutdown()
    os._exit(70)


class Server(StreamServer):
    """One client: the messages that it sends, and where answers go.

    `greeted`: the parameters of a greeting that has been answered. `arrived` says whether bytes wait to be read.
    """

    def __init__(
        self,
        bodies: Iterator[bytes],
        outbox: Outbox,
        greeted: Any = None,
        arrived: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__()
        self._bodies, self._outbox, self._greeted, self._arrived = bodies, outbox, greeted, arrived
        self.protocol.set_writer(outbox)
        self.documents = Documents()
        self.session: ClientSession | None = None
        self.worker: Worker | None = None
        self._shut_down = False
        self._ids, self._edits = itertools.count(1), 0
        self._crashes = Crashes(self.notify)
        self.feature("initialize")(partial(self._initialize))
        self.feature("shutdown")(partial(self._shut))
        for method in FEATURES:
            self.feature(method)(partial(self._ask, method))
        for method, handle in NOTIFICATIONS.items():
            self.feature(method)(partial(self._noted, method, handle))

    def run(self) -> int:
        """Talk until the client leaves. Returns the exit status."""
        if self._greeted is not None:
            self._initialize(self._greeted)
        status = self.carry(self._bodies)
        if self.session is not None:
            self.session.close()
        self._outbox.close()
        return status

    # The life of a session

    def refused(self, method: str) -> RequestError | None:
        if self._shut_down:
            return RequestError(failures.INVALID_REQUEST, "the server was shut down")
        if self.session is None and method != "initialize":
            return RequestError(failures.NOT_INITIALIZED, "the first request is `initialize`")
        return None

    def listens(self, method: str) -> bool:
        return self.session is not None and not self._shut_down

    def status(self) -> int:
        return 0 if self._shut_down else 1

    def _shut(self, params: Any) -> None:
        self._shut_down = True

    def _initialize(self, params: Any) -> Any:
        if self.session is not None:
            raise RequestError(failures.INVALID_REQUEST, "`initialize` comes once")
        greeting = answer(params)
        client = Client(params)
        self.documents.encoding = client.encoding
        self.session = ClientSession(client, self.notify, self.request, self.later, load_features)
        self.worker = Worker(self.session.load, self.session.idle, leave, self._rest, self._arrived)
        self.worker.start()
        if client.process is not None:
            from potto_lsp.parent import watch

            watch(client.process)
        return greeting

    def _rest(self) -> bool:
        """What there is time for while nothing is to be done; whether there will be more of it."""
        collector.rest()
        assert self.session is not None and self.worker is not None
        if self.session.keeps_next():
            self.worker.check_again()
        return self._look_at_data()

    def _look_at_data(self) -> bool:
        """Notice files of data that have changed without a word; whether there are any that may."""
        assert self.session is not None and self.worker is not None
        if not self.session.looks_at_data:
            return False
        if self.session.data_changed():
            self.worker.check_again()
        return True

    def _noted(self, method: str, handle: Handler, params: Any) -> None:
        """A notification."""
        try:
            handle(self, params)
        except (RequestError, AttributeError, LookupError, TypeError, ValueError):
            logger.error("the notification %s is malformed", method, exc_info=True)
        except Exception:
            self._crashes.tell(f"the notification {method}")

    # Asking the analysis

    def edit(self, change: Callable[[], object]) -> None:
        """Change something that the analysis sees, and check the files afterwards."""
        assert self.worker is not None
        self._edits += 1

        def run(job: Job) -> None:
            change()

        self.worker.put(Job("edit", run))

    def later(self, action: Callable[[], None]) -> None:
        """Do something on the thread that owns the database."""
        assert self.worker is not None
        self.worker.put(Job("quick", lambda job: action()))

    def _ask(self, method: str, params: Any) -> Future[Any]:
        """A question; its answer comes later."""
        feature = FEATURES[method]
        assert self.session is not None and self.worker is not None
        uri = uri_of(params)
        document = None if uri is None else self.documents.get(uri)
        ask = Ask(self.session, params)
        future: Future[Any] = Future()
        job = Job(feature.pace, lambda job: self._answer(future, job, feature, ask, document))
        if document is not None and feature.method != "textDocument/diagnostic":
            job.outdated = lambda: self._outdated(ask, document)
            told = RequestError(failures.CONTENT_MODIFIED, "the document has changed")
            job.drop = lambda job: _finish(future, job, error=told)
        future.add_done_callback(partial(self._ended, job))
        self.worker.put(job)
        return future

    def _ended(self, job: Job, future: Future[Any]) -> None:
        """Stop work on a question that was cancelled, and release what it held: the job refers to the future, and the
        future to the job."""
        if future.cancelled():
            job.claim()
            if self.worker is not None:
                self.worker.cancelled(job)
            job.stop()
        job.run = job.drop = _nothing
        job.outdated = bool

    def _outdated(self, ask: Ask, document: Document) -> bool:
        """Whether a question is about an older version of the document."""
        return ask.analysis.document(ask.file) is not document

    def _answer(self, future: Future[Any], job: Job, feature: Feature, ask: Ask, document: Document | None) -> None:
        self._look_at_data()
        version = self._version(feature, ask, document)
        if self._crashes.is_off(version):
            _finish(future, job)
            return
        try:
            result = feature.answer(ask)
        except RequestError as error:
            _finish(future, job, error=error)
        except Exception as error:
            self._crashes.note(version)
            told = f"internal error: {type(error).__name__}: {error}"
            _finish(future, job, error=RequestError(failures.INTERNAL_ERROR, told))
        else:
            self._crashes.forget(version)
            if isinstance(result, Deferred):
                _defer(future, job, result)
            else:
                _finish(future, job, result)

    def _version(self, feature: Feature, ask: Ask, document: Document | None) -> Version:
        """What a failure is counted for: a method on a version of a file, or on the workspace until the next edit."""
        uri = about(ask.params) or ""
        named = document or self.documents.get(uri)
        return feature.method, uri, self._edits if named is None else named.version

    # Sending

    def notify(self, method: str, params: Any) -> None:
        """Tell the client something."""
        self.protocol.notify(method, params)

    def request(self, method: str, params: Any, reply: Reply | None = None) -> None:
        """Ask the client something. `reply` is called on the reading thread."""

        def replied(future: Future[Any]) -> None:
            try:
                error = future.exception()
                if reply is not None:
                    reply(None if error else future.result(), error)
            except Exception:
                self._crashes.tell("a response of the client")

        self.protocol.send_request(method, params, msg_id=f"potto-{next(self._ids)}").add_done_callback(replied)


def _nothing(job: Job) -> None:
    """What is left to do for a question that was answered."""


def _defer(future: Future[Any], job: Job, deferred: Deferred) -> None:
    """An answer that comes later."""

    def finish(result: Any) -> None:
        if isinstance(result, RequestError):
            _finish(future, job, error=result)
        else:
            _finish(future, job, result)

    job.stop = deferred.stop
    deferred.start(finish)


def _finish(future: Future[Any], job: Job, result: Any = None, error: RequestError | None = None) -> None:
    """Answer a request, unless it was answered."""
    if job.claim():
        settle(future, result, error)
