"""Bugs of ours are answered, logged and survived; a server in this process, on pipes, with features that fail."""

from __future__ import annotations

import io
import json
import logging
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from potto_lsp import server
from potto_lsp.features import Feature
from potto_lsp.wire import Outbox, bodies

from potto.checking import check

HOVER = "textDocument/hover"


class Pipe:
    """A server on pipes."""

    def __init__(self) -> None:
        (inner, outer), (answers, writer) = os.pipe(), os.pipe()
        self.out, self.answers = os.fdopen(outer, "wb", buffering=0), os.fdopen(answers, "rb")
        self.server = server.Server(bodies(os.fdopen(inner, "rb")), Outbox(os.fdopen(writer, "wb")))
        self.thread = threading.Thread(target=self.server.run)
        self.thread.start()
        self.notes: list[dict[str, Any]] = []

    def send(self, **message: Any) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.out.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))

    def read(self) -> dict[str, Any]:
        length = int(self.answers.readline().split(b":")[1])
        self.answers.readline()
        message: dict[str, Any] = json.loads(self.answers.read(length))
        return message

    def ask(self, id: int, method: str, params: Any) -> dict[str, Any]:
        self.send(id=id, method=method, params=params)
        while (message := self.read()).get("id") != id:
            self.notes.append(message)
        return message


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    made = Pipe()
    made.ask(0, "initialize", {"capabilities": {}})
    yield made
    made.out.close()
    made.thread.join(10)


def document(version: int, text: str = "def f(t) t\n") -> dict[str, Any]:
    return {"textDocument": {"uri": "untitled:x", "languageId": "potto", "version": version, "text": text}}


def test_three_failures_in_a_row_switch_a_feature_off(pipe: Pipe, monkeypatch: pytest.MonkeyPatch, caplog: Any) -> None:
    calls = []

    def broken(ask: Any) -> None:
        calls.append(ask)
        raise ZeroDivisionError("a bug")

    feature = Feature(HOVER, "hovering.hover")
    feature.__dict__["answer"] = broken
    monkeypatch.setitem(server.FEATURES, HOVER, feature)
    pipe.send(method="textDocument/didOpen", params=document(1))
    params = {"textDocument": {"uri": "untitled:x"}, "position": {"line": 0, "character": 0}}
    with caplog.at_level(logging.ERROR):
        for id in (1, 2, 3):
            assert pipe.ask(id, HOVER, params)["error"]["code"] == -32603
        assert pipe.ask(4, HOVER, params)["result"] is None
    assert len(calls) == 3 and "ZeroDivisionError" in caplog.text
    assert any("is off" in str(note) for note in pipe.notes)
    change = {"textDocument": {"uri": "untitled:x", "version": 2}, "contentChanges": [{"text": "x = 1\n"}]}
    pipe.send(method="textDocument/didChange", params=change)
    assert pipe.ask(5, HOVER, params)["error"]["code"] == -32603
    assert pipe.ask(6, "textDocument/foldingRange", params)["result"] is not None


