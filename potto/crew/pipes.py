"""Messages between a crew and its helpers: pickled objects, each behind its length, over pipes of their own."""

from __future__ import annotations

import pickle
from typing import IO, Any

from msgspec import Struct

from potto.query.parcels import Parcel

LENGTH = 4  # bytes


Part = tuple[str, str | None]  # a file, and the text of a piece of it or None: all of it


class CheckTask(Struct, frozen=True):
    """What to check, and what has changed since the last task: roots, and texts of open files (None: closed)."""

    parts: tuple[Part, ...]
    roots: tuple[str, ...]
    texts: tuple[tuple[str, str | None], ...]


class CheckResult(Struct, frozen=True):
    """What was found out; no parcel if that failed. `round`: after an edit both ends begin anew."""

    part: Part
    round: int
    parcel: Parcel | None


def packed(message: CheckTask | CheckResult) -> bytes:
    """A message as bytes. Raises what pickling raises, for what is nested too deeply."""
    body = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    return len(body).to_bytes(LENGTH, "little") + body


def unpacked(stream: IO[bytes]) -> Any:
    """The next message; None at the end of the stream, also in the middle of a message."""
    head = stream.read(LENGTH)
    if len(head) < LENGTH:
        return None
    length = int.from_bytes(head, "little")
    body = stream.read(length)
    return pickle.loads(body) if len(body) == length else None
