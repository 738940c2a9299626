"""What the server loads and when, and what it says while it works: read off real servers."""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lsp_client import EVERYTHING, Client
from potto_lsp import collector
from potto_lsp.progress import WorkProgress

Server = Callable[..., Client]
Uri = Callable[[str], str]
HEAVY = ("numpy", "scipy", "llvmlite", "mpmath", "matplotlib", "prompt_toolkit")
TEXT = "def f(t)\n    integral [0, 1] [x < t] * x d(x)\n#> f(0.5)\ny = f(0.25)\n"
# Says on standard error, when it is asked, which heavy modules the server has and how many texts of open files.
SPY = f"""
import gc, sys
from potto_lsp import notifications
from potto_lsp.documents import Document
from potto.__main__ import main
def told(server, params):
    found = [name for name in {HEAVY!r} if name in sys.modules]
    gc.unfreeze()
    print("DOCUMENTS", sum(isinstance(o, Document) for o in gc.get_objects()), file=sys.stderr)
    print("LOADED", found, file=sys.stderr, flush=True)
notifications.NOTIFICATIONS["$/spy"] = told
sys.exit(main(["lsp"]))
"""


class Spied(Client):
    """A client of a real server that can be asked what it has loaded."""

    def __init__(self, folder: Path, capabilities: dict[str, Any]) -> None:
        super().__init__(folder, capabilities)

    @property
    def command(self) -> list[str]:
        return [sys.executable, "-c", SPY]

    def loaded(self) -> list[str]:
        before = self.stderr.count(b"LOADED")
        self.tell("$/spy", {})
        until = time.monotonic() + 20
        while self.stderr.count(b"LOADED") == before or not self.stderr.endswith(b"\n"):
            assert time.monotonic() < until, self.stderr
            time.sleep(0.01)
        found: list[str] = json.loads(self.stderr.decode().rpartition("LOADED ")[2].strip().replace("'", '"'))
        return found

    def documents(self) -> int:
        """How many documents there were when it was asked last."""
        return int(self.stderr.rpartition(b"DOCUMENTS ")[2].split()[0])


def test_no_numbers_are_loaded_but_in_the_evaluation_process(tmp_path: Path) -> None:
    """Neither before the first live expression nor after it: numbers are the business of another process."""
    main = tmp_path / "main.po"
    main.write_text(TEXT)
    client = Spied(tmp_path, {**EVERYTHING, "workspace": {"inlayHint": {"refreshSupport": True}}})
    client.start()
    client.open(main.as_uri(), TEXT)
    client.note("textDocument/publishDiagnostics", uri=main.as_uri())
    document = {"textDocument": {"uri": main.as_uri()}}
    place = {**document, "position": {"line": 0, "character": 4}}
    whole = {**document, "range": {"start": {"line": 0, "character": 0}, "end": {"line": 9, "character": 0}}}
    on_parameter = {**document, "position": {"line": 0, "character": 6}}
    assert "moves the surface" in client.ask("textDocument/hover", on_parameter)["contents"]["value"]
    client.ask("textDocument/completion", place)
    client.ask("textDocument/semanticTokens/full", document)
    derive = {"command": "potto.differentiate", "arguments": [main.as_uri(), "f"]}
    derived = client.ask("workspace/executeCommand", derive)
    assert "boundary" in derived["text"]
    assert children(client.process.pid) == [] and client.loaded() == []
    assert "boundary" in client.ask("textDocument/hover", place)["contents"]["value"]  # its values are wanted now
    client.ask("textDocument/inlayHint", whole)
    while client.asked.get(timeout=60)["method"] != "workspace/inlayHint/refresh":
        pass
    assert any(hint["label"].startswith("= 0.125") for hint in client.ask("textDocument/inlayHint", whole))
    assert len(children(client.process.pid)) == 1 and client.loaded() == []
    assert client.stop() == 0


def children(process: int) -> list[int]:
    """The processes that a process has started."""
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process)], capture_output=True, text=True, check=False)
    return [int(pid) for pid in found.stdout.split()]


def test_the_evaluation_process_ends_with_the_server(tmp_path: Path) -> None:
    """Also if that is killed, in the middle of an evaluation."""
    client = Client(tmp_path)
    client.start()
    heavy = "sum i in 1..50000 (integral ([0,1],[0,1],[0,1]) [x*y + z*i < 1/i] * sin(x*y*z*i) d(x,y,z))"
    uri = (tmp_path / "main.po").as_uri()
    client.open(uri, "y = 1\n")
    client.ask("workspace/executeCommand", {"command": "potto.evaluate", "arguments": [uri, "y"]}, 60)
    client.begin("workspace/executeCommand", {"command": "potto.evaluate", "arguments": [uri, heavy]})
    time.sleep(0.3)
    (child,) = children(client.process.pid)
    client.process.kill()
    client.process.wait()
    until = time.monotonic() + 15
    while is_alive(child):
        assert time.monotonic() < until
        time.sleep(0.05)


def is_alive(process: int) -> bool:
    found = subprocess.run(["ps", "-o", "stat=", "-p", str(process)], capture_output=True, text=True, check=False)
    return bool(found.stdout.strip()) and not found.stdout.startswith("Z")


