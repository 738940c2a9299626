"""An answer that comes later, not from the thread that owns the database."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from msgspec import Struct

from potto_lsp.failures import RequestError


class Deferred(Struct, frozen=True):
    """What an adapter returns instead of an answer. `start(finish)` begins the work; `finish` is called with the answer
    or the error, from any thread. `stop` is called if nobody waits for it any more."""

    start: Callable[[Callable[[Any | RequestError], None]], None]
    stop: Callable[[], None]
