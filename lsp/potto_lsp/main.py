"""Starting the server on standard streams, on a socket or on a WebSocket.

Owns the streams. Once the server has taken standard output, whatever else is printed goes to standard error: one stray
`print` would break the conversation.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from typing import BinaryIO

from potto_lsp import collector
from potto_lsp.greeting import greet
from potto_lsp.wire import Outbox, arrivals, bodies

SWITCH = 0.0002  # seconds; with Python's default of 5 ms, so long would a question wait for a busy thread


def serve(address: tuple[str, int] | None = None, log: str | None = None) -> int:
    """Serve one client, on standard streams or as a server on an address; the exit status."""
    _begin(log)
    return _serve_streams() if address is None else _serve_socket(address)


def serve_websocket(address: tuple[str, int], origins: Sequence[str], log: str | None = None) -> int:
    """Serve one client on a WebSocket; the exit status. `origins` are of web pages that may be it. Raises `ImportError`
    without the library websockets."""
    from potto_lsp import websocket

    _begin(log)
    return _leave(websocket.serve(address, origins, _converse))


def _begin(log: str | None) -> None:
    _log_to(log)
    sys.setswitchinterval(SWITCH)


def _log_to(path: str | None) -> None:
    """Log everything to a file, or only errors to standard error."""
    kind = logging.FileHandler(path, encoding="utf-8") if path is not None else logging.StreamHandler()
    kind.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    root = logging.getLogger()
    root.addHandler(kind)
    root.setLevel(logging.INFO if path is not None else logging.WARNING)


def _serve_streams() -> int:
    reader, writer = take_streams()
    return _leave(_talk(reader, writer))


def _talk(reader: BinaryIO, writer: BinaryIO) -> int:
    """Serve the client at a pair of streams and return the exit status."""
    return _converse(bodies(reader), Outbox(writer), arrivals(reader))


def _converse(received: Iterator[bytes], outbox: Outbox, arrived: Callable[[], bool] = lambda: False) -> int:
    """Serve a client and return the exit status. The greeting is answered before the server is loaded."""
    first = next(received, None)
    if first is None:
        outbox.close()
        return 1
    with collector.loading():
        greeted = greet(first, outbox)

        from potto_lsp.server import Server

    return Server(received if greeted else chain([first], received), outbox, greeted, arrived).run()


def take_streams() -> tuple[BinaryIO, BinaryIO]:
    """Take standard input and output for ourselves. Whatever else is printed goes to standard error."""
    reader = os.fdopen(os.dup(0), "rb", buffering=1 << 16)
    writer = os.fdopen(os.dup(1), "wb", buffering=1 << 16)
    os.dup2(2, 1)
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)
    sys.stdout = sys.stderr
    return reader, writer


def _serve_socket(address: tuple[str, int]) -> int:
    import socket  # what a client on standard streams doesn't wait for

    with socket.create_server(address) as listener:
        host, port = listener.getsockname()[:2]
        print(f"listening on {host}:{port}", file=sys.stderr, flush=True)
        connection, _ = listener.accept()
    with connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        status = _talk(connection.makefile("rb"), connection.makefile("wb"))
    return _leave(status)


def _leave(status: int) -> int:
    """End at once, whatever the analysis is doing."""
    logging.shutdown()
    sys.stderr.flush()
    os._exit(status)
