"""Potto in Jupyter: a real kernel, asked through jupyter_client."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import pytest

jupyter_client = pytest.importorskip("jupyter_client")
pytest.importorskip("ipykernel")


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    import os

    data = tmp_path_factory.mktemp("jupyter")
    environment = {**os.environ, "JUPYTER_DATA_DIR": str(data)}
    done = subprocess.run([sys.executable, "-m", "potto", "kernel", "install", "--json"], env=environment,
                          capture_output=True, text=True, check=True)  # fmt: skip
    assert json.loads(done.stdout)["installed"]
    specs = jupyter_client.kernelspec.KernelSpecManager(kernel_dirs=[str(data / "kernels")])
    manager = jupyter_client.KernelManager(kernel_name="potto", kernel_spec_manager=specs)
    manager.start_kernel(cwd=str(data))
    client = manager.client()
    client.start_channels()
    client.wait_for_ready(timeout=30)
    client.interrupt = manager.interrupt_kernel
    yield client
    client.stop_channels()
    manager.shutdown_kernel(now=True)


def run(client, code):
    """The reply to a cell and everything that it shows."""
    shown = []
    reply = client.execute_interactive(code, timeout=30, output_hook=shown.append)
    answers = [(message["msg_type"], message["content"]) for message in shown]
    return reply["content"], [item for item in answers if item[0] not in ("status", "execute_input")]


def test_cells_are_entries(client):
    reply, shown = run(client, "def f(t)\n    integral [0, 1] [x < t] d(x)\n\nf(0.25)\n:type f")
    text = "".join(content["text"] for kind, content in shown if kind == "stream")
    assert reply["status"] == "ok" and "f : (t: Real) -> Real" in text and re.search(r"= 0\.250{9,} ± ", text)


def test_errors_are_told(client):
    reply, shown = run(client, "nothing\n1 + 1")
    assert reply["status"] == "error" and "P0201" in reply["evalue"]
    assert any(kind == "stream" and content["name"] == "stderr" for kind, content in shown)


def test_pictures_are_images(client):
    _, shown = run(client, ":plot u^2")
    assert "<svg" in shown[0][1]["data"]["image/svg+xml"]
    _, shown = run(client, ":image x*y 4")
    assert shown[0][1]["data"]["image/png"].startswith("iVBOR")


def test_an_interrupt_ends_a_cell_and_keeps_what_was_defined(client):
    import time

    run(client, "def kept(t) 3*t")
    # Jupyter drops what it is asked right after an error, unless told not to.
    message = client.execute("sum i in 1..9000000 (sum j in 1..50 (sin(i*j)))", stop_on_error=False)
    time.sleep(1)
    start = time.perf_counter()
    client.interrupt()
    reply = client.get_shell_msg(timeout=30)
    while reply["parent_header"].get("msg_id") != message:
        reply = client.get_shell_msg(timeout=30)
    assert reply["content"]["status"] == "error" and reply["content"]["ename"] == "KeyboardInterrupt"
    assert time.perf_counter() - start < 2
    _, shown = run(client, "kept(2)")
    assert any("= 6 " in content["text"] for kind, content in shown if kind == "stream"), shown


def test_completion_inspection_and_completeness(client):
    run(client, "def renderer(c) c")
    found = client.complete("1 + rend", reply=True, timeout=30)["content"]
    assert found["matches"] == ["renderer"] and found["cursor_start"] == 4
    assert "renderer : " in client.inspect("renderer(1)", 3, reply=True, timeout=30)["content"]["data"]["text/plain"]
    for typed, matches in (("1 + \\theta", ["θ"]), ("\\ps", ["ψ"]), ("\\ph", ["φ"]), ("\\nope", [])):
        found = client.complete(typed, reply=True, timeout=30)["content"]
        assert found["matches"] == matches and found["cursor_start"] == typed.index("\\")
    assert "\\theta" in client.complete("\\t", reply=True, timeout=30)["content"]["matches"]
    client.is_complete("def f(t)")
    assert client.get_shell_msg(timeout=30)["content"] == {"status": "incomplete", "indent": "    "}


def test_leaving_is_asked_of_the_console(client):
    reply, _ = run(client, "1 + 1\n:quit")
    assert reply["payload"] == [{"source": "ask_exit", "keepkernel": False}]
    reply, shown = run(client, "2 + 2")
    assert reply["payload"] == [] and any("= 4 " in content["text"] for _, content in shown)


def test_answers_of_cells_stay_and_no_codes_for_terminals_are_sent(client):
    run(client, "def half(t) integral [0, 1] [x < t]/2 d(x)\nhalf(0.5)")
    _, shown = run(client, "_ * 4\n:help\nnothing?")
    text = "".join(content["text"] for kind, content in shown if kind == "stream")
    assert re.search(r"= 1\.0{9,} ± ", text) and "\x1b" not in text and "Ctrl-C stops" not in text
