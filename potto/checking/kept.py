"""What was found out about a workspace, kept on disk, so that the next session begins with it.

Owns `Keeper`, which writes it, and `Kept`, which reads it, both file by file: each step takes milliseconds. Answers are
kept as they travel between processes (`query/travel`), packed. So nothing is taken over that would not be found here:
what was edited meanwhile is checked, and of what rests on it what is reached. There is one entry for a workspace; it is
bounded as all of the store is.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence

from msgspec import MsgspecError, msgpack

from potto import store
from potto.checking.check import diagnostics
from potto.core.packing import packed, unpacked
from potto.query import Database
from potto.query.travel import Parcel, Receiver, Sender

KIND = "workspaces"
MOST = 200_000_000  # bytes of an entry; nothing that was written here is longer
_FAST = 1  # of zlib: a fifth of the length in a tenth of the time that packing takes

OfFiles = list[tuple[str, bytes]]  # files, and what was found out about each that those before it do not have


class Keeper:
    """Keeps what one revision of a database knows of a workspace. What was interrupted, by an edit or a failure, is not
    kept: each file's part rests on those before it."""

    def __init__(self, db: Database, roots: Sequence[str]) -> None:
        self._db, self._revision, self._whole = db, db.revision, True
        self._sender, self._key, self._parcels = Sender(db), _key(roots), OfFiles()

    def add(self, file: str) -> None:
        """Add what is known of a file. Raises what its check raises, TypeError or RecursionError where an answer is no
        data, and Cancelled."""
        if not self._is_whole():
            return
        self._whole = False
        self._parcels.append((file, packed(self._sender.pack(diagnostics, file))))
        self._whole = True

    def finish(self) -> bool:
        """Write what was added; whether it is whole. Where it cannot be written the next session takes longer, nothing
        else."""
        if self._is_whole():
            store.put(KIND, self._key, zlib.compress(msgpack.encode(self._parcels), _FAST))
        return self._whole

    def _is_whole(self) -> bool:
        self._whole = self._whole and self._db.revision == self._revision
        return self._whole


class Kept:
    """What an earlier session has found out about a workspace, for a database that has its files."""

    def __init__(self, db: Database, roots: Sequence[str]) -> None:
        self._receiver, self._left = Receiver(db), _read(roots)[::-1]
        self._parcel: Parcel | None = None

    @property
    def is_left(self) -> bool:
        """Whether there is something to `take`."""
        return bool(self._left)

    def take(self) -> str | None:
        """Take over what was found out about the next file: the file, if what is said about it is the same now. After a
        cancellation the next call goes on with it."""
        file, data = self._left[-1]
        if self._parcel is None:
            self._parcel = _parcel(data)
        if self._parcel is None:
            self._left.clear()  # what comes behind it rests on it
            return None
        holds = self._receiver.take(self._parcel)
        self._parcel = None
        self._left.pop()
        return file if holds else None


def _key(roots: Sequence[str]) -> bytes:
    return repr(tuple(roots)).encode("utf-8", "surrogatepass")


def _read(roots: Sequence[str]) -> OfFiles:
    """What was kept of a workspace; nothing where there is none, or none that can be read."""
    data = store.get(KIND, _key(roots))
    try:
        return [] if data is None else msgpack.decode(_inflated(data), type=OfFiles)
    except (MsgspecError, zlib.error):
        return []


def _inflated(data: bytes) -> bytes:
    """Bytes as they were before they were compressed, as far as they are not too many."""
    return zlib.decompressobj().decompress(data, MOST)


def _parcel(data: bytes) -> Parcel | None:
    try:
        found = unpacked(data)
    except ValueError:
        return None
    return found if isinstance(found, Parcel) else None
