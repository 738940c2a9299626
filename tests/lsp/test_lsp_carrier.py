"""What pygls carries, and lsprotocol's classes that are made when they are looked at."""

from __future__ import annotations

import json
import subprocess
import sys
from concurrent.futures import Future
from typing import Any

import pytest
from potto_lsp.carrier import Protocol, StreamServer, settle
from potto_lsp.failures import RequestError

LAZILY = """
import sys
from potto_lsp import later
later.postpone()
from lsprotocol import types
assert types.Position.__name__ == "Position"
import attrs
assert attrs.define.__module__.startswith("attr"), "attrs is as it was"
place = types.Position(1, character=2)
assert place == types.Position(1, 2) != types.Position(2, 2)
assert [field.name for field in attrs.fields(types.Range)] == ["start", "end"]
from lsprotocol import converters
converter = converters.get_converter()
read = converter.structure({"range": {"start": {"line": 1, "character": 2}, "end": {"line": 3, "character": 4}},
                            "newText": "x"}, types.TextEdit)
assert read == types.TextEdit(types.Range(types.Position(1, 2), types.Position(3, 4)), "x")
assert converter.unstructure(read)["newText"] == "x"
try:
    types.Position("one", 2)
except (TypeError, ValueError):
    print("checked")
"""


class Written:
    """A writer that keeps what is sent."""

    def __init__(self) -> None:
        self.messages: list[dict[str, Any]] = []

    def write(self, data: bytes) -> None:
        head, _, body = data.partition(b"\r\n\r\n")
        assert head == b"Content-Length: %d" % len(body)
        self.messages.append(json.loads(body))

    def close(self) -> None:
        """Nothing to do."""


class Always(StreamServer):
    """A server that takes everything at any time."""

    def refused(self, method: str) -> RequestError | None:
        return None

    def listens(self, method: str) -> bool:
        return True

    def status(self) -> int:
        return 0


@pytest.fixture
def made() -> tuple[Always, Written]:
    server, written = Always(), Written()
    server.protocol.set_writer(written)
    return server, written


def test_classes_of_the_protocol_made_late_are_what_they_are() -> None:
    found = subprocess.run([sys.executable, "-c", LAZILY], capture_output=True, text=True, check=False)
    assert found.returncode == 0 and found.stdout == "checked\n", found.stderr


def test_an_answer_may_come_later_and_once(made: tuple[Always, Written]) -> None:
    server, written = made
    later: Future[Any] = Future()
    server.feature("slow")(lambda params: later)
    server.protocol.handle_message({"id": 1, "method": "slow"})
    assert written.messages == []
    settle(later, 5)
    settle(later, 6)
    assert written.messages == [{"jsonrpc": "2.0", "id": 1, "result": 5}]


def test_what_is_cancelled_is_answered_once(made: tuple[Always, Written]) -> None:
    server, written = made
    later: Future[Any] = Future()
    server.feature("slow")(lambda params: later)
    server.protocol.handle_message({"id": 1, "method": "slow"})
    for _ in range(2):
        server.protocol.handle_message({"method": "$/cancelRequest", "params": {"id": 1}})
    settle(later, 5)
    assert [(m["id"], m["error"]["code"]) for m in written.messages] == [(1, -32800)]


def test_what_was_asked_before_the_end_can_be_cancelled_after_it(
    made: tuple[Always, Written], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As Visual Studio Code does between `shutdown` and `exit`."""
    server, written = made
    server.feature("later")(lambda params: Future[Any]())
    server.protocol.handle_message({"jsonrpc": "2.0", "id": 1, "method": "later"})
    monkeypatch.setattr(server, "listens", lambda method: False)
    server.protocol.handle_message({"method": "$/cancelRequest", "params": {"id": 1}})
    (answer,) = written.messages
    assert answer["id"] == 1 and answer["error"]["code"] == -32800


def test_ids_of_both_sides_are_apart(made: tuple[Always, Written]) -> None:
    """A client that counts as we do is answered, and what it answers counts."""
    server, written = made
    asked = server.protocol.send_request("workspace/configuration", msg_id="a")
    server.feature("echo")(lambda params: params)
    server.protocol.handle_message({"id": "a", "method": "echo", "params": [1]})
    server.protocol.handle_message({"id": "a", "result": 7})
    assert written.messages == [
        {"jsonrpc": "2.0", "id": "a", "method": "workspace/configuration"},
        {"jsonrpc": "2.0", "id": "a", "result": [1]},
    ]
    assert asked.result(0) == 7


def test_what_fails_is_an_error_without_a_traceback(made: tuple[Always, Written]) -> None:
    server, written = made

    def broken(params: Any) -> None:
        raise ZeroDivisionError("a bug")

    server.feature("broken")(broken)
    server.protocol.handle_message({"id": 1, "method": "broken"})
    server.protocol.handle_message({"id": 2, "method": "unknown"})
    errors = [m["error"] for m in written.messages]
    assert errors[0] == {"code": -32603, "message": "internal error: ZeroDivisionError: a bug"}
    assert errors[1]["code"] == -32601
    assert isinstance(server.protocol, Protocol)


POSTPONED = """
import sys
import potto_lsp.server
waiting = {"asyncio.events", "attr", "cattrs.converters", "lsprotocol._hooks", "pygls.workspace", "ssl"}
loaded = waiting & set(sys.modules)
assert not loaded and "Position" not in vars(sys.modules["lsprotocol.types"]), loaded
from lsprotocol import converters, types
assert converters.get_converter().unstructure(types.Position(1, 2)) == {"line": 1, "character": 2}
import asyncio
async def three(): return 3
assert not asyncio.iscoroutinefunction(len) and asyncio.iscoroutinefunction(three)
assert asyncio.run(three()) == 3 and asyncio.iscoroutinefunction.__module__ == "asyncio.coroutines"
import cattrs
assert cattrs.Converter(), "while it waits, what stands for it makes one"
assert cattrs.Converter.__module__ == "cattrs.converters" and not hasattr(cattrs, "nothing")
import attrs
assert attrs.asdict(types.Position(1, 2)) == {"line": 1, "character": 2} and attrs.define.__module__ == "attr._next_gen"
from pygls import protocol
from pygls.lsp.server import LanguageServer
server = LanguageServer("one", "1")
assert type(server.protocol) is protocol.LanguageServerProtocol, "of pygls' own server, in the same process"
@server.feature("textDocument/hover", types.HoverOptions())
def hover(params): ...
from pygls.protocol import json_rpc
assert json_rpc.JsonRPCNotification("a", "2.0", None) == json_rpc.JsonRPCNotification("a", "2.0", None)
assert json_rpc.ResponseErrorMessage is types.ResponseErrorMessage
from cattrs.errors import ClassValidationError
assert json_rpc.ClassValidationError is ClassValidationError and issubclass(ClassValidationError, Exception)
print("whole")
"""


def test_what_is_postponed_is_whole_when_it_is_looked_at() -> None:
    done = subprocess.run([sys.executable, "-c", POSTPONED], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "whole"
