"""Helper processes beside the server's analysis: what it says is the same with them, and they end."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pytest
from potto_lsp.analysis import Analysis
from potto_lsp.documents import Document
from potto_lsp.text import DocumentText
from potto_lsp.uris import to_uri

from potto.crew import crew

COUNT = 12


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Modules that import each other, each with something wrong; any number of them is worth a helper."""
    for number in range(COUNT):
        first = f"from m{number - 1} import f, g as h\n" if number else "import nothing\n"
        (tmp_path / f"m{number}.po").write_text(f"{first}\ndef f(t)\n    t + {number}\n\ndef g(t)\n    f(t)*unknown\n")
    for enough in ("ENOUGH", "ENOUGH_FOR_COPIES"):
        monkeypatch.setattr(crew, enough, 1)
    monkeypatch.setattr(crew, "usable_processors", lambda: 3)
    return tmp_path


def session(folder: Path) -> Analysis:
    """An analysis of a folder in which the last module is open, and edited."""
    made = Analysis("utf-16")
    made.set_folders([to_uri(str(folder))])
    made.put(Document(to_uri(str(folder / "m5.po")), "potto", 1, DocumentText("def f(t, k)\n    t\n", "utf-16")))
    return made


def test_what_is_said_is_the_same_with_helpers(folder: Path) -> None:
    helped, alone = session(folder), session(folder)
    helped.call_helpers()
    assert helped.helpers
    while not helped.helpers_have_found:
        time.sleep(0.001)
    for key in reversed(helped.programs()):
        while helped.helpers_have_found:
            helped.take_over()
        helped.diagnostics(key)
    helped.dismiss_helpers()
    assert helped.taken
    for key in helped.programs():
        assert helped.diagnostics(key) == alone.diagnostics(key)
    assert sum(map(len, map(alone.diagnostics, alone.programs()))) > COUNT
    helped.forget_trees()
    for key in helped.programs():
        assert helped.diagnostics(key) == alone.diagnostics(key)


def test_the_end_of_a_long_open_file_is_checked_by_helpers(folder: Path) -> None:
    key, text = str(folder / "m5.po"), "".join(f"def f{n}(t)\n    t + unknown*{n}\n\n" for n in range(1000))
    helped, alone = session(folder), session(folder)
    for analysis in (helped, alone):
        analysis.put(Document(to_uri(key), "potto", 2, DocumentText(text, "utf-16")))
    helped.call_helpers()
    while not helped.helpers_have_found:
        time.sleep(0.001)
    with helped.db.recording() as events:
        assert helped.diagnostics(key) == alone.diagnostics(key)
    here = [event.args[1] for event in events if event.query == "definition_diagnostics" and event.kind == "executed"]
    assert "f0" in here and "f999" not in here
    helped.dismiss_helpers()
    assert len(alone.diagnostics(key)) == 1000 and key not in helped.taken


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_helpers_that_die_are_not_missed(folder: Path) -> None:
    helped, alone = session(folder), session(folder)
    helped.call_helpers()
    for process in helped.helpers:
        os.kill(process, signal.SIGKILL)
    assert [helped.diagnostics(key) for key in helped.programs()] == [
        alone.diagnostics(key) for key in helped.programs()
    ]
    helped.dismiss_helpers()
    assert not helped.helpers
