"""What was found out about a workspace, kept on disk, so that the next session begins with it.

Owns `Keeper`, which writes it, and `KeptWorkspace`, which reads it, both part by part: each takes milliseconds. Answers
are kept as they travel between processes (`query/parcels`), packed. So nothing is taken over that would not be found
here: what was edited meanwhile is checked, and of what rests on it what is reached. There is one entry for a workspace;
it is bounded as all of the store is.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence

from msgspec import MsgspecError, msgpack

from potto import store
from potto.checking.check import definition_diagnostics, diagnostics
from potto.core.packing import packed, unpacked
from potto.modules import names
from potto.query import Database
from potto.query.parcels import Asked, Parcel, Receiver, Sender

KIND = "workspaces"
TOGETHER = 32  # definitions of a part
MOST = 100_000_000  # bytes of a part; nothing that was written here is longer
_FAST = 1  # of zlib: a fifth of the length in a tenth of the time that packing takes

Part = tuple[str, tuple[str, ...]]  # a file, and some of its definitions; none: the file itself, after all of these
Parts = list[tuple[str, bytes]]  # the file that is whole with this part, or ""; what those before it do not have


def parts_of(db: Database, file: str) -> Iterator[Part]:
    """The parts in which a file is kept."""
    defined = names(db, file)
    for first in range(0, len(defined), TOGETHER):
        yield file, defined[first : first + TOGETHER]
    yield file, ()


class Keeper:
    """Keeps what one revision of a database knows of a workspace. What was interrupted, by an edit or a failure, is not
    kept: each part rests on those before it."""

    def __init__(self, db: Database, roots: Sequence[str]) -> None:
        self._db, self._revision, self._whole = db, db.revision, True
        self._sender, self._key, self._parts = Sender(db), _key(roots), Parts()

    def add(self, part: Part) -> None:
        """Add what is known of a part. Raises what its check raises, TypeError or RecursionError where an answer
        cannot be written as data, and Cancelled."""
        if not self._is_whole():
            return
        self._whole = False
        file, some = part
        asked: list[Asked] = [(definition_diagnostics, (file, name)) for name in some] or [(diagnostics, (file,))]
        data = zlib.compress(packed(self._sender.pack_all(asked)), _FAST)
        self._parts.append(("" if some else file, data))
        self._whole = True

    def finish(self) -> bool:
        """Write what was added; whether it is complete. If it cannot be written, the next session only takes longer."""
        if self._is_whole():
            store.put(KIND, self._key, msgpack.encode(self._parts))
        return self._whole

    def _is_whole(self) -> bool:
        self._whole = self._whole and self._db.revision == self._revision
        return self._whole


class KeptWorkspace:
    """What an earlier session has found out about a workspace, for a database that has its files."""

    def __init__(self, db: Database, roots: Sequence[str]) -> None:
        self._receiver, self._left = Receiver(db), _read(roots)[::-1]
        self._parcel: Parcel | None = None

    @property
    def is_left(self) -> bool:
        """Whether there is something to `take`."""
        return bool(self._left)

    def take(self) -> str | None:
        """Take over what was found out about the next part: the file, if all of it is known now and what is said about
        it is the same. After a cancellation the next call goes on with it."""
        file, data = self._left[-1]
        if self._parcel is None:
            self._parcel = _parcel(data)
        if self._parcel is None:
            self._left.clear()  # what comes behind it rests on it
            return None
        holds = self._receiver.take(self._parcel)
        self._parcel = None
        self._left.pop()
        return file if holds and file else None


def _key(roots: Sequence[str]) -> bytes:
    return repr(tuple(roots)).encode("utf-8", "surrogatepass")


def _read(roots: Sequence[str]) -> Parts:
    """What was kept of a workspace; nothing where there is none, or none that can be read."""
    data = store.get(KIND, _key(roots))
    try:
        return [] if data is None else msgpack.decode(data, type=Parts)
    except MsgspecError:
        return []


def _parcel(data: bytes) -> Parcel | None:
    """The parcel in some bytes; None if there is none, or it is too long."""
    try:
        found = unpacked(zlib.decompressobj().decompress(data, MOST))
    except (ValueError, zlib.error):
        return None
    return found if isinstance(found, Parcel) else None
