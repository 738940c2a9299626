"""Stacks for what runs deep.

Owns `on_fresh_stack`.
"""

from __future__ import annotations

import contextvars
import threading
from collections.abc import Callable
from typing import Any


def on_fresh_stack(work: Callable[[], Any], cancel: Callable[[], None]) -> Any:
    """What `work` gives, done by a new thread in this one's context. cancel: is called where the wait for it is
    interrupted: what it works on must be left alone before this thread goes on."""
    answer: list[tuple[Any, BaseException | None]] = []
    context = contextvars.copy_context()

    def run() -> None:
        try:
            answer.append((context.run(work), None))
        except BaseException as error:
            answer.append((None, error))

    thread = threading.Thread(target=run, name="potto-query", daemon=True)
    thread.start()
    try:
        thread.join()
    except BaseException:
        cancel()
        thread.join()
        raise
    value, error = answer[0]
    if error is not None:
        raise error
    return value
