"""A raw client of language servers: JSON over standard streams, everything with the time of its arrival."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

PUSHED = "textDocument/publishDiagnostics"
OURS = (sys.executable, "-P", "-m", "potto", "lsp")
CAPABILITIES: dict[str, Any] = {
    "window": {"workDoneProgress": True},
    "workspace": {"configuration": True, "workspaceFolders": True},
    "textDocument": {
        "publishDiagnostics": {"versionSupport": True},
        "documentSymbol": {"hierarchicalDocumentSymbolSupport": True},
        "semanticTokens": {"requests": {"full": {"delta": True}, "range": True}, "tokenTypes": [], "tokenModifiers": [],
                           "formats": ["relative"]},
        "hover": {"contentFormat": ["markdown"]}, "completion": {"completionItem": {"snippetSupport": True}},
        "codeLens": {}, "inlayHint": {}, "foldingRange": {}, "documentLink": {}, "formatting": {},
    },
}  # fmt: skip


def _bind(process: int, processors: set[int]) -> None:
    """Let all threads of a process run on these processors only."""
    with suppress(OSError):
        for thread in os.listdir(f"/proc/{process}/task"):
            os.sched_setaffinity(int(thread), processors)


class Client:
    """A raw client; everything that arrives is kept with the time of its arrival."""

    def __init__(
        self, folder: Path, command: Sequence[str] = OURS, language: str = "potto", suffix: str = "po"
    ) -> None:
        self.started = time.perf_counter()
        pipe, errors = subprocess.PIPE, None if command is OURS else subprocess.DEVNULL
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=errors)
        self.language, self.suffix = language, suffix
        self.inbox: SimpleQueue[tuple[float, dict[str, Any]]] = SimpleQueue()
        threading.Thread(target=self._read, daemon=True).start()
        self.folder, self._last, self.versions = folder, 0, dict[str, int]()
        folders = [{"uri": folder.as_uri(), "name": "bench"}]
        id = self.begin("initialize", {"capabilities": CAPABILITIES, "workspaceFolders": folders, "processId": None,
                                       "rootUri": folder.as_uri()})  # fmt: skip
        arrived, answer = self.until(lambda m: m.get("id") == id and "method" not in m)
        self.greeted = arrived - self.started
        self.capabilities: dict[str, Any] = answer["result"]["capabilities"]
        self.errors: dict[str, int] = {}  # how many diagnostics each document had when it was opened
        self.tell("initialized", {})

    @contextmanager
    def apart(self) -> Iterator[None]:
        """The server and this process on a processor each, where there are several: on one both take a third longer for
        seconds at a time, which says something of the scheduler, and nothing of the server."""
        every = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set[int]()
        if len(every) < 2:
            yield
            return
        first, *rest = sorted(every)
        _bind(self.process.pid, {first})
        _bind(os.getpid(), set(rest))
        try:
            yield
        finally:
            _bind(os.getpid(), every)
            _bind(self.process.pid, every)

    def send(self, message: dict[str, Any]) -> float:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        assert self.process.stdin is not None
        sent = time.perf_counter()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        self.process.stdin.flush()
        return sent

    def tell(self, method: str, params: Any) -> float:
        return self.send({"method": method, "params": params})

    def begin(self, method: str, params: Any) -> int:
        self._last += 1
        self.send({"id": self._last, "method": method, "params": params})
        return self._last

    def ask(self, method: str, params: Any) -> tuple[float, dict[str, Any]]:
        """Seconds to the answer, and the answer."""
        sent = time.perf_counter()
        id = self.begin(method, params)
        arrived, message = self.until(lambda m: m.get("id") == id and "method" not in m)
        return arrived - sent, message

    def until(self, wanted: Callable[[dict[str, Any]], bool], seconds: float = 120) -> tuple[float, dict[str, Any]]:
        end = time.perf_counter() + seconds
        while True:
            arrived, message = self.inbox.get(timeout=max(end - time.perf_counter(), 0.01))
            if wanted(message):
                return arrived, message

    def quiet(self, seconds: float = 0.3) -> float:
        """Wait until nothing has come for so long; when the last thing came."""
        last = time.perf_counter()
        while True:
            try:
                last, _ = self.inbox.get(timeout=seconds)
            except Empty:
                return last

    def uri(self, module: str) -> str:
        return (self.folder / f"{module}.{self.suffix}").as_uri()

    def open(self, module: str, text: str) -> float:
        self.versions[module] = 1
        item = {"uri": self.uri(module), "languageId": self.language, "version": 1, "text": text}
        return self.tell("textDocument/didOpen", {"textDocument": item})

    def change(self, module: str, *changes: dict[str, Any]) -> float:
        self.versions[module] += 1
        document = {"uri": self.uri(module), "version": self.versions[module]}
        return self.tell("textDocument/didChange", {"textDocument": document, "contentChanges": list(changes)})

    def diagnosed(self, module: str) -> float:
        """When the diagnostics of the present version came."""
        uri, version = self.uri(module), self.versions[module]
        arrived, message = self.until(lambda m: m.get("method") == PUSHED and m["params"]["uri"] == uri
                                      and m["params"].get("version", version) == version)  # fmt: skip
        self.errors.setdefault(uri, len(message["params"]["diagnostics"]))
        return arrived

    def memory(self) -> float:
        """The resident memory in MB, with that of the processes it has started, as Linux tells it."""
        total = 0.0
        for process in self._processes():
            status = Path(f"/proc/{process}/status").read_text()
            total += int(status.partition("VmRSS:")[2].split()[0]) / 1024
        return total

    def processor(self) -> float:
        """The seconds of processor time that the server has used so far, all threads and what it has started and that
        still runs, as Linux tells them."""
        used = 0
        for process in self._processes():
            for task in Path(f"/proc/{process}/task").iterdir():
                with suppress(OSError):  # it has ended
                    used += int((task / "schedstat").read_text().split()[0])
        return used / 1e9

    def ended(self) -> float:
        """The seconds of processor time of processes that it has started and that have ended."""
        stat = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(stat[13]) + int(stat[14])) / os.sysconf("SC_CLK_TCK")

    def _processes(self) -> list[int]:
        found = [self.process.pid]
        for process in found:
            with suppress(OSError):
                children = Path(f"/proc/{process}/task/{process}/children").read_text()
                found += map(int, children.split())
        return found

    def _read(self) -> None:
        stream = self.process.stdout
        assert stream is not None
        length = 0
        while line := stream.readline():
            if line.lower().startswith(b"content-length:"):
                length = int(line.split(b":")[1])
            if line.strip():
                continue
            message = json.loads(stream.read(length))
            self.inbox.put((time.perf_counter(), message))
            if "method" in message and "id" in message:
                settings = (
                    [{}] * len(message["params"].get("items", [])) if "configuration" in message["method"] else None
                )
                self.send({"id": message["id"], "result": settings})


def replace(line: int, start: int, end: int, text: str) -> dict[str, Any]:
    return between((line, start), (line, end), text)


def between(start: tuple[int, int], end: tuple[int, int], text: str) -> dict[str, Any]:
    places = [{"line": line, "character": character} for line, character in (start, end)]
    return {"range": {"start": places[0], "end": places[1]}, "text": text}
