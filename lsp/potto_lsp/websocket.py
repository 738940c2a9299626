"""Serving one client on a WebSocket, in frames of text that are a message each, as editors in browsers do.

Owns `serve`. Any web page may open a WebSocket to the computer that shows it. Its browser says from which origin it
comes, so a page is let in only if that origin was allowed; programs name none.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator, Sequence
from queue import SimpleQueue
from threading import Lock, Thread
from typing import TYPE_CHECKING

from websockets.exceptions import ConnectionClosed
from websockets.sync import server
from websockets.typing import Origin

from potto_lsp.wire import MOST_BYTES, Outbox, Part

if TYPE_CHECKING:
    from websockets.sync.server import ServerConnection

logger = logging.getLogger(__name__)
SECONDS_TO_CLOSE = 1.0
TRY_AGAIN_LATER = 1013  # a code of RFC 6455's registry
FAILED = 70
Talk = Callable[[Iterator[bytes], Outbox], int]


def serve(address: tuple[str, int], origins: Sequence[str], talk: Talk) -> int:
    """Talk with the first client, until it leaves; the exit status, by `talk`. Pages of `origins`, such as
    `https://editor.example`, may be the client. Raises `OSError` if the address can't be had."""
    taken = Lock()
    ended: SimpleQueue[int] = SimpleQueue()

    def handle(connection: ServerConnection) -> None:
        if not taken.acquire(blocking=False):
            connection.close(TRY_AGAIN_LATER, "there is a client already")
            return
        status = FAILED
        try:
            status = talk(_bodies(connection), Outbox(_Frames(connection)))
        finally:
            ended.put(status)

    allowed = [None, *map(Origin, origins)]
    host, port = address
    how = {"compression": None, "max_size": MOST_BYTES, "close_timeout": SECONDS_TO_CLOSE}
    with server.serve(handle, host, port, origins=allowed, **how) as listener:
        host, port = listener.socket.getsockname()[:2]
        print(f"listening on {host}:{port}", file=sys.stderr, flush=True)
        Thread(target=listener.serve_forever, name="potto-door", daemon=True).start()
        return ended.get()


def _bodies(connection: ServerConnection) -> Iterator[bytes]:
    try:
        for body in connection:
            yield body.encode() if isinstance(body, str) else body
    except ConnectionClosed as error:
        logger.info("the client is gone: %s", error)


class _Frames:
    """A connection as a stream that framed messages are written to: a frame has no need of the header."""

    def __init__(self, connection: ServerConnection) -> None:
        self._connection = connection

    def fileno(self) -> int:
        raise OSError("frames are not written past the connection")

    def write(self, message: Part, /) -> None:
        try:
            self._connection.send(bytes(message).partition(b"\r\n\r\n")[2].decode())
        except ConnectionClosed as error:
            raise ConnectionError(str(error)) from error

    def flush(self) -> None:
        """Each frame is sent at once."""
