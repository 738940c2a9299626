"""The server on a WebSocket: one client, a message in each frame, and no web page that was not let in."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("websockets")
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

PAGE = "https://editor.example"
Door = tuple[subprocess.Popen[str], str]


@pytest.fixture
def door() -> Iterator[Door]:
    """A server and its address. Pages of `PAGE` are let in."""
    command = [sys.executable, "-m", "potto", "lsp", "--ws", "127.0.0.1:0", "--origin", PAGE]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    try:
        yield process, "ws://" + process.stderr.readline().split()[-1]
    finally:
        process.kill()


def ask(client: ClientConnection, id: int, method: str, params: Any) -> Any:
    """The answer to a request; what is told meanwhile is passed over."""
    client.send(json.dumps({"jsonrpc": "2.0", "id": id, "method": method, "params": params}))
    while (message := json.loads(client.recv(30))).get("id") != id:
        pass
    return message


def tell(client: ClientConnection, method: str, params: Any) -> None:
    client.send(json.dumps({"jsonrpc": "2.0", "method": method, "params": params}))


@pytest.mark.parametrize("origin", [None, PAGE])
def test_a_session(door: Door, origin: Any) -> None:
    process, address = door
    with connect(address, origin=origin) as client:
        assert ask(client, 1, "initialize", {"capabilities": {}})["result"]["serverInfo"]["name"] == "potto"
        tell(client, "initialized", {})
        item = {"uri": "file:///f.po", "languageId": "potto", "version": 1, "text": "Ω = 1\ndef f(t) t + Ω\n"}
        tell(client, "textDocument/didOpen", {"textDocument": item})
        where = {"textDocument": {"uri": "file:///f.po"}, "position": {"line": 1, "character": 4}}
        assert "f : " in str(ask(client, 2, "textDocument/hover", where)["result"])
        symbols = ask(client, 3, "textDocument/documentSymbol", {"textDocument": {"uri": "file:///f.po"}})["result"]
        assert [symbol["name"] for symbol in symbols] == ["Ω", "f"]
        client.send("this is no message")
        assert json.loads(client.recv(30))["error"]["code"] == -32700
        assert ask(client, 4, "shutdown", None)["result"] is None
        tell(client, "exit", None)
        with pytest.raises(ConnectionClosed):
            while True:
                client.recv(30)
    assert process.wait(10) == 0


def test_pages_of_other_origins_are_kept_out(door: Door) -> None:
    process, address = door
    for origin in ("https://elsewhere.example", "null", PAGE + ".elsewhere.example"):
        with pytest.raises(InvalidStatus, match="403"):
            connect(address, origin=origin)  # type: ignore[arg-type]
    with connect(address) as client:  # the door is still open for who may come in
        assert "result" in ask(client, 1, "initialize", {"capabilities": {}})
    assert process.wait(10) == 1, "it left without a word"


def test_a_second_client_is_turned_away(door: Door) -> None:
    _, address = door
    with connect(address) as first:
        assert "result" in ask(first, 1, "initialize", {"capabilities": {}})  # from here on it is the one
        with connect(address) as second, pytest.raises(ConnectionClosed) as told:
            second.recv(30)
        assert told.value.rcvd is not None and told.value.rcvd.code == 1013
        assert ask(first, 2, "shutdown", None)["result"] is None
