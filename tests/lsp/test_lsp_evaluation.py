"""Programs that run for an editor: commands, live expressions, and what happens when they run too long or die."""

from __future__ import annotations

import base64
import re
import signal
import stat
import sys
import time
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from threading import Event
from typing import Any
from urllib.parse import unquote, urlparse

import pytest
from lsp_client import Client
from potto_lsp.analysis import Analysis
from potto_lsp.evaluation import LIVE, EvaluationQueue, EvaluationTask
from potto_lsp.evaluator import _answer as answered

from potto.evaluating.world import World
from potto.kernels import compile as kernels
from potto.kernels.making import counts

Server = Callable[..., Client]
Uri = Callable[[str], str]
TEXT = "def f(t)\n    integral [0, 1] [x < t] * x d(x)\n#> f(0.5)\n#= 0.125\n#> f(0.5)\n#= 0.5\n#> 1/\n"
# t^2/2 at 1/2 is 1/8: the first expectation holds, the second does not, and the third is no expression.
PUSHED = "textDocument/publishDiagnostics"
# A sum that takes minutes.
HEAVY = "sum i in 1..50000 (integral ([0,1],[0,1],[0,1]) [x*y + z*i < 1/i] * sin(x*y*z*i) d(x,y,z))"
LARGE = "[i*1.5 for i in 0..9999999][9999999]"  # ten million numbers of 8 bytes, more than once
REFRESHES = {"workspace": {"inlayHint": {"refreshSupport": True}}}


def run(client: Client, command: str, *arguments: Any) -> dict[str, Any]:
    params = {"command": command, "arguments": list(arguments)}
    return client.answer(client.begin("workspace/executeCommand", params), 60)


def hints(client: Client, uri: str) -> dict[int, str]:
    """The labels of the live hints by line."""
    span = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
    found = client.ask("textDocument/inlayHint", {"textDocument": {"uri": uri}, "range": span})
    return {hint["position"]["line"]: hint["label"] for hint in found if hint["label"].startswith("=")}


def shown(client: Client, uri: str, lines: set[int]) -> dict[int, str]:
    """The live hints when there are some on all of these lines; asked for again when the server says so."""
    while not lines <= (found := hints(client, uri)).keys():
        while client.asked.get(timeout=60)["method"] != "workspace/inlayHint/refresh":
            pass
    return found


def test_evaluate_an_unsaved_text(server: Server, uri: Uri) -> None:
    client = server(main="def f(t) t\n")
    client.open(uri("main"), TEXT)
    found = run(client, "potto.evaluate", uri("main"), "f(0.5)")["result"]
    assert found["value"] == pytest.approx(0.125, abs=1e-12, rel=0) and found["text"].startswith("0.125")
    client.change(uri("main"), 2, {"text": TEXT.replace("* x d", "d")})
    assert run(client, "potto.evaluate", uri("main"), "f(0.5)")["result"]["value"] == pytest.approx(0.5, abs=1e-12)
    assert "P0201" in run(client, "potto.evaluate", uri("main"), "nowhere")["error"]["message"]


def test_editing_a_function_compiles_that_function_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("POTTO_CACHE", "off")
    kernels.clear()
    world, file = World(), "/main.po"
    shaders = {name: f"def {name}(x, c) {body}\n" for name, body in (("dim", "c*x"), ("bright", "c*x^3"))}
    seen = "".join(f"def in_{name}(c) integral [0, 1] {name}(x, c)*[sin(x) < c] d(x)\n" for name in shaders)

    def compiled(**changed: str) -> int:
        texts = {file: "".join({**shaders, **changed}.values()) + seen}
        before = counts.compiled
        for text in ("in_dim(0.7)", "in_bright(0.7)"):
            task = {"do": "evaluate", "file": file, "text": text, "texts": texts, "roots": ()}
            assert "result" in answered(world, task)
        return counts.compiled - before

    assert compiled() > 4
    assert compiled() == 0
    assert compiled(dim="def dim(x, c) exp(c*x)\n") == 2  # its values with what they round off, and without
    assert compiled() == 0


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


def test_differentiate_a_diffeomorphism(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), "diffeo half(x, y; c) = (x + y + c, x - y)\n")
    text = run(client, "potto.differentiate", uri("main"), "half")["result"]["text"]
    assert "inverse: (u, v) . " in text and "determinant: -2" in text


