"""An answer that comes later, from somebody else than the thread that owns the database."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from msgspec import Struct

from potto_lsp.errors import RequestError


class Deferred(Struct, frozen=True):
    """What an adapter gives instead of an answer. `start(finish)` begins; whoever has the answer, or the error, calls
    `finish` with it, from any thread. `stop` is called if nobody waits for it any more."""

    start: Callable[[Callable[[Any | RequestError], None]], None]
    stop: Callable[[], None]
