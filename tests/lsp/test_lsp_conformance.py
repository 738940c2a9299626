"""The protocol to the letter: who may say what when, and one answer to every request."""

from __future__ import annotations

import io
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lsp_client import Client, edit

Server = Callable[..., Client]
Uri = Callable[[str], str]
PROGRAM = "def f(t)\n    integral [0, 1] [x < t] d(x)\n"
HERE = {"line": 0, "character": 4}


def test_the_greeting(server: Server) -> None:
    client = server(greet=False)
    result = client.start()
    assert result["serverInfo"]["name"] == "potto"
    assert result["capabilities"]["positionEncoding"] == "utf-16"
    assert result["capabilities"]["textDocumentSync"]["change"] == 2
    assert client.stop() == 0


@pytest.mark.parametrize(
    ("offered", "chosen"),
    [(["utf-8", "utf-16"], "utf-8"), (["utf-7", "utf-32"], "utf-32"), ([], "utf-16"), ("utf-8", "utf-16")],
)
def test_the_client_chooses_the_encoding(server: Server, uri: Uri, offered: Any, chosen: str) -> None:
    client = server({"general": {"positionEncodings": offered}}, greet=False)
    assert client.start()["capabilities"]["positionEncoding"] == chosen
    client.open(uri("main"), "# 𝄞é\ndef f(é)\n    é + ü\n")
    found = client.note("textDocument/publishDiagnostics", uri=uri("main"))["diagnostics"]
    (unknown,) = [d for d in found if d["code"] == "P0201"]
    assert unknown["range"]["start"] == {"line": 2, "character": 9 if chosen == "utf-8" else 8}


def test_a_request_before_initialize(server: Server) -> None:
    client = server(greet=False)
    assert client.error("textDocument/hover", {}) == -32002
    assert client.error("shutdown", None) == -32002
    client.tell("textDocument/didOpen", {"nonsense": 1})
    client.start()
    assert client.stop() == 0


def test_initialize_comes_once(server: Server) -> None:
    assert server().error("initialize", {"capabilities": {}}) == -32600


def test_a_request_after_shutdown(server: Server, uri: Uri) -> None:
    client = server()
    assert client.ask("shutdown", None) is None
    assert client.error("textDocument/hover", {"textDocument": {"uri": uri("main")}, "position": HERE}) == -32600
    client.tell("exit", None)
    assert client.wait() == 0


def test_nothing_is_lost_at_the_end() -> None:
    """`exit` right behind `shutdown`: both requests have their answers."""
    from potto_lsp.wire import Outbox

    class Slow(io.BytesIO):
        def write(self, data: Any) -> int:
            time.sleep(0.01)  # so that the end is there before the queue is looked at
            held.append(bytes(data))
            return len(data)

        def flush(self) -> None:
            sent.extend(held)
            held.clear()

    held: list[bytes] = []
    sent: list[bytes] = []
    outbox = Outbox(Slow())
    outbox.put({"id": 1, "result": None})
    outbox.close()
    assert len(sent) == 1 and not held


def test_who_writes_never_waits_for_a_client_that_does_not_read() -> None:
    """What the pipe takes is written at once, the rest when it is read, all of it in order."""
    from potto_lsp.wire import Outbox, bodies

    out, into = os.pipe()
    with os.fdopen(out, "rb") as reader, os.fdopen(into, "wb") as writer:
        outbox = Outbox(writer)
        outbox.put({"id": 0})
        assert select.select([reader], [], [], 0)[0], "a short message is there before `put` is over"
        for number in range(1, 60):
            outbox.put({"id": number, "result": "x" * 5000})  # four times what a pipe holds
        read = map(json.loads, bodies(reader))
        assert [next(read)["id"] for _ in range(60)] == list(range(60))
        outbox.put({"id": 60})
        assert next(read)["id"] == 60
        outbox.close()


def test_nothing_piles_up_for_a_client_that_is_gone() -> None:
    from potto_lsp.wire import Outbox

    out, into = os.pipe()
    os.close(out)
    with os.fdopen(into, "wb", buffering=0) as writer:
        outbox = Outbox(writer)
        for _ in range(3):
            outbox.put({"id": 1, "result": "x" * 5000})
            outbox._thread.join(5)
            assert not outbox._thread.is_alive() and outbox._queue.empty()


def test_exit_without_shutdown(server: Server) -> None:
    client = server()
    client.tell("exit", None)
    assert client.wait() == 1


