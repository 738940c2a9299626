"""Progress that the client shows when something takes long.

Owns `WorkProgress`, for what can be counted, and `Working`, for what just takes time and can be cancelled. Both are
silent for clients that show no progress, and for work that is over soon.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from threading import Lock, Timer
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from potto_lsp.connection import Connection

_tokens = itertools.count(1)
SOON, PAUSE = 0.2, 0.1  # seconds: before the first word, and between words


class WorkProgress:
    """Progress of something that can be counted."""

    def __init__(self, session: Connection, title: str) -> None:
        self._session, self._title = session, title
        self._token = f"potto-progress-{next(_tokens)}"
        self._started = self._told = time.monotonic()
        self._state: Literal["quiet", "asked", "allowed", "shown"] = "quiet"

    def report(self, done: int, of: int) -> None:
        """So much is done."""
        now = time.monotonic()
        if not self._session.client.can("window.workDoneProgress"):
            return
        if self._state == "quiet" and now - self._started > SOON:
            self._state = "asked"
            self._session.request("window/workDoneProgress/create", {"token": self._token}, self._allow)
        elif self._state in ("allowed", "shown") and now - self._told > PAUSE:
            self._told = now
            value: dict[str, Any] = {"message": f"{done} of {of} files", "percentage": 100 * done // of}
            if self._state == "allowed":
                self._state = "shown"
                self._tell({"kind": "begin", "title": self._title, "cancellable": False, **value})
            else:
                self._tell({"kind": "report", **value})

    def end(self) -> None:
        """It is done."""
        if self._state == "shown":
            self._tell({"kind": "end"})
        self._state = "asked"

    def _allow(self, result: Any, error: Any) -> None:
        if error is None:
            self._state = "allowed"

    def _tell(self, value: dict[str, Any]) -> None:
        self._session.notify("$/progress", {"token": self._token, "value": value})


class Working:
    """Something that a user waits for. `token` is the client's, if it gave one; `cancel` stops the work."""

    def __init__(self, session: Connection, title: str, token: int | str | None, cancel: Callable[[], None]) -> None:
        self._session, self._title = session, title
        self._own = token is None
        self._token = f"potto-progress-{next(_tokens)}" if token is None else token
        self._state: Literal["quiet", "shown", "over"] = "quiet"
        self._lock = Lock()
        if not self._own or session.client.can("window.workDoneProgress"):
            session.cancels[self._token] = cancel
            timer = Timer(SOON, self._ask)
            timer.daemon = True
            timer.start()

    def end(self) -> None:
        """It is over, well or not."""
        self._session.cancels.pop(self._token, None)
        with self._lock:
            shown, self._state = self._state == "shown", "over"
        if shown:
            self._tell({"kind": "end"})

    def _ask(self) -> None:
        if self._state == "over":
            return
        if self._own:
            self._session.request("window/workDoneProgress/create", {"token": self._token}, self._begin)
        else:
            self._begin(None, None)

    def _begin(self, result: Any, error: Any) -> None:
        with self._lock:
            if error is not None or self._state == "over":
                return
            self._state = "shown"
        self._tell({"kind": "begin", "title": self._title, "cancellable": True})

    def _tell(self, value: dict[str, Any]) -> None:
        self._session.notify("$/progress", {"token": self._token, "value": value})
