"""pygls, where it is strict enough, and what is done here in its place. Owns `Protocol` and `StreamServer`.

Taken from pygls: the server and its table of handlers, its synchronous loop, the way from a message to its handler,
answers as futures and their cancellation, requests and notifications to the client, the codes of errors; and its
client, with which tests talk on streams and on a socket. Of pygls 2.1.1 does not hold:

- `io_.run` knows `Content-Length: n` in exactly that form and takes a body that ends early for a message: `_Bodies`
  gives it whole bodies under such headers. To what is not JSON it answers nothing: its handler of errors does here.
- `start_tcp` and `start_ws` run on asyncio's loop, for which what other threads write would have to wait. They put all
  clients into one conversation, and `start_ws` lets any web page in: `main` takes one client, `websocket` looks at
  origins.
- Importing it takes as long as checking a hundred definitions: see `lazy_types` and `later`.
- `structure_message` is called for every object inside of a message, and makes classes that are taken apart again:
  messages stay plain JSON here.
- `handle_message` raises for anything that is not a JSON-RPC message, and its sender waits for ever; a request before
  `initialize` is served, one after `shutdown` is not answered.
- Requests of both sides share a table by id, so that a client that counts as the server does gets wrong answers.
- What a synchronous handler returns is its answer at once, so that it cannot be cancelled: a handler may return a
  future here. `set_result` on a future that was cancelled meanwhile raises: see `settle`.
- A handler's failure is sent with a traceback, one of the protocol without its data, and both as objects of attrs.
- `Progress` makes and converts classes of lsprotocol for four notifications, and shows what is over in a moment: see
  `progress`.
- `uris` has no path for what is on no disk, two for a file that a client writes in two ways, takes a folder `/C:` for a
  drive on systems that have none and `file://localhost/` for a share, and raises for a broken address: see `uris`.
- `_send_data` waits for a client that does not read, writes every message into the log, sends `params: null`, takes
  results apart object by object, and keeps what it cannot send to itself: `wire.Outbox` writes.
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from json import JSONDecodeError
from threading import Event
from typing import TYPE_CHECKING, Any, cast

from potto_lsp import failures, later
from potto_lsp.failures import RequestError
from potto_lsp.wire import framed

later.postpone()

from pygls.io_ import run  # noqa: E402  # what is to wait must be said before
from pygls.protocol import JsonRPCProtocol  # noqa: E402
from pygls.server import JsonRPCServer  # noqa: E402

if TYPE_CHECKING:
    from cattrs import Converter
    from lsprotocol.types import ResponseError
    from pygls.io_ import Reader

logger = logging.getLogger(__name__)
Id = int | str
_LATER = object()  # what stands for the result of a handler that has returned a future


def settle(future: Future[Any], result: Any = None, error: RequestError | None = None) -> None:
    """Answer a request, unless it was answered or cancelled already."""
    with suppress(InvalidStateError):
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)


class Protocol(JsonRPCProtocol):
    """JSON-RPC to the letter. `_server` knows what is allowed at this stage of the session."""

    _server: StreamServer

    def __init__(self, server: JsonRPCServer, converter: Converter) -> None:
        super().__init__(server, converter)
        self._asked: dict[Id, Future[Any]] = {}  # what the client waits for

    # Receiving

    def structure_message(self, data: dict[str, Any]) -> Any:
        return data

    def get_message_type(self, method: str) -> type[Any]:
        return dict

    def handle_message(self, message: Any) -> None:
        if not isinstance(message, dict):
            logger.error("a message that is not an object")
            self.fail(None, failures.INVALID_REQUEST, "a message is an object")
        elif not isinstance(method := message.get("method"), str):
            self._handle_response(cast(Id, message.get("id")), message.get("result"), message.get("error"))
        elif "id" not in message:
            self._handle_notification(method, message.get("params"))
        elif isinstance(id := message["id"], int | str) and not isinstance(id, bool):
            self._handle_request(id, method, message.get("params"))
        else:
            self.fail(None, failures.INVALID_REQUEST, "the id of a request is a number or a string")

    def _handle_request(self, msg_id: Id, method_name: str, params: Any) -> None:
        refused = self._server.refused(method_name)
        if refused is not None:
            self.fail(msg_id, refused.code, refused.message)
        elif method_name not in self.fm.features:
            self.fail(msg_id, failures.METHOD_NOT_FOUND, f"there is no method `{method_name}`")
        else:
            super()._handle_request(msg_id, method_name, params)

    def _handle_notification(self, method_name: str, params: Any) -> None:
        if method_name == "exit":  # at any time
            self._server.leave()
        elif method_name == "$/cancelRequest":  # also after `shutdown`: what was asked before it is still waited for
            self._handle_cancel_notification(params.get("id") if isinstance(params, Mapping) else None)
        elif not self._server.listens(method_name):
            logger.info("a notification out of time: %s", method_name)
        elif method_name in self.fm.features:
            super()._handle_notification(method_name, params)
        elif not method_name.startswith("$/"):
            logger.info("a notification that is not known: %s", method_name)

    def _handle_response(self, msg_id: Id, result: Any = None, error: Any = None) -> None:
        future = self._request_futures.pop(msg_id, None) if isinstance(msg_id, int | str) else None
        if future is None:
            logger.info("a response to what was not asked: %r", msg_id)
        elif error is None:
            settle(future, result)
        else:
            said = error if isinstance(error, Mapping) else {}
            code = said.get("code", failures.INTERNAL_ERROR)
            settle(future, error=RequestError(code, str(said.get("message", "")), said.get("data")))

    def _handle_cancel_notification(self, msg_id: Any) -> None:
        future = self._asked.get(msg_id) if isinstance(msg_id, int | str) else None
        if future is not None:
            future.cancel()

    # Answering

    def _execute_handler(
        self,
        msg_id: Id,
        handler: Callable[..., Any],
        callback: Callable[[Future[Any]], None],
        args: tuple[Any, ...] | None = None,
        kwargs: dict[str, Any] | None = None,
    ) -> None:
        def called(*args: Any, **kwargs: Any) -> Any:
            returned = handler(*args, **kwargs)
            if not isinstance(returned, Future):
                return returned
            self._asked[msg_id] = returned
            returned.add_done_callback(callback)
            return _LATER

        def unless_later(future: Future[Any]) -> None:
            if future.exception() is not None or future.result() is not _LATER:
                callback(future)

        super()._execute_handler(msg_id, called, unless_later, args, kwargs)

    def _send_handler_result(self, future: Future[Any], *, msg_id: Id) -> None:
        if self._asked.get(msg_id) is future:
            del self._asked[msg_id]
        if future.cancelled():
            self.fail(msg_id, failures.REQUEST_CANCELLED, "the request was cancelled")
            return
        match future.exception():
            case None:
                self._send_response(msg_id, future.result())
            case RequestError() as error:
                self.fail(msg_id, error.code, error.message, error.data)
            case error:
                logger.error("a request failed", exc_info=error)
                self.fail(msg_id, failures.INTERNAL_ERROR, f"internal error: {type(error).__name__}: {error}")

    # Sending

    def fail(self, id: Id | None, code: int, message: str, data: Any = None) -> None:
        """Answer with an error. `id` is None if the request had none that could be read."""
        error = {"code": code, "message": message}
        self._send_data({"id": id, "error": error if data is None else {**error, "data": data}})

    def _send_response(self, msg_id: Id, result: Any = None, error: ResponseError | None = None) -> None:
        if error is None:
            self._send_data({"id": msg_id, "result": result})
        else:
            self.fail(msg_id, error.code, error.message, error.data)

    def _send_data(self, data: Any) -> None:
        if data.get("params", data) is None:
            del data["params"]
        if self.writer is not None:
            self.writer.write(framed({"jsonrpc": self.VERSION, **data}))


class _Bodies:
    """Bodies of messages as a stream in the one form that `io_.run` knows."""

    def __init__(self, bodies: Iterator[bytes]) -> None:
        self._bodies = bodies
        self._body: bytes | None = None  # whose header was read

    def readline(self) -> bytes:
        """The header of the next message, then the empty line behind it; nothing at the end."""
        if self._body is not None:
            return b"\r\n"
        self._body = next(self._bodies, None)
        if self._body is None:
            return b""
        self._body = self._body or b" "  # a length of 0 would not count as one
        return b"Content-Length: %d\r\n" % len(self._body)

    def read(self, length: int) -> bytes | None:
        """The body whose header was read."""
        body, self._body = self._body, None
        return body


def _no_converter() -> Converter:
    """What converts messages to classes and back: nothing, they stay plain JSON."""
    return cast("Converter", None)


class StreamServer(JsonRPCServer, ABC):
    """A server of pygls that reads one stream on the thread that runs it, and knows when a session may ask what."""

    protocol: Protocol

    def __init__(self) -> None:
        super().__init__(Protocol, _no_converter)
        self._left = Event()

    def carry(self, bodies: Iterator[bytes]) -> int:
        """Handle messages until `exit` or their end; the exit status."""
        run(self._left, cast("Reader", _Bodies(bodies)), self.protocol, logger, self._not_handled)
        return self.status() if self._left.is_set() else 1

    def leave(self) -> None:
        """Read no more: the client says `exit`."""
        self._left.set()

    def _not_handled(self, error: Exception, source: object) -> None:
        """Something that pygls has logged was wrong with a message, or is with us."""
        if isinstance(error, JSONDecodeError | UnicodeDecodeError | RecursionError):
            logger.error("a message that is not JSON: %s", error)
            self.protocol.fail(None, failures.PARSE_ERROR, "this is not JSON")

    @abstractmethod
    def refused(self, method: str) -> RequestError | None:
        """Why a request is refused at this stage of the session, if it is."""

    @abstractmethod
    def listens(self, method: str) -> bool:
        """Whether notifications are heeded at this stage."""

    @abstractmethod
    def status(self) -> int:
        """The exit status, when the client says `exit`."""

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Log an error; the user could do nothing about it."""
        logger.error("%s", error)
