"""Sessions of editors, played again: one answer of the right form to each request, and nothing that they cannot do."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from lsp_client import Client
from lsp_sessions import SESSIONS
from lsprotocol import converters, types

CONVERTER = converters.get_converter()
FAIR = (-32800, -32801, -32803)  # cancelled, outdated, refused: what a client must expect at any time
NEEDS = {  # what the server asks a client, by what the client must have said that it can do
    "client/registerCapability": "workspace.didChangeWatchedFiles.dynamicRegistration",
    "workspace/configuration": "workspace.configuration",
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
            client.send(message)
            if "id" in message and message["id"] not in self.cancelled:
                client.answer(message["id"], 60)
        client.tell("exit", None)


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