def test_the_end_of_input(server: Server) -> None:
    client = server()
    assert client.process.stdin is not None
    client.process.stdin.close()
    assert client.wait() == 1


@pytest.mark.parametrize(
    "header", [b"content-length: %d\r\n\r\n", b"CONTENT-LENGTH:%d\r\nContent-Type: x; charset=utf-8\r\n\r\n",
               b"Content-Type: x\r\nContent-Length : %d\r\n\r\n", b"Content-Length: %d\n\n"],
)  # fmt: skip
def test_headers_in_any_case(server: Server, header: bytes) -> None:
    client = server(greet=False)
    greeting = {"jsonrpc": "2.0", "id": "a", "method": "initialize", "params": {"capabilities": {}, "rootUri": None}}
    client.send_raw(json.dumps(greeting).encode(), header)
    assert "capabilities" in client.answer("a")["result"]


@pytest.mark.parametrize("body", [b"{", b"\xff\xfe", b"", b"[" * 100_000])
def test_bad_json_is_logged_and_survived(server: Server, body: bytes) -> None:
    client = server()
    client.send_raw(body)
    assert client.answer(None)["error"]["code"] == -32700
    assert client.stop() == 0
    assert b"not JSON" in client.stderr


@pytest.mark.parametrize("message", [[], 3, "x", None, {"jsonrpc": "2.0", "id": {}, "method": "shutdown"}])
def test_what_is_no_message_is_answered(server: Server, message: Any) -> None:
    client = server()
    client.send(message)
    assert client.answer(None)["error"]["code"] == -32600
    assert client.stop() == 0


@pytest.mark.parametrize(
    ("method", "params"),
    [
        ("textDocument/hover", None),
        ("textDocument/hover", []),
        ("textDocument/hover", {"textDocument": {"uri": 3}, "position": HERE}),
        ("textDocument/hover", {"textDocument": {"uri": "file:///x.po"}}),
        ("textDocument/hover", {"textDocument": {"uri": "file:///x.po"}, "position": {"line": -1, "character": 0}}),
        ("textDocument/hover", {"textDocument": {"uri": "file:///x.po"}, "position": {"line": "0", "character": 0}}),
        ("textDocument/inlayHint", {"textDocument": {"uri": "file:///x.po"}, "range": 3}),
        ("textDocument/rename", {"textDocument": {"uri": "file:///x.po"}, "position": HERE, "newName": 3}),
        ("workspace/executeCommand", {"command": "potto.nothing"}),
        ("workspace/executeCommand", {"command": "potto.evaluate", "arguments": [3]}),
        ("callHierarchy/incomingCalls", {"item": {"data": 3}}),
    ],
)
def test_malformed_parameters_are_answered(server: Server, method: str, params: Any) -> None:
    assert server().error(method, params) == -32602


@pytest.mark.parametrize("params", [None, [], {}, {"textDocument": 3}, {"textDocument": {"uri": "x"}}])
@pytest.mark.parametrize(
    "method", ["textDocument/didOpen", "textDocument/didChange", "workspace/didChangeWatchedFiles"]
)
def test_malformed_notifications_are_logged(server: Server, method: str, params: Any) -> None:
    client = server()
    client.tell(method, params)
    assert client.ask("textDocument/hover", {"textDocument": {"uri": "file:///x.po"}, "position": HERE}) is None
    assert client.stop() == 0


def test_unknown_methods(server: Server) -> None:
    client = server()
    assert client.error("textDocument/nonsense", {}) == -32601
    assert client.error("$/nonsense", {}) == -32601
    client.tell("textDocument/nonsense", {})
    client.tell("$/nonsense", {})
    assert client.stop() == 0


def test_a_change_of_an_unknown_document_is_survived(server: Server, uri: Uri) -> None:
    client = server()
    client.change(uri("nowhere"), 2, {"text": "x"})
    client.tell("textDocument/didClose", {"textDocument": {"uri": uri("nowhere")}})
    assert client.stop() == 0


def test_an_older_version_is_dropped(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), "def f(t)\n    t\n", version=5)
    client.change(uri("main"), 4, {"text": "def f(t)\n    unknown\n"})
    client.change(uri("main"), 6, edit((1, 4), (1, 5), "other"))
    found = client.note("textDocument/publishDiagnostics", uri=uri("main"), version=6)["diagnostics"]
    assert "`other`" in found[0]["message"]