def test_differentiate_a_call(server: Server, uri: Uri) -> None:
    """Its value and the slope by each parameter, with what they may be off by."""
    client = server()
    client.open(uri("main"), "def f(t, k)\n    k * (integral [0, 1] [x < t] * x d(x))\n")
    found = run(client, "potto.differentiate", uri("main"), "f(0.5, 2)")["result"]
    assert found["text"].startswith("f(0.5, 2) = 0.25")
    slopes = {slope["by"]: float(slope["text"]) for slope in found["slopes"]}
    assert slopes == pytest.approx({"t": 1.0, "k": 0.125}, abs=1e-12, rel=0)  # k t and t^2/2
    assert run(client, "potto.differentiate", uri("main"), "sin(1)")["error"]["code"] == -32803


def test_a_function_is_evaluated_where_a_live_expression_looks_at_it(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), "def f(t) t^2\n#> deriv(f)(dt=(3, 1))\ndef g(s) s(1)\n")
    assert run(client, "potto.evaluate", uri("main"), "f")["result"]["value"] == 9
    assert "write one as a live expression" in run(client, "potto.evaluate", uri("main"), "g")["error"]["message"]


def lenses(client: Client, uri: str) -> list[dict[str, Any]]:
    found = client.ask("textDocument/codeLens", {"textDocument": {"uri": uri}})
    return [lens["command"] if "command" in lens else client.ask("codeLens/resolve", lens)["command"] for lens in found]


def test_the_lenses_of_a_function_do_what_they_say(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), TEXT)
    value, more, *_ = lenses(client, uri("main"))
    assert (value["title"], more["title"]) == ("evaluate f(0.5)", "more")
    assert "0.125" in run(client, value["command"], *value["arguments"])["result"]["text"]
    offers = run(client, more["command"], *more["arguments"])["result"]["offers"]
    by_title = {offer["title"]: offer for offer in offers}
    shown = "show derivative (1 surface)"
    for title, expected in (("evaluate f(0.5)", "0.125"), ("differentiate f(0.5)", "by t: 0.5"), (shown, "boundary")):
        offer = by_title[title]
        assert expected in run(client, offer["command"], *offer["arguments"])["result"]["text"]


def test_a_lens_shows_the_value_where_a_live_expression_looks(server: Server, uri: Uri) -> None:
    client = server({"workspace": {"codeLens": {"refreshSupport": True}}})
    client.open(uri("main"), "def f(t) integral [0, 1] [x < t] d(x)\n#> f(0.25)\n")
    assert lenses(client, uri("main"))[0]["title"] == "evaluate f(0.25)"
    while client.asked.get(timeout=20)["method"] != "workspace/codeLens/refresh":
        pass
    assert lenses(client, uri("main"))[0]["title"].startswith("= 0.2500000000000000")


def test_a_client_without_a_menu_of_its_own_is_asked_what_to_do(server: Server, uri: Uri) -> None:
    client = server(SHOWS)
    client.replies["window/showMessageRequest"] = {"title": "evaluate f(0.5)"}
    client.open(uri("main"), TEXT)
    run(client, "potto.more", uri("main"), "f")
    while (asked := client.asked.get(timeout=10))["method"] != "window/showMessageRequest":
        pass
    titles = [action["title"] for action in asked["params"]["actions"]]
    assert titles == ["evaluate f(0.5)", "differentiate f(0.5)", "show derivative (1 surface)", "preview"]
    assert "0.125" in client.note("window/showMessage")["message"]


SHOWS = {"window": {"showDocument": {"support": True}, "workDoneProgress": True}}


def test_a_client_that_drops_answers_is_shown_them(server: Server, uri: Uri) -> None:
    """A short text as a message, a longer one as a document that cannot be written to, which goes with the server."""
    client = server(SHOWS)
    client.open(uri("main"), TEXT)
    run(client, "potto.differentiate", uri("main"), "f")
    while (asked := client.asked.get(timeout=10))["method"] != "window/showDocument":
        pass
    path = Path(unquote(urlparse(asked["params"]["uri"]).path))
    assert "boundary" in path.read_text() and not path.stat().st_mode & stat.S_IWUSR
    run(client, "potto.evaluate", uri("main"), "f(0.5)")
    assert client.note("window/showMessage")["message"].startswith("0.125")
    client.stop()
    assert not path.exists()


def test_a_client_with_commands_of_its_own_is_left_alone(server: Server, uri: Uri) -> None:
    client = server({**SHOWS, "experimental": {"commands": {"commands": ["potto.showReferences"]}}})
    client.open(uri("main"), TEXT)
    run(client, "potto.differentiate", uri("main"), "f")
    run(client, "potto.evaluate", uri("main"), "f(0.5)")
    client.ask("shutdown", None)
    assert "window/showMessage" not in [note["method"] for note in client.notes.queue]
    assert "window/showDocument" not in [asked["method"] for asked in client.asked.queue]