def test_the_first_check_shows_progress(server: Server, uri: Uri) -> None:
    """Begin, reports that grow, end; to a client that said that it shows progress."""
    one = "def f{0}(t)\n    integral ([0, 1], [0, 1]) [x*{0} + y < t] * sin(x) d(x, y)\n"
    body = "\n".join(one.format(n) for n in range(1, 40))
    client = server(greet=False, **{f"m{n}": body for n in range(60)})
    client.start()
    kinds, shares = [], []
    while not kinds or kinds[-1] != "end":
        value = client.note("$/progress", seconds=60)["value"]
        kinds.append(value["kind"])
        shares += [value["percentage"]] if "percentage" in value else []
    assert kinds[0] == "begin" and set(kinds[1:-1]) <= {"report"} and shares == sorted(shares)
    assert all(0 <= share <= 100 for share in shares)


class Told:
    """A session as far as progress needs one."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.client = self

    def can(self, path: str) -> bool:
        return False

    def request(self, method: str, params: Any, reply: Any = None) -> None:
        self.asked.append(method)

    notify = request


def test_no_progress_for_clients_that_show_none() -> None:
    session: Any = Told()
    progress = WorkProgress(session, "nothing")
    time.sleep(0.25)
    progress.report(1, 2)
    progress.end()
    assert session.asked == []


def test_what_was_loaded_is_never_collected_again() -> None:
    """A full collection in the middle of typing took a quarter of a second."""
    before = gc.get_threshold()
    try:
        with collector.loading():
            assert not gc.isenabled()
        collector.begin_collecting()
        assert gc.isenabled() and gc.get_freeze_count() > 10_000
        assert gc.get_threshold() == collector.THRESHOLDS and collector.THRESHOLDS[0] >= 50_000
    finally:
        gc.unfreeze()
        gc.set_threshold(*before)


def test_new_objects_are_looked_through_once_open_files_have_been_told_of() -> None:
    """Where that waits until a collection comes by itself, it comes in the middle of a key, and takes 10 to 40 ms."""
    before = gc.get_threshold()
    try:
        collector.begin_collecting()
        for look, generation, many in ((collector.tidy, 0, collector.YOUNG), (collector.rest, 1, collector.MIDDLE)):
            gc.collect(generation)
            looked = gc.get_stats()[generation]["collections"]
            look()  # at nothing new
            assert gc.get_stats()[generation]["collections"] == looked
            made = [[] for _ in range(2 * many)] if generation == 0 else [gc.collect(0) for _ in range(many + 1)]
            look()
            assert made and gc.get_stats()[generation]["collections"] == looked + 1
    finally:
        gc.unfreeze()
        gc.set_threshold(*before)


@pytest.mark.parametrize("answer", [[{"lints": {"P0620": "off"}}], [None], "nonsense", None])
def test_settings_are_asked_for(server: Server, uri: Uri, answer: Any) -> None:
    """A client that keeps its settings is asked for them, at the start and when they change; nonsense is no setting."""
    client = server({"workspace": {"configuration": True}}, greet=False, a="def g(t) t\n")
    client.replies["workspace/configuration"] = answer
    client.start()
    assert client.asked.get(timeout=10)["params"]["items"] == [{"section": "potto"}]
    client.open(uri("main"), "from a import g\ndef f(t) t\n")
    codes = [said["code"] for said in client.note("textDocument/publishDiagnostics", uri=uri("main"))["diagnostics"]]
    assert codes == ([] if isinstance(answer, list) and answer[0] else ["P0620"])
    client.tell("workspace/didChangeConfiguration", {"settings": None})
    assert client.asked.get(timeout=10)["method"] == "workspace/configuration"
    assert client.stop() == 0


def test_the_server_does_not_stay_when_its_folder_is_gone(tmp_path: Path) -> None:
    """Started where nothing is any more, it still answers."""
    gone = tmp_path / "gone"
    gone.mkdir()
    here = os.getcwd()
    os.chdir(gone)
    try:
        client = Client(gone)
    finally:
        os.chdir(here)
    gone.rmdir()
    client.start()
    client.open((gone / "main.po").as_uri(), "def f(t) one\n")
    found = client.note("textDocument/publishDiagnostics")["diagnostics"]
    assert [said["code"] for said in found] == ["P0201"]
    assert client.stop() == 0


def test_old_documents_go_at_once(tmp_path: Path) -> None:
    """Questions refer to the text that they were about. Whatever waits for the garbage collector to go makes the
    server grow by a text a keystroke until the collector comes, in the middle of typing."""
    main = tmp_path / "main.po"
    main.write_text(TEXT)
    client = Spied(tmp_path, EVERYTHING)
    client.start()
    client.open(main.as_uri(), TEXT)
    place = {"textDocument": {"uri": main.as_uri()}, "position": {"line": 0, "character": 4}}
    for version in range(2, 42):
        client.change(main.as_uri(), version, {"text": TEXT + "#" * version})
        assert client.ask("textDocument/hover", place) is not None
    client.loaded()
    assert 1 <= client.documents() <= 3
    assert client.stop() == 0
