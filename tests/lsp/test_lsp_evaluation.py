"""Programs that run for an editor: commands, live expressions, and what happens when they run too long or die."""

from __future__ import annotations

import base64
import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lsp_client import Client

Server = Callable[..., Client]
Uri = Callable[[str], str]
TEXT = "def f(t)\n    integral [0, 1] [x < t] * x d(x)\n#> f(0.5)\n#= 0.125\n#> f(0.5)\n#= 0.5\n#> 1/\n"
# t^2/2 at 1/2 is 1/8: the first expectation holds, the second does not, and the third is no expression.
REFRESHES = {"workspace": {"inlayHint": {"refreshSupport": True}}}


def run(client: Client, command: str, *arguments: Any) -> dict[str, Any]:
    params = {"command": command, "arguments": list(arguments)}
    return client.answer(client.begin("workspace/executeCommand", params), 60)


def hints(client: Client, uri: str) -> dict[int, str]:
    """The labels of the live hints by line."""
    span = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
    found = client.ask("textDocument/inlayHint", {"textDocument": {"uri": uri}, "range": span})
    return {hint["position"]["line"]: hint["label"] for hint in found if hint["label"].startswith("=")}


def test_evaluate_an_unsaved_text(server: Server, uri: Uri) -> None:
    client = server(main="def f(t) t\n")
    client.open(uri("main"), TEXT)
    found = run(client, "potto.evaluate", uri("main"), "f(0.5)")["result"]
    assert found["value"] == pytest.approx(0.125, abs=1e-12, rel=0) and found["text"].startswith("0.125")
    client.change(uri("main"), 2, {"text": TEXT.replace("* x d", "d")})
    assert run(client, "potto.evaluate", uri("main"), "f(0.5)")["result"]["value"] == pytest.approx(0.5, abs=1e-12)
    assert "P0201" in run(client, "potto.evaluate", uri("main"), "nowhere")["error"]["message"]


def test_run_a_script(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), "for v in [1, 2]:\n    print(v + 1)\n")
    assert run(client, "potto.evaluate", uri("main"))["result"]["text"].split() == ["2", "3"]


def test_differentiate_needs_no_process(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), TEXT)
    text = run(client, "potto.differentiate", uri("main"), "f")["result"]["text"]
    assert "boundary" in text and "delta" in text
    assert run(client, "potto.differentiate", uri("main"), "nowhere")["error"]["code"] == -32803


@pytest.mark.parametrize(
    ("text", "kind"), [("def f(t) t^2\n", "curve"), ("def f(x, y) x*y\n", "image"), ("f = \\(x, y) . c . x\n", None)]
)
def test_preview(server: Server, uri: Uri, text: str, kind: str | None) -> None:
    client = server()
    client.open(uri("main"), text)
    answer = run(client, "potto.preview", uri("main"), "f")
    if kind is None:
        assert "no function of one or two numbers" in answer["error"]["message"]
    else:
        assert answer["result"]["kind"] == kind and "0 to 1" in answer["result"]["text"]
        data = base64.b64decode(answer["result"]["image"].partition(",")[2])
        assert data.startswith(b"\x89PNG") and data.endswith(b"IEND\xaeB`\x82")


def test_live_values_are_hints(server: Server, uri: Uri) -> None:
    client = server(REFRESHES)
    client.open(uri("main"), TEXT)
    assert hints(client, uri("main")) == {}
    assert client.asked.get(timeout=60)["method"] == "workspace/inlayHint/refresh"
    found = hints(client, uri("main"))
    assert found[2].startswith("= 0.125") and "not" not in found[2]
    assert found[4].startswith("= 0.125") and found[4].endswith("not 0.5")
    assert found[6] == "= ?"


def test_an_edit_elsewhere_evaluates_nothing(server: Server, uri: Uri) -> None:
    client = server(REFRESHES)
    client.open(uri("main"), TEXT)
    hints(client, uri("main"))
    client.asked.get(timeout=60)
    client.change(uri("main"), 2, {"text": "# above\n" + TEXT + "def other(t) t\n"})
    assert hints(client, uri("main"))[3].startswith("= 0.125")
    client.change(uri("main"), 3, {"text": TEXT.replace("* x d", "* x^2 d")})
    hints(client, uri("main"))
    client.asked.get(timeout=60)
    assert hints(client, uri("main"))[2].startswith("= 0.04166")  # t^3/3 at 1/2


@pytest.mark.skipif(sys.platform != "linux", reason="finds the process in /proc")
def test_an_evaluation_that_dies_is_started_again(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), TEXT)
    assert "result" in run(client, "potto.evaluate", uri("main"), "f(0.5)")
    children = Path(f"/proc/{client.process.pid}/task/{client.process.pid}/children").read_text()
    tasks = Path(f"/proc/{client.process.pid}/task").iterdir()
    children = " ".join((task / "children").read_text() for task in tasks)
    (child,) = map(int, children.split())
    os.kill(child, signal.SIGKILL)
    time.sleep(0.2)
    assert "result" in run(client, "potto.evaluate", uri("main"), "f(0.5)")
    client.stop()


# n integrals with a surface in three variables: of 50,000 each test waits for none to end.
SLOW = "def f(n) sum i in 1..n (integral ([0,1],[0,1],[0,1]) [x*y + z*i < 1/i] * sin(x*y*z*i) d(x,y,z))\n"


def test_an_evaluation_that_takes_too_long_is_stopped(server: Server, uri: Uri) -> None:
    client = server()
    client.tell("workspace/didChangeConfiguration", {"settings": {"potto": {"evaluation": {"timeLimit": 1}}}})
    client.open(uri("main"), SLOW)
    assert "stopped after 1 second" in run(client, "potto.evaluate", uri("main"), "f(50000)")["error"]["message"]
    assert run(client, "potto.evaluate", uri("main"), "2 + 3")["result"]["value"] == 5


def test_an_evaluation_can_be_cancelled(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), SLOW)
    run(client, "potto.evaluate", uri("main"), "f(1)")
    id = client.begin("workspace/executeCommand", {"command": "potto.evaluate", "arguments": [uri("main"), "f(50000)"]})
    time.sleep(0.3)
    client.tell("$/cancelRequest", {"id": id})
    assert client.answer(id, 5)["error"]["code"] == -32800
    assert run(client, "potto.evaluate", uri("main"), "2 + 3")["result"]["value"] == 5