def test_printing_does_not_break_the_stream() -> None:
    """What is printed in the server, also below Python, goes to standard error."""
    code = (
        "import os, sys, potto_lsp.server as s\n"
        "old = s.Server.run\n"
        "def run(self):\n    print('HELLO'); os.system('echo SHELL'); os.write(1, b'RAW\\n'); return old(self)\n"
        "s.Server.run = run\n"
        "from potto.__main__ import main\nsys.exit(main(['lsp']))"
    )
    greeting = {"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {"capabilities": {}}}
    body = json.dumps(greeting).encode()
    done = subprocess.run(
        [sys.executable, "-c", code], input=b"Content-Length: %d\r\n\r\n%b" % (len(body), body),
        capture_output=True, timeout=30, check=False,
    )  # fmt: skip
    assert done.stdout.startswith(b"Content-Length: ")
    assert all(word in done.stderr and word not in done.stdout for word in (b"HELLO", b"SHELL", b"RAW"))


def test_the_server_ends_with_its_client(tmp_path: Path) -> None:
    """Though somebody else holds its input open."""
    parent = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    client = Client(tmp_path, processId=parent.pid)
    client.start()
    parent.kill()
    parent.wait()
    assert client.wait(seconds=10) == 1


def test_it_speaks_on_a_socket(tmp_path: Path) -> None:
    log = tmp_path / "potto.log"
    command = [sys.executable, "-m", "potto", "lsp", "--tcp", "127.0.0.1:0", "--log", str(log)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        port = int(process.stderr.readline().rpartition(":")[2])
        with socket.create_connection(("127.0.0.1", port)) as connection:
            body = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {"capabilities": {}}})
            connection.sendall(f"Content-Length: {len(body)}\r\n\r\n{body}".encode())
            assert connection.recv(100).startswith(b"Content-Length: ")
        assert process.wait(10) == 1
        assert log.exists()
    finally:
        process.kill()


def test_a_cancelled_request_is_answered_at_once(server: Server, uri: Uri) -> None:
    """Also one that has begun: a script that would run for minutes."""
    client = server(main="f = \\(t) . integral [0, 1] [x < t] d(x)\n#> f(0.5)\n")
    slow = {"command": "potto.evaluate", "arguments": [uri("main"), "f(0.25)"]}
    id = client.begin("workspace/executeCommand", slow)
    begun = time.monotonic()
    client.tell("$/cancelRequest", {"id": id})
    assert client.answer(id)["error"]["code"] == -32800
    assert time.monotonic() - begun < 2.0  # far below the start of the evaluation process on a busy machine
    client.tell("$/cancelRequest", {"id": id})
    client.tell("$/cancelRequest", {"id": "never"})
    client.tell("$/cancelRequest", None)
    assert client.stop() == 0


def test_the_server_loads_no_numbers() -> None:
    """Greeting, checking and every question but evaluation work without numpy and the like."""
    code = (
        "import sys, potto_lsp.main, potto_lsp.session, potto_lsp.analysis, potto_lsp.live, potto_lsp.publishing\n"
        "from potto_lsp.features import FEATURES\n"
        "[feature.answer for feature in FEATURES.values()]\n"
        "late = ('numpy', 'scipy', 'llvmlite', 'prompt_toolkit', 'matplotlib', 'mpmath')\n"
        "print([m for m in late if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_greeting_waits_for_no_analysis() -> None:
    late = ("potto.checking.check", "lark", "asyncio")
    code = f"import sys, potto_lsp.main; print([m for m in {late} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_first_diagnostics_wait_for_no_feature() -> None:
    """Not even those of live expressions: `potto.ide` loads a module when one of its questions is asked."""
    features = ("potto.ide.hover", "potto.ide.actions", "potto.ide.completion", "potto.ide.display")
    code = (
        "import sys, potto_lsp.live, potto.checking.check\n"
        "from potto.ide import live_diagnostics\n"
        f"print([m for m in {features} if m in sys.modules])\n"
        "from potto import ide\n"
        "print([name for name in ide.__all__ if not hasattr(ide, name)])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n") == ["[]", "[]", ""]


def test_an_interrupt_ends_it(server: Server) -> None:
    client = server()
    client.process.send_signal(getattr(signal, "CTRL_C_EVENT", signal.SIGINT))
    assert client.wait() == 130
