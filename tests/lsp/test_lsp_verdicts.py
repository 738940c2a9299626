"""What was said in an earlier session: told at once while it holds, and never when it does not."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from lsp_client import Client
from potto_lsp.analysis import Analysis
from potto_lsp.documents import Document
from potto_lsp.text import DocumentText
from potto_lsp.uris import to_uri
from potto_lsp.verdicts import FOLDER, Verdicts, program_digest

from potto.reports.render import Located

PUSHED = "textDocument/publishDiagnostics"
LIB = "def step(u) [u > 0]\n"
MAIN = "from lib import step\nfrom lib import nothing\ndef f(t) integral [0, 1] step(x - t)*y d(x)\nprint(f(unknown))\n"


@pytest.fixture
def cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache folder of its own, in which verdicts are."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("POTTO_CACHE", str(folder))
    yield folder / f"{FOLDER}{program_digest()}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "lib.po").write_text(LIB)
    (tmp_path / "main.po").write_text(MAIN)
    return tmp_path


def session(folder: Path, text: str = MAIN) -> Analysis:
    """An analysis of a folder in which `main` is open."""
    made = Analysis("utf-16")
    made.set_folders([to_uri(str(folder))])
    uri = to_uri(str(folder / "main.po"))
    made.put(Document(uri, "potto", 1, DocumentText(text, "utf-16")))
    return made


def known(folder: Path, text: str = MAIN) -> tuple[Located, ...] | None:
    """What a new session knows of `main` without checking it."""
    made = session(folder, text)
    return Verdicts(made.db).of(str(folder / "main.po"))


def checked(folder: Path) -> tuple[Located, ...]:
    """What a session finds out about `main`, which it keeps."""
    made = session(folder)
    found = made.diagnostics(str(folder / "main.po"))
    made.keep(str(folder / "main.po"))
    assert len(found) >= 3
    return found


def test_what_was_found_is_known_to_the_next_session(cache: Path, folder: Path) -> None:
    found = checked(folder)
    assert known(folder) == found
    made = session(folder)
    key = str(folder / "main.po")
    with made.db.recording() as events:
        assert made.diagnostics(key) == found
    assert not any(event.query in ("_analyses", "parsed", "diagnostics") for event in events)
    with made.db.recording() as events:
        assert made.diagnostics(key) == found, "the second time it is found anew"
    assert any(event.query == "_analyses" for event in events)


def test_it_holds_no_more_when_anything_has_changed_that_it_rests_on(cache: Path, folder: Path) -> None:
    found = checked(folder)
    assert known(folder, MAIN + "\n") is None
    (folder / "lib.po").write_text(LIB + "def nothing(x) x\n")
    assert known(folder) is None
    (folder / "lib.po").write_text(LIB)
    assert known(folder) == found
    (folder / "lib.diffeo").write_text("step = \\(x, y) . (x + y, x)\n")  # a second file that `lib` could mean
    assert known(folder) is None
    (folder / "lib.diffeo").unlink()
    (folder / "src").mkdir()
    (folder / "potto.toml").write_text('roots = ["src"]\n')
    assert known(folder) is None


def test_a_file_that_has_nothing_to_do_with_it_changes_nothing(cache: Path, folder: Path) -> None:
    (folder / "main.po").write_text("from lib import step\nprint(step(1))\n")
    made = session(folder, "from lib import step\nprint(step(1))\n")
    made.diagnostics(str(folder / "main.po"))
    made.keep(str(folder / "main.po"))
    (folder / "other.po").write_text("def g(x) x\n")
    assert known(folder, "from lib import step\nprint(step(1))\n") == ()


def test_what_is_not_whole_or_not_ours_is_not_there(cache: Path, folder: Path) -> None:
    found = checked(folder)
    (path,) = cache.glob("*.json")
    whole = path.read_text()
    data = json.loads(whole)
    wrong = [
        "", "{", "[]", "3", '{"file": 1}', "[" * 100_000, whole[: len(whole) // 2], "\x00" * 10,
        json.dumps({**data, "file": "/other.po"}), json.dumps({**data, "reads": {}}), json.dumps({**data, "reads": 3}),
        json.dumps({**data, "found": [{**data["found"][0], "code": "Q1"}]}),
        json.dumps({**data, "found": [{**data["found"][0], "severity": "fatal"}]}),
        json.dumps({**data, "found": [{**data["found"][0], "span": [5, 2]}]}),
        json.dumps({**data, "found": [{**data["found"][0], "related": [1]}]}),
        json.dumps({**data, "found": "x"}),
    ]  # fmt: skip
    for text in wrong:
        path.write_text(text)
        assert known(folder) is None, text[:80]
    path.write_text(whole)
    assert known(folder) == found
    cache.chmod(0o777)
    assert known(folder) is None, "others could have written it"
    cache.chmod(0o700)
    assert known(folder) == found


def test_where_nothing_can_be_written_nothing_is_kept(
    cache: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "file").write_text("")
    monkeypatch.setenv("POTTO_CACHE", str(folder / "file"))
    checked(folder)
    assert known(folder) is None


def test_verdicts_of_other_versions_are_deleted(cache: Path, folder: Path) -> None:
    other = cache.parent / f"{FOLDER}0123"
    other.mkdir(parents=True)
    (other / "a.json").write_text("{}")
    checked(folder)
    assert not other.exists() and len(list(cache.iterdir())) == 1
    assert os.stat(cache).st_mode & 0o077 == 0


def test_a_server_tells_what_an_earlier_one_has_found(cache: Path, folder: Path) -> None:
    uri = (folder / "main.po").as_uri()
    told = []
    for _ in range(2):
        client = Client(folder)
        client.start()
        client.open(uri, MAIN)
        told.append(client.note(PUSHED, uri=uri, version=1)["diagnostics"])
        until = time.monotonic() + 20
        while not list(cache.glob("*.json")) and time.monotonic() < until:
            time.sleep(0.05)
        client.process.kill()
    assert told[0] == told[1] and len(told[0]) >= 3
