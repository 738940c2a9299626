"""Potto in Jupyter: a real kernel, asked through jupyter_client."""

from __future__ import annotations

import json
import math
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
    client.specs = specs
    yield client
    client.stop_channels()
    manager.shutdown_kernel(now=True)
    subprocess.run([sys.executable, "-m", "potto", "kernel", "remove"], env=environment, check=True)
    assert not os.listdir(data / "kernels")


def run(client, code):
    """The reply to a cell and everything that it shows."""
    shown = []
    reply = client.execute_interactive(code, timeout=30, output_hook=shown.append)
    answers = [(message["msg_type"], message["content"]) for message in shown]
    return reply["content"], [item for item in answers if item[0] not in ("status", "execute_input")]


def answers(shown):
    """What the results of a cell are as text."""
    return [content["data"]["text/plain"] for kind, content in shown if kind == "execute_result"]


def test_cells_are_entries(client):
    reply, shown = run(client, "def f(t)\n    integral [0, 1] [x < t] d(x)\n\nf(0.25)\n:type f")
    text = "".join(content["text"] for kind, content in shown if kind == "stream")
    assert reply["status"] == "ok" and "f : (t: Real) -> Real" in text
    (answer,) = answers(shown)
    assert re.match(r"0\.250{9,} ± ", answer)


def test_answers_are_results_with_the_number_of_the_cell(client):
    reply, shown = run(client, "integral [0, 1] x^2 d(x)")
    (content,) = [content for kind, content in shown if kind == "execute_result"]
    number = content["execution_count"]
    assert number == reply["execution_count"]
    assert content["data"]["text/html"].startswith("<code>0.3333333333")
    assert re.fullmatch(r"\$0\.3{9,}\d* \\pm .*\$", content["data"]["text/latex"])
    _, shown = run(client, f"3*_{number}\n6*Out[{number}]")
    assert [answer[:8] for answer in answers(shown)] == ["1.000000", "2.000000"]


def test_a_derivative_is_a_table_of_its_parts(client):
    _, shown = run(client, "def part(t) integral [0, 1] [x < t]*t d(x)\nderiv(part)((0.5, 1))")
    (data,) = [content["data"] for kind, content in shown if kind == "execute_result"]
    assert "<table>" in data["text/html"] and "interior" in data["text/html"] and "boundary" in data["text/html"]
    assert data["text/latex"].startswith("$\\begin{aligned}\\text{value}") and "0.25" in data["text/latex"]


def test_a_derivative_in_symbols_is_typeset(client):
    """By `:deriv`, and where a derivative is itself the answer."""
    _, shown = run(client, "def g(theta) integral [0, 1] [x < theta]*x d(x)\n:deriv g\nderiv g")
    texts = [content["data"].get("text/latex") for kind, content in shown if kind == "execute_result"]
    found = [text for text in texts if text]
    assert len(found) == 2
    assert all(
        r"\partial \theta \, \delta\left(\theta - x\right)" in text and r"\int_{0}^{1}" in text for text in found
    )


def test_errors_name_the_cell_and_its_line(client):
    reply, shown = run(client, "def twice(x) 2*x\ntwice(2)\n\ntwice(nowhere)")
    said = "".join(content["text"] for kind, content in shown if kind == "stream" and content["name"] == "stderr")
    assert f"--> <In {reply['execution_count']}>:4:7\n" in said and answers(shown) == ["4 : Real"]


def test_a_notebook_runs_from_top_to_bottom(client, tmp_path):
    """By nbclient, as `jupyter nbconvert --execute` does it; the kernel is told apart by its specification."""
    nbclient = pytest.importorskip("nbclient")
    import nbformat

    cells = ["def covered(r) integral ([0, 1], [0, 1]) [x^2 + y^2 < r^2] d(x, y)", "D(covered)(0.5)", "_2 + 1"]
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    manager = jupyter_client.AsyncKernelManager(kernel_name="potto", kernel_spec_manager=client.specs)
    done = nbclient.NotebookClient(book, km=manager, timeout=60).execute(cwd=str(tmp_path))
    found = [[o for o in cell.outputs if o.output_type == "execute_result"] for cell in done.cells]
    assert found[0] == [] and found[1][0].execution_count == 2 and found[2][0].execution_count == 3
    assert abs(float(found[1][0].data["text/plain"].split()[0]) - math.pi / 4) < 1e-12
    assert abs(float(found[2][0].data["text/plain"].split()[0]) - math.pi / 4 - 1) < 1e-12


def test_errors_are_told(client):
    reply, shown = run(client, "nothing\n1 + 1")
    assert reply["status"] == "error" and "P0201" in reply["evalue"]
    assert any(kind == "stream" and content["name"] == "stderr" for kind, content in shown)


def test_pictures_are_images(client):
    _, shown = run(client, ":plot u^2")
    assert "<svg" in shown[0][1]["data"]["image/svg+xml"]
    _, shown = run(client, ":image x*y 4")
    assert shown[0][1]["data"]["image/png"].startswith("iVBOR")
    assert shown[0][1]["data"]["image/svg+xml"].startswith("<svg")


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
    assert answers(shown) == ["6 : Real"], shown


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
    assert reply["payload"] == [] and answers(shown) == ["4 : Real"]


def test_answers_of_cells_stay_and_no_codes_for_terminals_are_sent(client):
    run(client, "def half(t) integral [0, 1] [x < t]/2 d(x)\nhalf(0.5)")
    _, shown = run(client, "_ * 4\n:help\nnothing?")
    text = "".join(content["text"] for kind, content in shown if kind == "stream")
    assert re.match(r"1\.0{9,} ± ", answers(shown)[0]) and "\x1b" not in text and "Ctrl-C stops" not in text