def test_what_fails_for_the_workspace_is_off_until_the_next_edit(pipe: Pipe, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(ask: Any) -> None:
        raise ZeroDivisionError("a bug")

    feature = Feature("workspace/symbol", "outlines.workspace_symbols")
    feature.__dict__["answer"] = broken
    monkeypatch.setitem(server.FEATURES, "workspace/symbol", feature)
    codes = [pipe.ask(id, "workspace/symbol", {"query": ""}).get("error", {}).get("code") for id in range(1, 6)]
    assert codes == [-32603] * 3 + [None] * 2
    pipe.send(method="textDocument/didOpen", params=document(1))
    assert pipe.ask(9, "workspace/symbol", {"query": ""})["error"]["code"] == -32603


def test_what_fails_to_resolve_is_off_for_its_file_alone(pipe: Pipe, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(ask: Any) -> str:
        if ask.params["data"]["uri"] == "untitled:x":
            raise ZeroDivisionError("a bug")
        return "fine"

    feature = Feature("completionItem/resolve", "completing.resolve")
    feature.__dict__["answer"] = broken
    monkeypatch.setitem(server.FEATURES, "completionItem/resolve", feature)
    pipe.send(method="textDocument/didOpen", params=document(1))
    bad, good = ({"label": "f", "data": {"uri": uri}} for uri in ("untitled:x", "untitled:y"))
    answers = [pipe.ask(id, "completionItem/resolve", bad) for id in range(1, 5)]
    assert ["error" in answer for answer in answers] == [True, True, True, False]
    assert pipe.ask(9, "completionItem/resolve", good)["result"] == "fine"
    change = {"textDocument": {"uri": "untitled:x", "version": 2}, "contentChanges": [{"text": "x = 1\n"}]}
    pipe.send(method="textDocument/didChange", params=change)
    assert "error" in pipe.ask(10, "completionItem/resolve", bad)


def test_a_check_that_fails_costs_one_definition(
    pipe: Pipe, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    original = check.definition_diagnostics

    def broken(db: Any, file: str, name: str) -> Any:
        if name == "g":
            raise ZeroDivisionError("a bug")
        return original(db, file, name)

    monkeypatch.setattr("potto.checking.check.definition_diagnostics", broken)
    text = "def f(t) one\ndef g(t) two\ndef h(t) three\n"
    with caplog.at_level(logging.ERROR):
        pipe.send(method="textDocument/didOpen", params=document(1, text))
        while (note := pipe.read()).get("method") != "textDocument/publishDiagnostics":
            pass
    lines = [said["range"]["start"]["line"] for said in note["params"]["diagnostics"]]
    assert lines == [0, 2]
    assert "the check of g" in caplog.text


def test_a_live_expression_that_fails_costs_no_other_diagnostics(
    pipe: Pipe, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(db: Any, file: str) -> Any:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr("potto.ide.live_diagnostics", broken)
    with caplog.at_level(logging.ERROR):
        pipe.send(method="textDocument/didOpen", params=document(1, "def f(t) one\n#> f(1)\n"))
        while (note := pipe.read()).get("method") != "textDocument/publishDiagnostics":
            pass
    assert [said["code"] for said in note["params"]["diagnostics"]] == ["P0201"]
    assert "live expressions" in caplog.text


def test_a_client_that_does_not_read_does_not_stop_the_server() -> None:
    """Thousands of answers wait while the server goes on reading."""
    pipe = Pipe()
    pipe.ask(0, "initialize", {"capabilities": {}})
    for id in range(1, 5_000):
        pipe.send(id=id, method="textDocument/nonsense", params={"filler": "x" * 100})
    ids = {pipe.read()["id"] for _ in range(1, 5_000)}
    assert ids == set(range(1, 5_000))
    pipe.out.close()
    pipe.thread.join(10)


def test_messages_that_end_too_early() -> None:
    assert list(bodies(io.BytesIO(b"Content-Length: 10\r\n\r\n{}"))) == []
    assert list(bodies(io.BytesIO(b"nonsense\r\n\r\nContent-Length: x\r\n\r\nContent-Length: 2\r\n\r\n{}"))) == [b"{}"]
    assert list(bodies(io.BytesIO(b"Content-Length: 99999999999999\r\n\r\n"))) == []


@pytest.mark.parametrize("first", [b"POST / HTTP/1.1", b"GET /chat HTTP/1.1"])
def test_a_web_page_cannot_speak_to_the_server(first: bytes) -> None:
    request = first + b"\r\nHost: localhost:7\r\nOrigin: https://elsewhere\r\nContent-Length: 2\r\n\r\n{}"
    assert list(bodies(io.BytesIO(request))) == []
    assert list(bodies(io.BytesIO(b"Content-Length: 2\r\n\r\n{}" + request))) == [b"{}"]


def test_a_server_that_cannot_start_its_analysis_ends() -> None:
    """It would answer nothing for ever; one that ends is started again."""
    code = (
        "import sys, potto_lsp.session as s\n"
        "def load(self): raise ImportError('half of an installation')\n"
        "s.ClientSession.load = load\n"
        "from potto.__main__ import main\nsys.exit(main(['lsp']))"
    )
    greeting = {"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {"capabilities": {}}}
    body = json.dumps(greeting).encode()
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE)  # fmt: skip
    assert process.stdin is not None and process.stderr is not None
    process.stdin.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
    process.stdin.flush()  # and it stays open
    assert process.wait(30) == 70
    assert b"half of an installation" in process.stderr.read()
