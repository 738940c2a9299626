"""Messages on a stream: `Content-Length` and JSON, as in the base protocol.

Owns `bodies`, which reads them, `arrivals`, which says whether bytes wait, `framed`, which makes a message's bytes, and
`Outbox`, which writes them from any thread without waiting: if the server stopped reading because a client does not
read for a while, both would wait forever.
"""

from __future__ import annotations

import json
import logging
import os
import re
import select
from collections.abc import Callable, Iterable, Iterator, Mapping
from queue import SimpleQueue
from threading import Lock, Thread
from typing import Any, BinaryIO, Protocol

logger = logging.getLogger(__name__)
MOST_BYTES = 256_000_000  # of one message; a header that says more is broken
Part = bytes | memoryview  # of a message
_OF_A_BROWSER = re.compile(rb"[A-Z]+ \S+ HTTP/")


def bodies(stream: BinaryIO) -> Iterator[bytes]:
    """The messages of a stream, each whole, until it ends or breaks."""
    try:
        yield from _bodies(stream)
    except OSError as error:
        logger.info("the client is gone: %s", error)


def _bodies(stream: BinaryIO) -> Iterator[bytes]:
    while (length := _header(stream)) is not None:
        body = stream.read(length)
        if len(body) < length:
            logger.error("the stream ended inside of a message")
            return
        yield body


def arrivals(stream: BinaryIO) -> Callable[[], bool]:
    """A function that says whether bytes wait at a stream that nobody has read. Where the system can't say it of every
    stream (Windows), none ever do."""
    if not hasattr(select, "poll"):
        return lambda: False
    door = select.poll()
    door.register(stream.fileno(), select.POLLIN)
    return lambda: bool(door.poll(0))


def _header(stream: BinaryIO) -> int | None:
    """The length of the next body; None at the end. Field names are in any case; lines may end in a bare LF.

    What begins as a request of HTTP ends the conversation: any web page could send one to a socket of this computer,
    with a message as its body.
    """
    length: int | None = None
    while line := stream.readline(4096):
        line = line.strip()
        if line:
            name, colon, value = line.partition(b":")
            if colon and name.strip().lower() == b"content-length":
                length = _length(value)
            elif _OF_A_BROWSER.match(line):
                logger.error("a browser is not a client: %r", line[:80])
                return None
            elif not colon:
                logger.error("a line that is not a header field: %r", line[:80])
        elif length is not None:
            return length
    return None


def _length(value: bytes) -> int | None:
    try:
        length = int(value)
    except ValueError:
        length = -1
    if not 0 <= length <= MOST_BYTES:
        logger.error("a message cannot be %r bytes long", value[:40])
        return None
    return length


class Encoded:
    """A list that is already JSON: answers about whole files are kept in pieces, as they are sent. The items of a piece
    are separated by commas; empty pieces don't count. With `under`, the list is the last field of that object, under
    the name `field`."""

    __slots__ = ("field", "pieces", "under")

    def __init__(self, pieces: Iterable[bytes], under: Mapping[str, Any] | None = None, field: str = "") -> None:
        self.pieces, self.under, self.field = [piece for piece in pieces if piece], under, field

    @property
    def frame(self) -> tuple[bytes, bytes]:
        """What stands before the items and behind them."""
        if self.under is None:
            return b"[", b"]"
        empty = json.dumps({**self.under, self.field: []}, separators=(",", ":")).encode("ascii")
        return empty[:-2], empty[-2:]


def framed(message: dict[str, Any]) -> bytes:
    """A message as it is sent."""
    # Escaped to ASCII: half of a surrogate pair, which JSON may carry, would not go into UTF-8.
    result = message.get("result")
    if isinstance(result, Encoded):
        return _framed_list({name: value for name, value in message.items() if name != "result"}, result)
    body = json.dumps(message, separators=(",", ":")).encode("ascii")
    return b"Content-Length: %d\r\n\r\n%b" % (len(body), body)


def _framed_list(message: dict[str, Any], result: Encoded) -> bytes:
    """A message with a long list as its result. That may be megabytes, so it is copied only once."""
    start, end = result.frame
    head = json.dumps(message, separators=(",", ":"))[:-1].encode("ascii") + b',"result":' + start
    end += b"}"
    length = len(head) + sum(map(len, result.pieces)) + max(len(result.pieces) - 1, 0) + len(end)
    first, *rest = result.pieces or [b""]
    whole = [b"Content-Length: %d\r\n\r\n%b%b" % (length, head, first), *rest]
    whole[-1] += end
    return b",".join(whole)


class MessageStream(Protocol):
    """Where bytes go, a whole message at a time. `fileno` raises `OSError` if nothing may be written past it."""

    def fileno(self) -> int: ...

    def write(self, message: Part, /) -> object: ...

    def flush(self) -> None: ...


class Outbox:
    """Writes messages in order.

    What the client's pipe takes at once is written at once; a thread writes the rest. (A thread that woke for every
    message took a third as long as producing the messages: both need the interpreter.)
    """

    def __init__(self, stream: MessageStream) -> None:
        self._stream, self._pipe = stream, _pipe_of(stream)
        self._queue: SimpleQueue[Part | None] = SimpleQueue()
        self._lock = Lock()
        self._left = 0  # messages that the thread has not written yet: those that come after must wait for it
        self._thread = Thread(target=self._write, name="potto-outbox", daemon=True)
        self._thread.start()

    def put(self, message: dict[str, Any]) -> None:
        """Queue a message."""
        self.write(framed(message))

    def write(self, data: bytes) -> None:
        """Queue a framed message."""
        left: Part = data
        with self._lock:
            if not self._left and self._pipe is not None:
                left = self._pipe.write(left)
            if left and self._left >= 0:
                self._left += 1
                self._queue.put(left)

    def close(self, seconds: float = 2.0) -> None:
        """Write what is left, but give up after `seconds`."""
        self._queue.put(None)
        self._thread.join(seconds)

    def _write(self) -> None:
        try:
            while (message := self._queue.get()) is not None:
                self._stream.write(message)
                if self._queue.empty():
                    self._stream.flush()
                with self._lock:
                    self._left -= 1
            self._stream.flush()  # what came just before the end
        except (OSError, ValueError) as error:
            logger.info("the client does not listen any more: %s", error)
            with self._lock:
                self._left = -1  # so that nothing piles up


class _Pipe:
    """A pipe that can tell how much it takes without waiting."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor, self._poll = descriptor, select.poll()
        self._poll.register(descriptor, select.POLLOUT)

    def write(self, data: Part) -> Part:
        """Write as much as possible without waiting. Returns what is left: not a copy, which would take longer than to
        write it, an answer about a long file being megabytes."""
        rest = memoryview(data)
        try:
            while rest and self._poll.poll(0) == [(self._descriptor, select.POLLOUT)]:
                rest = rest[os.write(self._descriptor, rest[: select.PIPE_BUF]) :]  # so much never waits
        except OSError:
            pass  # whoever writes the rest meets it again, and says so
        return rest


def _pipe_of(stream: MessageStream) -> _Pipe | None:
    """A stream as a pipe, if it is one and the system can say of one when it is ready."""
    try:
        return _Pipe(stream.fileno()) if hasattr(select, "poll") else None
    except (OSError, ValueError, AttributeError):
        return None