@pytest.mark.parametrize("token", [None, "mine"])
def test_what_takes_long_shows_progress_and_can_be_cancelled_there(server: Server, uri: Uri, token: str | None) -> None:
    client = server(SHOWS)
    client.open(uri("main"), SLOW)
    given = {} if token is None else {"workDoneToken": token}
    params = {"command": "potto.evaluate", "arguments": [uri("main"), "f(50000)"], **given}
    id = client.begin("workspace/executeCommand", params)
    while (begun := client.note("$/progress"))["value"]["kind"] != "begin" or "f(50000)" not in begun["value"]["title"]:
        pass
    assert begun["value"]["cancellable"] and (token is None or begun["token"] == token)
    client.tell("window/workDoneProgress/cancel", {"token": begun["token"]})
    assert client.answer(id, 10)["error"]["message"] == "cancelled"
    assert client.note("$/progress", token=begun["token"])["value"]["kind"] == "end"


@pytest.mark.parametrize(
    ("text", "kind"), [("def f(t) t^2\n", "curve"), ("def f(x, y) x*y\n", "image"), ("f = \\(x, y) . c . x\n", None)]
)
def test_preview(server: Server, uri: Uri, text: str, kind: str | None) -> None:
    client = server()
    client.open(uri("main"), text)
    answer = run(client, "potto.preview", uri("main"), "f")
    if kind is None:
        assert "not a function of one or two numbers" in answer["error"]["message"]
    else:
        assert answer["result"]["kind"] == kind and "0 to 1" in answer["result"]["text"]
        data = base64.b64decode(answer["result"]["image"].partition(",")[2])
        assert data.startswith(b"\x89PNG") and data.endswith(b"IEND\xaeB`\x82")


def test_live_values_are_hints(server: Server, uri: Uri) -> None:
    client = server(REFRESHES)
    client.open(uri("main"), TEXT)
    assert hints(client, uri("main")) == {}
    found = shown(client, uri("main"), {2, 4, 6})
    assert re.match(r"= 0\.1250{9,} ± ", found[2]) and "not" not in found[2]
    assert float(found[2].partition("± ")[2]) < 1e-9
    assert found[4].startswith("= 0.125000") and found[4].endswith("not 0.5")
    assert found[6] == "= ?"


def test_what_is_exact_and_what_is_no_number_has_no_error_bar(server: Server, uri: Uri) -> None:
    client = server(REFRESHES)
    client.open(uri("main"), "#> 2^3\n#> 1/0\n#> integral [0, 1] x d(x)\n")
    found = shown(client, uri("main"), {0, 1, 2})
    assert (found[0], found[1]) == ("= 8", "= not converged: inf") and found[2].startswith("= 0.5")
    span = {"start": {"line": 0, "character": 0}, "end": {"line": 3, "character": 0}}
    told = client.ask("textDocument/inlayHint", {"textDocument": {"uri": uri("main")}, "range": span})
    told = {hint["position"]["line"]: hint["tooltip"]["value"] for hint in told}
    assert (told[0], told[1]) == ("exact", "") and (told[2].startswith("error at most ") or told[2] == "exact")


def test_an_edit_elsewhere_evaluates_nothing(server: Server, uri: Uri) -> None:
    client = server(REFRESHES)
    client.open(uri("main"), TEXT)
    shown(client, uri("main"), {2, 4, 6})
    client.change(uri("main"), 2, {"text": "# above\n" + TEXT + "def other(t) t\n"})
    assert hints(client, uri("main"))[3].startswith("= 0.125")
    client.change(uri("main"), 3, {"text": TEXT.replace("* x d", "* x^2 d")})
    assert shown(client, uri("main"), {2})[2].startswith("= 0.04166")  # t^3/3 at 1/2


@pytest.mark.parametrize("watches", [True, False])
def test_an_edited_file_of_data_counts_again(server: Server, uri: Uri, tmp_path: Path, watches: bool) -> None:
    """Its values, its size and its hover; a broken row is told at the `load`. Also where nobody says that it was
    edited."""
    workspace = {**REFRESHES["workspace"], "didChangeWatchedFiles": {"dynamicRegistration": watches}}
    client = server({**REFRESHES, "workspace": workspace})
    heights = tmp_path / "heights.csv"
    heights.write_text("1\n2\n6\n")
    client.open(uri("main"), 'xs = load("heights.csv")\ndef mean(v: [n] Real) sum x in v (x)/n\n#> mean(xs)\n')
    hover = {"textDocument": {"uri": uri("main")}, "position": {"line": 0, "character": 0}}

    def edited(text: str) -> None:
        heights.write_text(text)
        if watches:
            client.tell("workspace/didChangeWatchedFiles", {"changes": [{"uri": heights.as_uri(), "type": 2}]})

    assert shown(client, uri("main"), {2})[2] == "= 3"
    assert "[3] Real" in client.ask("textDocument/hover", hover)["contents"]["value"]
    edited("2\n4\n6\n8\n")
    until(lambda: shown(client, uri("main"), {2})[2] == "= 5")
    assert "[4] Real" in client.ask("textDocument/hover", hover)["contents"]["value"]
    edited("2\nfour\n")
    until(lambda: "P0803" in {said["code"] for said in client.note(PUSHED, uri=uri("main"))["diagnostics"]})


