"""A raw client: JSON over the standard streams of a real server."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import threading
import time
from pathlib import Path
from queue import Empty, Queue
from typing import Any

EVERYTHING: dict[str, Any] = {
    "textDocument": {"publishDiagnostics": {"relatedInformation": True, "versionSupport": True}},
    "window": {"workDoneProgress": True},
}


class Client:
    """One server process and what it has said. `capabilities` are the client's."""

    def __init__(self, folder: Path | None = None, capabilities: dict[str, Any] | None = None, **params: Any) -> None:
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(self.command, stdin=pipe, stdout=pipe, stderr=pipe)
        self.notes: Queue[dict[str, Any]] = Queue()
        self.asked: Queue[dict[str, Any]] = Queue()
        self.answers: dict[Any, list[dict[str, Any]]] = {}
        self.arrived = threading.Condition()
        self.stderr = b""
        self._last = 0
        self.replies: dict[str, Any] = {"workspace/configuration": [{}]}  # what the server is answered; else null
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self._listener = threading.Thread(target=self._complaints, daemon=True)
        self._listener.start()
        self.capabilities = EVERYTHING if capabilities is None else capabilities
        self.folder, self.params = folder, params

    @property
    def command(self) -> list[str]:
        """How the server is started."""
        return [sys.executable, "-P", "-m", "potto", "lsp", "--stdio"]

    def start(self) -> dict[str, Any]:
        """`initialize` and `initialized`; the result of the first."""
        folders = [{"uri": self.folder.as_uri(), "name": "w"}] if self.folder else None
        params = {"processId": None, "capabilities": self.capabilities, "workspaceFolders": folders, **self.params}
        result: dict[str, Any] = self.ask("initialize", params)
        self.tell("initialized", {})
        return result

    def send(self, message: Any) -> None:
        self.send_raw(json.dumps(message).encode())

    def send_raw(self, body: bytes, header: bytes = b"Content-Length: %d\r\n\r\n") -> None:
        assert self.process.stdin is not None
        self.process.stdin.write((header % len(body) if b"%d" in header else header) + body)
        self.process.stdin.flush()

    def tell(self, method: str, params: Any) -> None:
        self.send({"jsonrpc": "2.0", "method": method, "params": params})

    def begin(self, method: str, params: Any) -> int:
        """Send a request; its id."""
        self._last += 1
        self.send({"jsonrpc": "2.0", "id": self._last, "method": method, "params": params})
        return self._last

    def answer(self, id: Any, seconds: float = 30) -> dict[str, Any]:
        """The whole answer to a request."""
        with self.arrived:
            assert self.arrived.wait_for(lambda: self.answers.get(id), seconds), f"no answer to {id}: {self.stderr!r}"
            return self.answers[id][0]

    def ask(self, method: str, params: Any, seconds: float = 30) -> Any:
        """The result of a request."""
        answer = self.answer(self.begin(method, params), seconds)
        assert "error" not in answer, answer
        return answer["result"]

    def error(self, method: str, params: Any) -> int:
        """The code of the error that a request is answered with."""
        code: int = self.answer(self.begin(method, params))["error"]["code"]
        return code

    def note(self, method: str, seconds: float = 30, **where: Any) -> Any:
        """The parameters of the next notification of a method, with these values in them."""
        until = time.monotonic() + seconds
        while True:
            try:
                note = self.notes.get(timeout=max(until - time.monotonic(), 0.001))
            except Empty:
                raise AssertionError(f"no {method} {where}: {self.stderr.decode()}") from None
            if note["method"] == method and all(note["params"].get(name) == value for name, value in where.items()):
                return note["params"]

    def open(self, uri: str, text: str, version: int = 1) -> None:
        item = {"uri": uri, "languageId": "potto", "version": version, "text": text}
        self.tell("textDocument/didOpen", {"textDocument": item})

    def change(self, uri: str, version: int | None, *changes: dict[str, Any]) -> None:
        document = {"uri": uri, "version": version}
        self.tell("textDocument/didChange", {"textDocument": document, "contentChanges": list(changes)})

    def stop(self, seconds: float = 10) -> int:
        """Leave politely; the exit status."""
        if self.process.poll() is None:
            self.ask("shutdown", None)
            self.tell("exit", None)
        return self.wait(seconds)

    def wait(self, seconds: float = 10) -> int:
        """Wait for its end, and until all that it has said is read; the exit status."""
        try:
            status = self.process.wait(seconds)
            self._reader.join(seconds)
            self._listener.join(1)  # a process of the server's may hold the other end for longer
            return status
        finally:
            self.process.kill()

    def _read(self) -> None:
        stream = self.process.stdout
        assert stream is not None
        while line := stream.readline():
            length = int(line.split(b":")[1])
            assert line.startswith(b"Content-Length: ") and stream.readline() == b"\r\n", line
            self._received(json.loads(stream.read(length)))

    def _received(self, message: dict[str, Any]) -> None:
        assert message["jsonrpc"] == "2.0"
        if "method" not in message:
            with self.arrived:
                self.answers.setdefault(message["id"], []).append(message)
                self.arrived.notify_all()
        elif "id" in message:
            self.asked.put(message)
            empty = self.replies.get(message["method"])
            with contextlib.suppress(BrokenPipeError):  # it may have gone since
                self.send({"jsonrpc": "2.0", "id": message["id"], "result": empty})
        else:
            self.notes.put(message)

    def _complaints(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.stderr += line


def edit(start: tuple[int, int], end: tuple[int, int], text: str) -> dict[str, Any]:
    """An incremental change."""
    (a, b), (c, d) = start, end
    return {"range": {"start": {"line": a, "character": b}, "end": {"line": c, "character": d}}, "text": text}
