"""What was found out in an earlier session: told at once while it holds, and never when it does not."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from lsp_client import Client
from potto_lsp.analysis import Analysis
from potto_lsp.client import Client as Introduced
from potto_lsp.documents import Document
from potto_lsp.features.diagnosing import workspace
from potto_lsp.publishing import Publisher
from potto_lsp.text import DocumentText
from potto_lsp.uris import to_uri

from potto.checking.recalled import said_earlier
from potto.reports.render import Located

PUSHED = "textDocument/publishDiagnostics"
LIB = "def step(u) [u > 0]\n"
MAIN = "from lib import step\nfrom lib import nothing\ndef f(t) integral [0, 1] step(x - t)*y d(x)\nprint(f(unknown))\n"


@pytest.fixture
def cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A store of its own: the folder of what was said about single files."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("POTTO_CACHE", str(folder))
    yield folder / "store" / "checked"


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
    return said_earlier(session(folder, text).db, str(folder / "main.po"))


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
    (path,) = cache.iterdir()
    whole = path.read_bytes()
    wrong = [b"", b"{", whole[: len(whole) // 2], b"\0" * 10, whole[:-1] + bytes([whole[-1] ^ 1]), whole + b"\0"]
    for data in wrong:
        path.write_bytes(data)
        assert known(folder) is None, data[:80]
    path.write_bytes(whole)
    assert known(folder) == found
    path.rename(path.with_name("0" * 64))
    assert known(folder) is None, "it is said of another file"


def test_where_nothing_can_be_written_nothing_is_kept(
    cache: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "file").write_text("")
    monkeypatch.setenv("POTTO_CACHE", str(folder / "file"))
    checked(folder)
    assert known(folder) is None


def test_a_server_tells_what_an_earlier_one_has_found(cache: Path, folder: Path) -> None:
    uri = (folder / "main.po").as_uri()
    told = []
    for _ in range(2):
        client = Client(folder)
        client.start()
        client.open(uri, MAIN)
        told.append(client.note(PUSHED, uri=uri, version=1)["diagnostics"])
        wait_for(cache)
        client.process.kill()
    assert told[0] == told[1] and len(told[0]) >= 3


def wait_for(folder: Path) -> None:
    """Wait until something was kept."""
    until = time.monotonic() + 20
    while not (folder.is_dir() and list(folder.iterdir())) and time.monotonic() < until:
        time.sleep(0.05)


def test_a_server_keeps_what_it_knows_of_the_workspace_and_begins_with_it(cache: Path, folder: Path) -> None:
    """Closed files are told of by an earlier session's answers, the edited one among them by its own."""
    wrong = "from lib import step\ndef g(t) step(t, t)\n"
    (folder / "closed.po").write_text(wrong)
    (folder / "edited.po").write_text(wrong)
    uris = [(folder / name).as_uri() for name in ("closed.po", "edited.po", "main.po")]
    for turn in range(2):
        client = Client(folder)
        client.start()
        client.open(uris[2], MAIN)
        told = [len(client.note(PUSHED, uri=uri)["diagnostics"]) for uri in uris[:2]]
        assert told == [1, 1 + turn]
        wait_for(cache.parent / "workspaces")
        client.process.kill()
        (folder / "edited.po").write_text(wrong + "def h(t) step(t, t)\n")


def analysed(made: Analysis) -> set[str]:
    """The files in which definitions are analysed when all are asked for."""
    with made.db.recording() as events:
        for key in made.programs():
            made.diagnostics(key)
    groups = [event.args[0] for event in events if event.query == "_analyses" and event.kind == "executed"]
    return {Path(target.file).name for group in groups for target in group}  # type: ignore[attr-defined]


def test_a_session_takes_over_what_an_earlier_one_has_kept(cache: Path, folder: Path) -> None:
    def kept() -> None:
        done.append(True)

    done: list[bool] = []
    earlier = session(folder)
    assert analysed(earlier) == {"lib.po", "main.po"}
    for step in earlier.keep_all(kept):
        step()
    assert done
    later = session(folder)
    later.look_for_kept()
    later.take_all_kept()
    assert later.known_before == set(later.programs()) == later.taken
    later.settled = True  # nothing more is told from what was said of single files
    assert analysed(later) == set()
    assert [later.diagnostics(key) for key in later.programs()] == [earlier.diagnostics(k) for k in earlier.programs()]
    edited = session(folder, MAIN.replace("unknown", "f"))
    edited.look_for_kept()
    edited.take_all_kept()
    alone = session(folder, MAIN.replace("unknown", "f"))
    assert edited.known_before == {str(folder / "lib.po")}
    assert analysed(edited) <= {"main.po"}
    assert [edited.diagnostics(key) for key in edited.programs()] == [alone.diagnostics(k) for k in alone.programs()]


def test_who_asks_about_the_workspace_before_it_was_checked_is_told_what_was_kept(cache: Path, folder: Path) -> None:
    earlier = session(folder)
    analysed(earlier)
    for step in earlier.keep_all(lambda: None):
        step()
    later = session(folder)
    later.look_for_kept()
    publisher = Publisher(later, Introduced(), lambda method, params: None)
    known = SimpleNamespace(publisher=publisher, checked=False)
    ask: Any = SimpleNamespace(analysis=later, session=known, optional=lambda name: None)
    with later.db.recording() as events:
        items = {item["uri"]: len(item["items"]) for item in workspace(ask)["items"]}
    assert items == {to_uri(key): len(earlier.diagnostics(key)) for key in earlier.programs()}
    assert not any(event.query == "_analyses" for event in events if event.kind == "executed")
