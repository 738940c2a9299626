"""The conversation with a client: from its first message to the exit status.

Owns `Server`: the life of a session (`initialize` … `exit`), documents kept in step, and one answer to every request.
It runs on the thread that reads messages and never waits: what needs the database is a job for `work`. Cancellations
are applied here, as soon as they are read.
"""

from __future__ import annotations

import itertools
import logging
import os
from collections.abc import Callable, Mapping
from threading import Lock
from typing import Any, BinaryIO

from potto import __version__
from potto_lsp import errors
from potto_lsp.asking import Ask, about, uri_of
from potto_lsp.client import Client
from potto_lsp.crashes import Crashes, Version
from potto_lsp.deferred import Deferred
from potto_lsp.documents import Document, Documents
from potto_lsp.errors import RequestError
from potto_lsp.features import FEATURES, Feature, capabilities
from potto_lsp.notifications import NOTIFICATIONS
from potto_lsp.session import Reply, Session
from potto_lsp.wire import BadMessage, Outbox, messages
from potto_lsp.work import Job, Worker

logger = logging.getLogger(__name__)
Id = int | str


def leave() -> None:
    """End at once: no question would ever be answered. A client notices that and may start another server."""
    logging.shutdown()
    os._exit(70)


class Server:
    """One client on one pair of streams."""

    def __init__(self, reader: BinaryIO, writer: BinaryIO) -> None:
        self._reader, self._outbox = reader, Outbox(writer)
        self.documents = Documents()
        self.session: Session | None = None
        self.worker: Worker | None = None
        self._shut_down = False
        self._jobs: dict[Id, Job] = {}
        self._replies: dict[Id, Reply | None] = {}
        self._ids, self._edits = itertools.count(1), 0
        self._lock = Lock()
        self._crashes = Crashes(self.notify)

    def run(self) -> int:
        """Talk until the client leaves; the exit status."""
        status: int | None = None
        for message in messages(self._reader):
            status = self._received(message)
            if status is not None:
                break
        if self.session is not None:
            self.session.close()
        self._outbox.close()
        return 1 if status is None else status

    # Receiving

    def _received(self, message: Any) -> int | None:
        """One message; the exit status if it was the last one."""
        if isinstance(message, BadMessage):
            logger.error("a message that is no JSON: %s", message)
            self._fail(None, errors.PARSE_ERROR, "this is no JSON")
            return None
        if not isinstance(message, dict):
            logger.error("a message that is no object")
            self._fail(None, errors.INVALID_REQUEST, "a message is an object")
            return None
        method, id, params = message.get("method"), message.get("id"), message.get("params")
        if not isinstance(method, str):
            self._response(message)
        elif "id" in message:
            if isinstance(id, int | str) and not isinstance(id, bool):
                self._request(id, method, params)
            else:
                self._fail(None, errors.INVALID_REQUEST, "the id of a request is a number or a string")
        elif method == "exit":
            return 0 if self._shut_down else 1
        else:
            self._notification(method, params)
        return None

    def _request(self, id: Id, method: str, params: Any) -> None:
        if self._shut_down:
            self._fail(id, errors.INVALID_REQUEST, "the server was shut down")
        elif method == "initialize":
            self._initialize(id, params)
        elif self.session is None:
            self._fail(id, errors.NOT_INITIALIZED, "the first request is `initialize`")
        elif method == "shutdown":
            self._shut_down = True
            self._send({"id": id, "result": None})
        elif (feature := FEATURES.get(method)) is None:
            self._fail(id, errors.METHOD_NOT_FOUND, f"there is no method `{method}`")
        else:
            self._ask(id, feature, params)

    def _notification(self, method: str, params: Any) -> None:
        if self.session is None or self._shut_down:
            logger.info("a notification out of time: %s", method)
            return
        try:
            if method == "$/cancelRequest":
                self._cancel(params.get("id"))
            elif (handle := NOTIFICATIONS.get(method)) is not None:
                handle(self, params)
            elif not method.startswith("$/"):
                logger.info("a notification that is not known: %s", method)
        except (RequestError, AttributeError, LookupError, TypeError, ValueError):
            logger.error("the notification %s is malformed", method, exc_info=True)
        except Exception:
            self._crashes.tell(f"the notification {method}")

    def _response(self, message: Mapping[str, Any]) -> None:
        id = message.get("id")
        with self._lock:
            reply = self._replies.pop(id, None) if isinstance(id, int | str) else None
        if reply is not None:
            try:
                reply(message.get("result"), message.get("error"))
            except Exception:
                self._crashes.tell("a response of the client")

    # The greeting

    def _initialize(self, id: Id, params: Any) -> None:
        if self.session is not None:
            self._fail(id, errors.INVALID_REQUEST, "`initialize` comes once")
        elif not isinstance(params, Mapping) or not isinstance(params.get("capabilities", {}), Mapping):
            self._fail(id, errors.INVALID_PARAMS, "the client's capabilities are missing")
        else:
            client = Client(params)
            self.documents.encoding = client.encoding
            info = {"name": "potto", "version": __version__}
            self._send({"id": id, "result": {"capabilities": capabilities(client.encoding), "serverInfo": info}})
            self.session = Session(client, self.notify, self.request, self.later)
            self.worker = Worker(self.session.load, self.session.idle, leave)
            self.worker.start()
            if client.process is not None:
                from potto_lsp.parent import watch

                watch(client.process)

    # Asking the analysis

    def edit(self, change: Callable[[], object]) -> None:
        """Change something that the analysis sees; files are checked afterwards."""
        assert self.worker is not None
        self._edits += 1

        def run(job: Job) -> None:
            change()

        self.worker.put(Job("edit", run))

    def later(self, action: Callable[[], None]) -> None:
        """Do something on the thread that owns the database."""
        assert self.worker is not None
        self.worker.put(Job("quick", lambda job: action()))

    def _ask(self, id: Id, feature: Feature, params: Any) -> None:
        assert self.session is not None and self.worker is not None
        uri = uri_of(params)
        document = None if uri is None else self.documents.get(uri)
        ask = Ask(self.session, params)
        job = Job(feature.pace, lambda job: self._answer(id, job, feature, ask, document))
        if document is not None and feature.method != "textDocument/diagnostic":
            job.outdated = lambda: self._outdated(ask, document)
            told = (errors.CONTENT_MODIFIED, "the document has changed", None)
            job.drop = lambda job: self._finish(id, job, error=told)
        with self._lock:
            self._jobs[id] = job
        self.worker.put(job)

    def _outdated(self, ask: Ask, document: Document) -> bool:
        """Whether a question came too late for the text that it was about."""
        return ask.analysis.document(ask.file) is not document

    def _answer(self, id: Id, job: Job, feature: Feature, ask: Ask, document: Document | None) -> None:
        version = self._version(feature, ask, document)
        if self._crashes.is_off(version):
            self._finish(id, job, result=None)
            return
        try:
            result = feature.answer(ask)
        except RequestError as error:
            self._finish(id, job, error=(error.code, error.message, error.data))
        except Exception as error:
            self._crashes.note(version)
            told = f"internal error: {type(error).__name__}: {error}"
            self._finish(id, job, error=(errors.INTERNAL_ERROR, told, None))
        else:
            self._crashes.forget(version)
            if isinstance(result, Deferred):
                self._defer(id, job, result)
            else:
                self._finish(id, job, result=result)

    def _version(self, feature: Feature, ask: Ask, document: Document | None) -> Version:
        """What a failure counts for: a method on a version of a file, or on the workspace until the next edit."""
        uri = about(ask.params) or ""
        named = document or self.documents.get(uri)
        return feature.method, uri, self._edits if named is None else named.version

    def _defer(self, id: Id, job: Job, deferred: Deferred) -> None:
        """An answer that comes later."""

        def finish(result: Any) -> None:
            if isinstance(result, RequestError):
                self._finish(id, job, error=(result.code, result.message, result.data))
            else:
                self._finish(id, job, result=result)

        job.stop = deferred.stop
        deferred.start(finish)

    def _finish(self, id: Id, job: Job, result: Any = None, error: tuple[int, str, Any] | None = None) -> None:
        """Answer a request, unless it was answered."""
        if not job.claim():
            return
        with self._lock:
            if self._jobs.get(id) is job:
                del self._jobs[id]
        if error is None:
            self._send({"id": id, "result": result})
        else:
            self._fail(id, *error)

    def _cancel(self, id: Any) -> None:
        with self._lock:
            job = self._jobs.get(id) if isinstance(id, int | str) else None
        if job is not None and self.worker is not None:
            self._finish(id, job, error=(errors.REQUEST_CANCELLED, "the request was cancelled", None))
            self.worker.cancelled(job)
            job.stop()

    # Sending

    def notify(self, method: str, params: Any) -> None:
        """Tell the client something."""
        self._send({"method": method, "params": params})

    def request(self, method: str, params: Any, reply: Reply | None = None) -> None:
        """Ask the client something; `reply` is called on the thread that reads."""
        id = f"potto-{next(self._ids)}"
        with self._lock:
            self._replies[id] = reply
        message = {"id": id, "method": method}
        self._send(message if params is None else {**message, "params": params})

    def _fail(self, id: Id | None, code: int, message: str, data: Any = None) -> None:
        error = {"code": code, "message": message}
        self._send({"id": id, "error": error if data is None else {**error, "data": data}})

    def _send(self, message: dict[str, Any]) -> None:
        self._outbox.put({"jsonrpc": "2.0", **message})