def until(holds: Callable[[], bool], seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_a_value_that_is_not_the_expected_one_is_an_error(server: Server, uri: Uri) -> None:
    client = server(REFRESHES)
    client.open(uri("main"), TEXT)
    hints(client, uri("main"))
    while True:
        found = {said["code"]: said for said in client.note(PUSHED, uri=uri("main"))["diagnostics"]}
        if "P0530" in found:
            break
    assert (found["P0530"]["severity"], found["P0530"]["range"]["start"]) == (1, {"line": 5, "character": 3})
    assert "not 0.5" in found["P0530"]["message"] and found["P0101"]["range"]["start"]["line"] == 6
    client.change(uri("main"), 2, {"text": TEXT.replace("#= 0.5", "#= 0.125")})
    assert "P0530" not in [said["code"] for said in client.note(PUSHED, uri=uri("main"), version=2)["diagnostics"]]


def test_a_client_that_pulls_is_told_to_pull_again(server: Server, uri: Uri) -> None:
    client = server({"textDocument": {"diagnostic": {}}, "workspace": {"diagnostics": {"refreshSupport": True}}})
    client.open(uri("main"), TEXT)
    hints(client, uri("main"))
    document = {"textDocument": {"uri": uri("main")}}
    while "P0530" not in str(client.ask("textDocument/diagnostic", document)):
        assert client.asked.get(timeout=60)["method"] == "workspace/diagnostic/refresh"


def test_what_comes_out_can_be_written_down(server: Server, uri: Uri) -> None:
    """The action takes the place of a wrong expectation, or adds one; then nothing is left to say."""
    text = "def f(t) t/8\n#> f(2)\n#= 3\n#> f(4)\n"
    client = server(REFRESHES)
    client.open(uri("main"), text)
    shown(client, uri("main"), {1, 3})
    for line, title in ((3, "Expect 0.5"), (2, "Expect 0.25")):
        place = {"start": {"line": line, "character": 3}, "end": {"line": line, "character": 3}}
        params = {"textDocument": {"uri": uri("main")}, "range": place, "context": {"diagnostics": []}}
        action = next(a for a in client.ask("textDocument/codeAction", params) if a["title"] == title)
        (edit,) = action["edit"]["changes"][uri("main")]
        lines = text.splitlines(keepends=True)
        start, end = edit["range"]["start"], edit["range"]["end"]
        lines[line] = lines[line][: start["character"]] + edit["newText"] + lines[line][end["character"] :]
        text = "".join(lines)
    assert text == "def f(t) t/8\n#> f(2)\n#= 0.25\n#> f(4)\n#= 0.5\n"
    client.change(uri("main"), 2, {"text": text})
    assert client.note(PUSHED, uri=uri("main"), version=2)["diagnostics"] == []


def test_hover_shows_values_and_slopes_with_error_bars(server: Server, uri: Uri) -> None:
    client = server(REFRESHES)
    client.open(uri("main"), TEXT)
    params = {"textDocument": {"uri": uri("main")}, "position": {"line": 0, "character": 4}}
    shown(client, uri("main"), {2})
    until = time.monotonic() + 60
    while "**values**" not in (text := client.ask("textDocument/hover", params)["contents"]["value"]):
        assert time.monotonic() < until
        time.sleep(0.02)
    values = text.partition("**values**")[2]
    assert re.search(r"`f\(0\.5\)` = 0\.125\d* ± \d", values)
    assert re.search(r"by `t`: 0\.(5|4999)\d* ± \d", values)  # d/dt t^2/2 = t
    on_comment = {"textDocument": {"uri": uri("main")}, "position": {"line": 2, "character": 1}}
    assert "as expected" in client.ask("textDocument/hover", on_comment)["contents"]["value"]


def test_nothing_is_evaluated_unasked_when_that_is_switched_off(server: Server, uri: Uri) -> None:
    client = server(REFRESHES)
    client.tell("workspace/didChangeConfiguration", {"settings": {"potto": {"live": {"enabled": False}}}})
    client.open(uri("main"), TEXT)
    assert hints(client, uri("main")) == {}
    time.sleep(0.5)
    assert hints(client, uri("main")) == {} and client.asked.empty()
    assert "result" in run(client, "potto.evaluate", uri("main"), "f(0.5)")


def ask(evaluator: EvaluationQueue, text: str, **more: Any) -> Any:
    """What an evaluator answers."""
    answers: SimpleQueue[Any] = SimpleQueue()
    evaluator.put(EvaluationTask("evaluate", "<text>", text, answers.put, **more))
    answer = answers.get(timeout=60)
    return {"text": answer["result"]["text"]} if "result" in answer else answer


def test_an_evaluation_that_dies_is_started_again() -> None:
    evaluator = EvaluationQueue(Analysis("utf-16"))
    assert ask(evaluator, "1 + 1") == {"text": "2"}
    assert evaluator._process is not None
    evaluator._process.kill()
    evaluator._process.wait()
    assert ask(evaluator, "2 + 3") == {"text": "5"}
    evaluator.close()


def kill_at_work(evaluator: EvaluationQueue, monkeypatch: pytest.MonkeyPatch, times: int) -> list[int]:
    """End the process of an evaluator when it has been asked something, and then those that follow; their ids."""
    waits, killed = evaluator._await, list[int]()

    def kill(id: int, task: EvaluationTask) -> Any:
        process = evaluator._process
        if process is not None and len(killed) < times:
            killed.append(process.pid)
            process.kill()
        return waits(id, task)

    monkeypatch.setattr(evaluator, "_await", kill)
    return killed


def test_an_evaluation_that_dies_at_work_is_asked_once_more(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluator = EvaluationQueue(Analysis("utf-16"))
    killed = kill_at_work(evaluator, monkeypatch, 1)
    assert ask(evaluator, "2 + 3") == {"text": "5"}
    assert len(killed) == 1
    evaluator.close()


def test_a_question_that_ends_two_processes_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluator = EvaluationQueue(Analysis("utf-16"))
    killed = kill_at_work(evaluator, monkeypatch, 2)
    assert "ended unexpectedly" in ask(evaluator, HEAVY)["error"]
    assert len(set(killed)) == 2
    assert ask(evaluator, "2 + 3") == {"text": "5"}
    evaluator.close()


@pytest.mark.parametrize("deaf", [False, True], ids=["interrupted", "killed"])
def test_an_evaluation_that_hangs_is_ended(deaf: bool) -> None:
    """Also one that does not heed an interrupt: stopped, as a process that waits for something for ever."""
    evaluator = EvaluationQueue(Analysis("utf-16"))
    evaluator._analysis.settings = {"evaluation.timeLimit": 0.5}
    assert ask(evaluator, "1 + 1") == {"text": "2"}
    if deaf:
        assert evaluator._process is not None
        evaluator._process.send_signal(signal.SIGSTOP)
    assert "stopped after 0.5 seconds" in ask(evaluator, HEAVY)["error"]
    assert ask(evaluator, "2 + 3") == {"text": "5"}
    evaluator.close()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux holds a process to what it may allocate")
def test_an_evaluation_that_takes_too_much_memory_is_stopped() -> None:
    """It is told so, and what is asked next is answered."""
    evaluator = EvaluationQueue(Analysis("utf-16"))
    assert ask(evaluator, "1 + 1") == {"text": "2"}
    evaluator._analysis.settings = {"evaluation.memoryLimit": 300}
    for _ in range(2):
        assert "stopped at 300 MB of memory" in ask(evaluator, LARGE)["error"]
        assert ask(evaluator, "2 + 3") == {"text": "5"}
    evaluator._analysis.settings = {}
    assert ask(evaluator, LARGE)["text"].startswith("14999998.5")
    evaluator.close()


def test_what_a_user_asks_for_does_not_wait_for_what_is_shown() -> None:
    """A live expression that takes long gives way and is done afterwards."""
    evaluator = EvaluationQueue(Analysis("utf-16"))
    evaluator._analysis.settings = {"evaluation.timeLimit": 4}
    assert ask(evaluator, "1 + 1") == {"text": "2"}
    done: list[str] = []
    ended = Event()
    evaluator.put(
        EvaluationTask("evaluate", "<text>", HEAVY, lambda a: (done.append("shown"), ended.set()), urgency=LIVE)
    )
    time.sleep(0.1)
    assert ask(evaluator, "2 + 3") == {"text": "5"} and done == []
    assert ended.wait(60) and done == ["shown"]
    evaluator.close()


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
