"""The session, made on another thread while the prompt is shown.

Owns `Loader`. Importing the evaluator takes longer than showing a prompt, and nobody types that fast.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from potto.projects.settings import Settings

if TYPE_CHECKING:
    from potto_repl.session import Conversation

WARM = "integral [0, 1] [x < 0.5] d(x)"


class Loader:
    """Makes the session on another thread. Whoever needs it waits."""

    def __init__(self, settings: Settings, unicode: bool = True) -> None:
        self._settings = settings
        self._unicode = unicode
        self._session: Conversation | None = None
        self._problem: BaseException | None = None
        self._ready = threading.Event()
        self._started = False
        self._lock = threading.Lock()
        self.told: Callable[[], None] | None = None  # is called when the session is there

    def start(self) -> None:
        """Begin to load, if that has not begun."""
        with self._lock:
            if self._started:
                return
            self._started = True
        threading.Thread(target=self._load, name="potto-load", daemon=True).start()

    @property
    def ready(self) -> bool:
        return self._ready.is_set() and self._session is not None

    @property
    def session(self) -> Conversation:
        """The session, waited for."""
        self.start()
        while not self._ready.wait(0.1):  # in short waits, so that Ctrl-C comes through
            pass
        if self._session is None:
            assert self._problem is not None
            raise self._problem
        return self._session

    def _load(self) -> None:
        try:
            from potto_repl import respond  # noqa: F401  (all that answers: no other thread may import it meanwhile)
            from potto_repl.options import Options
            from potto_repl.session import Conversation

            session = Conversation(["."])
            session.settings = self._settings
            session.options = Options(unicode=self._unicode)
            self._session = session
        except BaseException as error:  # told to whoever asks for the session
            self._problem = error
        finally:
            self._ready.set()
        if self._session is not None:
            if self.told is not None:
                self.told()
            self._session.evaluate(WARM)  # the first kernel, plan and rule are the slowest
            from potto_repl import complete  # noqa: F401  (for the first Tab)
