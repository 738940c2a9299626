"""Sessions of editors, played again: one answer of the right form to each request, and nothing that they cannot do."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest
from lsp_client import Client
from lsp_sessions import SESSIONS, capabilities_of
from lsprotocol import converters, types

CONVERTER = converters.get_converter()
FAIR = (-32800, -32801, -32803)  # cancelled, outdated, refused: what a client must expect at any time
NEEDS = {  # what the server asks a client, by what the client must have said that it can do
    "client/registerCapability": "workspace.didChangeWatchedFiles.dynamicRegistration",
    "workspace/configuration": "workspace.configuration",
    "workspace/codeLens/refresh": "workspace.codeLens.refreshSupport",
    "workspace/inlayHint/refresh": "workspace.inlayHint.refreshSupport",
    "workspace/diagnostic/refresh": "workspace.diagnostics.refreshSupport",
    "window/workDoneProgress/create": "window.workDoneProgress",
    "window/showDocument": "window.showDocument.support",
}
LINKS = ("definition", "declaration", "typeDefinition", "implementation")


def can(capabilities: dict[str, Any], path: str) -> bool:
    found: Any = capabilities
    for part in path.split("."):
        found = found.get(part) if isinstance(found, dict) else None
    return bool(found)


class Session:
    """A recording, with the places of a new workspace put into it."""

    def __init__(self, path: Path, folder: Path) -> None:
        text = path.read_text(encoding="utf-8")
        self.messages = [
            json.loads(line.replace("${root}", folder.as_uri()).replace("${path}", str(folder)))
            for line in text.splitlines()
        ]
        self.greeting = self.messages[0]
        self.capabilities = self.greeting["params"]["capabilities"]
        self.cancelled = {m["params"]["id"] for m in self.messages if m.get("method") == "$/cancelRequest"}
        self.requests = {m["id"]: m["method"] for m in self.messages if "method" in m and "id" in m}

    def write_files(self, folder: Path) -> None:
        """The files of the workspace, as they were when they were opened."""
        for message in self.messages:
            if message.get("method") == "textDocument/didOpen":
                item = message["params"]["textDocument"]
                name = item["uri"].removeprefix(folder.as_uri() + "/")
                if "/" not in name and not (folder / name).exists():
                    (folder / name).write_text(item["text"], encoding="utf-8")

    def play(self, client: Client) -> None:
        """Say everything again; an answer is waited for unless the editor did not wait."""
        for message in self.messages:
            if "method" not in message or message["method"] == "exit":
                continue  # answers are given as they are asked for; `exit` comes last
            if message["method"] == "shutdown" and not can(self.capabilities, "textDocument.diagnostic"):
                self._wait_for_diagnostics(client)
            client.send(message)
            if "id" in message and message["id"] not in self.cancelled:
                client.answer(message["id"], 60)
        client.tell("exit", None)

    def _wait_for_diagnostics(self, client: Client) -> None:
        """They are pushed when nothing else is to be done: an editor leaves that time, whoever plays it must."""
        until = time.monotonic() + 60
        while not any(note["method"] == "textDocument/publishDiagnostics" for note in list(client.notes.queue)):
            assert time.monotonic() < until, client.stderr.decode()
            time.sleep(0.01)


@pytest.fixture(params=SESSIONS, ids=lambda path: path.stem)
def played(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Session, Client]:
    folder = tmp_path / "workspace"
    folder.mkdir()
    session = Session(request.param, folder)
    session.write_files(folder)
    client = Client(folder)
    session.play(client)
    assert client.wait(20) == 0
    return session, client


def test_a_session(played: tuple[Session, Client]) -> None:
    session, client = played
    assert b"Traceback" not in client.stderr, client.stderr.decode()
    for id, method in session.requests.items():
        (answer,) = client.answers[id]
        if "error" in answer:
            again = method == "shutdown" and answer["error"]["code"] == -32600  # Neovim says it twice
            assert again or answer["error"]["code"] in FAIR, (method, answer)
        elif method in types.METHOD_TO_TYPES:
            CONVERTER.structure(answer, types.METHOD_TO_TYPES[method][1])
    for asked in client.asked.queue:
        assert can(session.capabilities, NEEDS[asked["method"]]), asked["method"]
    _links_only_where_they_are_understood(session, client)
    _diagnostics_come_one_way(session, client)


def _links_only_where_they_are_understood(session: Session, client: Client) -> None:
    for id, method in session.requests.items():
        name = method.removeprefix("textDocument/")
        for place in (client.answers[id][0].get("result") or ()) if name in LINKS else ():
            assert ("targetUri" in place) == can(session.capabilities, f"textDocument.{name}.linkSupport")


def _diagnostics_come_one_way(session: Session, client: Client) -> None:
    """Pushed to clients that cannot pull, and only to them."""
    pushed = [note for note in client.notes.queue if note["method"] == "textDocument/publishDiagnostics"]
    assert bool(pushed) != can(session.capabilities, "textDocument.diagnostic")


# What the greetings of real editors ask for


def started(editor: str, folder: Path, **files: str) -> Client:
    """A server that was greeted as by an editor."""
    for name, text in files.items():
        (folder / f"{name}.po").write_text(text)
    client = Client(folder, capabilities_of(editor))
    client.start()
    return client


EDITORS = ["vscode", "neovim", "emacs", "helix"]
PLAIN = "def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\ny = ha\n"


@pytest.mark.parametrize("editor", EDITORS)
def test_an_action_has_its_edit_at_once_or_when_it_is_asked_for(editor: str, tmp_path: Path) -> None:
    """Eglot 1.9 resolves none: an action that waits for that would do nothing."""
    client = started(editor, tmp_path, main=PLAIN)
    uri = (tmp_path / "main.po").as_uri()
    client.open(uri, PLAIN)
    place = {"start": {"line": 1, "character": 24}, "end": {"line": 1, "character": 24}}
    params = {"textDocument": {"uri": uri}, "range": place, "context": {"diagnostics": []}}
    actions = client.ask("textDocument/codeAction", params)
    assert any(action["title"] == "Count the jump: `[x < t]`" for action in actions)
    support = client.capabilities["textDocument"]["codeAction"].get("resolveSupport") or {}
    later = "edit" in support.get("properties", ())
    for action in actions:
        assert ("edit" in action) != later
        assert "edit" in (client.ask("codeAction/resolve", action) if later else action)


@pytest.mark.parametrize("editor", EDITORS)
def test_a_name_of_another_module_comes_with_its_import(editor: str, tmp_path: Path) -> None:
    client = started(editor, tmp_path, main=PLAIN, shapes="def half(t) t/2\n")
    uri = (tmp_path / "main.po").as_uri()
    client.open(uri, PLAIN)
    params = {"textDocument": {"uri": uri}, "position": {"line": 2, "character": 6}}
    item = next(i for i in client.ask("textDocument/completion", params)["items"] if i["label"] == "half")
    support = client.capabilities["textDocument"]["completion"]["completionItem"].get("resolveSupport") or {}
    later = "additionalTextEdits" in support.get("properties", ())
    assert ("additionalTextEdits" in item) != later
    whole = client.ask("completionItem/resolve", item)
    assert whole["additionalTextEdits"][0]["newText"].startswith("from shapes import half")


@pytest.mark.parametrize("editor", EDITORS)
def test_texts_are_of_a_kind_that_is_shown(editor: str, tmp_path: Path) -> None:
    """Emacs without a mode for markdown asks for plain text."""
    client = started(editor, tmp_path, main=PLAIN)
    uri = (tmp_path / "main.po").as_uri()
    client.open(uri, PLAIN)
    params = {"textDocument": {"uri": uri}, "position": {"line": 0, "character": 4}}
    contents = client.ask("textDocument/hover", params)["contents"]
    assert contents["kind"] in client.capabilities["textDocument"]["hover"]["contentFormat"]
    assert "f : (t: Real) -> Real" in contents["value"]
    assert ("```" in contents["value"]) == (contents["kind"] == "markdown")
