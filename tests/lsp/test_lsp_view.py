"""The integral view in an editor: its page, what is at the cursor, and what answers the page."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lsp_client import Client
from potto_lsp import evaluator

from potto.applications import integral_answers
from potto.evaluating.world import World
from potto.modules import files
from potto.modules.folders import list_folder

Server = Callable[..., Client]
Uri = Callable[[str], str]
PROGRAM = """def left(t)
    integral [0, 1] [x < t]*exp(x) d(x)

def both(r, c)
    (integral [0, 1] [x < r] d(x)) + (integral [0, 1] [y < c]*y d(y))
name = 3
#> left(0.25)
"""


def viewed(client: Client, uri: str, line: int, character: int) -> Any:
    place = {"line": line, "character": character}
    return client.ask("potto/viewed", {"textDocument": {"uri": uri}, "position": place})


def answer(client: Client, uri: str, path: str, **question: Any) -> dict[str, Any]:
    asked = {"textDocument": {"uri": uri}, "path": path, "question": question}
    return client.answer(client.begin("potto/view", asked), 60)["result"]


def test_what_is_at_the_cursor(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), PROGRAM)
    found = viewed(client, uri("main"), 1, 23)
    assert (found["name"], found["which"], found["lit"]) == ("left", 0, "x = t")
    (condition,) = found["conditions"]
    assert condition == {"equation": "x = t", "range": {"start": {"line": 1, "character": 21},
                                                        "end": {"line": 1, "character": 26}}}  # fmt: skip
    assert viewed(client, uri("main"), 0, 5)["lit"] == ""
    second = viewed(client, uri("main"), 4, 56)
    assert (second["name"], second["which"], second["lit"]) == ("both", 1, "y = c")
    assert viewed(client, uri("main"), 5, 2) is None  # no function


def test_the_page_is_answered_by_the_evaluation_process(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), PROGRAM)
    assert answer(client, uri("main"), "/names")["names"] == ["left", "both"]
    opened = answer(client, uri("main"), "/open", name="left")
    assert opened["values"] == {"t": 0.25} and opened["wrt"] == "t"
    for t in (0.3, 0.6):
        seen = answer(client, uri("main"), "/look", name="left", values={"t": t}, wrt="t", which=0)
        assert seen["numbers"]["value"] == pytest.approx(math.expm1(t), rel=1e-12)
        assert seen["numbers"]["boundary"] == pytest.approx(math.exp(t), rel=1e-12)
        assert seen["surfaces"][0]["equation"] == "x = t"
    client.change(uri("main"), 2, {"text": PROGRAM.replace("*exp(x)", "")})
    seen = answer(client, uri("main"), "/look", name="left", values={"t": 0.3}, wrt="t", which=0)
    assert seen["numbers"]["value"] == pytest.approx(0.3, rel=1e-12)  # of the text as it is now


def test_what_is_wrong_is_said(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), PROGRAM)
    assert "not defined" in answer(client, uri("main"), "/open", name="nobody")["error"]
    wrong = {"textDocument": {"uri": uri("main")}, "path": "/else", "question": {}}
    assert "no question" in client.answer(client.begin("potto/view", wrong), 60)["error"]["message"]


def test_the_page_comes_from_the_server(server: Server) -> None:
    found = server().ask("potto/viewPage", {})
    assert set(found) == {"body", "style", "script"} and 'id="sliders"' in found["body"]
    assert "http:" not in found["script"] and "https:" not in found["script"]


def test_the_workspace_is_not_listed_for_each_place_of_a_slider(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "main.po").write_text(PROGRAM)
    world = World()
    file = world.key(tmp_path / "main.po")
    listed: list[str] = []
    monkeypatch.setattr(files, "list_folder", lambda folder: listed.append(folder) or list_folder(folder))
    refreshed: list[bool] = []
    refresh = world.refresh
    monkeypatch.setattr(world, "refresh", lambda: refreshed.append(True) or refresh())
    monkeypatch.setattr(integral_answers, "UNSEEN", 1e9)

    def look(t: float, quick: bool) -> Any:
        question = {"name": "left", "values": {"t": t}, "wrt": "t", "which": 0, "quick": quick}
        task = {
            "do": "view",
            "file": file,
            "text": "/look",
            "roots": [str(tmp_path)],
            "texts": {},
            "question": question,
        }
        return evaluator._answer(world, task)["result"]

    assert look(0.25, False)["numbers"]["value"] == pytest.approx(math.expm1(0.25), rel=1e-12)
    before = len(listed), len(refreshed)
    for place in range(5):
        assert "svg" in look(0.25 + place / 10, True)
    assert (len(listed), len(refreshed)) == before
    look(0.25, False)
    assert len(refreshed) == before[1] + 1
