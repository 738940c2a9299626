"""Questions about whole files take time in proportion to the file, cold and after a key. Held by counting calls and
queries, not by the clock."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from call_counts import calls_in
from potto_lsp.asking import Ask
from potto_lsp.client import Client
from potto_lsp.documents import Document
from potto_lsp.features import FEATURES
from potto_lsp.session import ClientSession
from potto_lsp.text import DocumentText
from potto_lsp.wire import framed

URI = "file:///nowhere/whole.po"
DOCUMENT = {"textDocument": {"uri": URI}}
CAPABILITIES = {
    "experimental": {"commands": {"commands": ["potto.preview", "potto.showReferences"]}},
    "textDocument": {"documentSymbol": {"hierarchicalDocumentSymbolSupport": True}},
}
METHODS = (
    "textDocument/codeLens", "textDocument/semanticTokens/full", "textDocument/semanticTokens/range",
    "textDocument/documentSymbol", "textDocument/inlayHint", "textDocument/foldingRange", "textDocument/formatting",
    "textDocument/documentLink", "textDocument/inlineValue", "textDocument/linkedEditingRange",
    "textDocument/documentHighlight", "textDocument/selectionRange", "textDocument/references", "potto/scenes",
)  # fmt: skip
FEW, MANY = 24, 96
# Twice the size may take twice the calls, and some more for what is found by bisection; the square would be 16.
MOST = 1.25 * MANY / FEW


def plain(n: int) -> str:
    body = "    integral [0, 1] [x < t]*a*x d(x)"
    return "".join(f"# No. {i}\ndef f{i}(t, k)\n    a = k^2+{i}\n{body}\n\n" for i in range(n))


def calling(n: int) -> str:
    """Each calls the one before."""
    return "f0 = \\(t) . t\n" + "".join(f"def f{i}(t)\n    f{i - 1}(t) + {i}\n" for i in range(1, n))


def looked_at(n: int) -> str:
    live = "#> f{0}({0}, -1)\n#> deriv(f{0})(dt=(1, 1), dk=(2, 0))\n"
    return "".join(f"def f{i}(t, k) t*k + {i}\n{live.format(i)}" for i in range(n))


def shaded(n: int) -> str:
    """Half of them take what the others are."""
    shaders = "".join(f"def s{i}(x, y)(c) x + y*c + {i}\n" for i in range(n // 2))
    return shaders + "".join(f"def r{i}(c, shade) integral [0, 1] shade(x, x)(c) d(x)\n" for i in range(n - n // 2))


def script(n: int) -> str:
    return "def f(t) t^2\n" + "".join(f"print(f({i}), {i})\n" for i in range(n))


def constants(n: int) -> str:
    return "".join(f"c{i} = {i}*pi\n" for i in range(n))


def again(n: int) -> str:
    """One name, defined over and over."""
    return "".join(f"def f(t) t + {i}\n" for i in range(n))


def terms(n: int) -> str:
    """One definition with much in it."""
    return "def f(a, b)\n    " + " + ".join(f"a*{i}+ b" for i in range(4 * n)) + "\n"


PROGRAMS = {each.__name__: each for each in (plain, calling, looked_at, shaded, script, constants, again, terms)}


def session() -> ClientSession:
    made = ClientSession(
        Client({"capabilities": CAPABILITIES}), lambda *_: None, lambda *_: None, lambda action: action()
    )
    made.load()
    return made


def put(session: ClientSession, text: str, version: int = 1) -> DocumentText:
    document = Document(URI, "potto", version, DocumentText(text))
    session.analysis.put(document)
    return document.text


def ask(session: ClientSession, method: str, text: DocumentText) -> Any:
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": text.lines.count, "character": 0}}
    line, column = text.position(text.text.index("f") if "f" in text.text else 0)
    place = {"line": line, "character": column}
    params = {
        **DOCUMENT, "range": whole, "position": place, "positions": [place], "context": {"includeDeclaration": True},
    }  # fmt: skip
    with session.analysis.db.evaluating():
        answer = FEATURES[method].answer(Ask(session, params))
    return json.loads(framed({"id": 1, "result": answer}).partition(b"\r\n\r\n")[2])["result"]


@contextmanager
def asked(program: Callable[[int], str], n: int) -> Iterator[tuple[ClientSession, DocumentText]]:
    made = session()
    text = put(made, program(n))
    made.analysis.diagnostics(made.analysis.put(Document(URI, "potto", 1, text)))
    yield made, text


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", PROGRAMS)
def test_four_times_the_file_takes_four_times_the_calls_in(name: str, method: str) -> None:
    """Cold, after the file was checked, and once more after a key at its end."""
    found: list[tuple[int, int]] = []
    for n in (FEW // 4, FEW, MANY):  # the first one loads what is loaded once
        with asked(PROGRAMS[name], n) as (made, text):
            cold = calls_in(lambda: ask(made, method, text))
            edited = put(made, text.text.rstrip("\n") + "9\n" if name != "script" else text.text + "print(9)\n", 2)
            made.analysis.diagnostics("/nowhere/whole.po")
            found.append((cold, calls_in(lambda: ask(made, method, edited))))  # noqa: B023
    (_, _), (few_cold, few_warm), (many_cold, many_warm) = found
    assert many_cold <= MOST * few_cold + 200, found
    assert many_warm <= MOST * few_warm + 200, found


@pytest.mark.parametrize("method", METHODS)
def test_a_key_runs_as_many_queries_in_a_large_file_as_in_a_small_one(method: str) -> None:
    ran = []
    for n in (FEW, MANY):
        with asked(plain, n) as (made, text):
            ask(made, method, text)
            edited = put(made, text.text.replace(f"k^2+{n // 2}", f"k^3+{n // 2}"), 2)
            made.analysis.diagnostics("/nowhere/whole.po")
            with made.analysis.db.recording() as events:
                ask(made, method, edited)
            ran.append(sorted(event.query for event in events if event.kind == "executed"))
    assert ran[0] == ran[1]
    assert len(ran[0]) <= 12, ran[0]


@pytest.mark.parametrize("method", ["hover", "documentHighlight", "references", "prepareRename", "codeAction"])
def test_after_a_key_a_name_costs_as_much_in_a_file_sixteen_times_as_long(method: str) -> None:
    """`f0`, which stands nowhere else: chunks without it are not looked at."""
    calls = []
    for n in (FEW, FEW, 16 * FEW):  # the first one loads what is loaded once
        with asked(plain, n) as (made, text):
            line = text.text[: text.text.index("f0")].count("\n")
            place = {"line": line, "character": 4}
            params = {**DOCUMENT, "position": place, "range": {"start": place, "end": place}, "context": {}}
            answer = FEATURES[f"textDocument/{method}"].answer
            answer(Ask(made, params))
            edited = put(made, text.text.replace(f"k^2+{n // 2}", f"k^3+{n // 2}"), 2)
            assert edited.lines.count > n  # an edit by a range does not count them anew
            made.analysis.diagnostics("/nowhere/whole.po")
            calls.append(calls_in(lambda: answer(Ask(made, params))))  # noqa: B023
    assert calls[2] <= 1.25 * calls[1] + 250, calls


def test_colours_after_a_key_are_those_of_a_fresh_session() -> None:
    """They are put together from what was kept for each chunk, wherever it stands now."""
    made = session()
    text = put(made, "\n# é𝄞\n" + plain(3) + script(2))
    edits = [
        lambda text: "# more\n\n" + text,
        lambda text: text.replace("# No. 1\n", ""),
        lambda text: text.replace("k^2+1", "k^2 +\n        1"),
        lambda text: text.replace("\n", "\r\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("print", "  print", 1),
        lambda text: text[: len(text) // 2],
        lambda text: "  x = 1\n" + text,
        lambda text: "",
    ]
    for version, edit in enumerate(edits, 2):
        text = put(made, edit(text.text), version)
        fresh = session()
        put(fresh, text.text)
        found = ask(made, "textDocument/semanticTokens/full", text)["data"]
        assert found == ask(fresh, "textDocument/semanticTokens/range", text)["data"], text.text


def test_what_changed_of_the_colours_makes_the_new_ones_of_the_old() -> None:
    made = session()
    text = put(made, plain(60))
    before = ask(made, "textDocument/semanticTokens/full", text)
    edits = [("k^2+30", "k^2 + 30*t"), ("# No. 5\n", ""), ("def f0(", "\ndef f0("), ("\n", "\n\n")]
    for version, (old, new) in enumerate(edits, 2):
        text = put(made, text.text.replace(old, new, 1), version)
        with made.analysis.db.evaluating():
            params = {**DOCUMENT, "previousResultId": before["resultId"]}
            delta = FEATURES["textDocument/semanticTokens/full/delta"].answer(Ask(made, params))
        data = list(before["data"])
        for edit in delta["edits"]:
            data[edit["start"] : edit["start"] + edit["deleteCount"]] = edit["data"]
        fresh = ask(made, "textDocument/semanticTokens/range", text)["data"]
        assert data == fresh and sum(len(edit["data"]) for edit in delta["edits"]) <= 100
        before = {"resultId": delta["resultId"], "data": data}
