"""Files on disk and in editors: loading, what is not text, noticing changes."""

from __future__ import annotations

import os
import threading
import tracemalloc
from pathlib import Path

import pytest

from potto.modules import Files, Unreadable, find_module, load_file, module_diagnostics, names, resolve, source
from potto.modules.files import MAX_BYTES, load
from potto.modules.texts import content
from potto.query import Database


@pytest.fixture
def files(tmp_path: Path) -> Files:
    return Files(Database(), [tmp_path])


def codes(files: Files, path: Path) -> list[str]:
    return [found.code for found in module_diagnostics(files.db, files.key(path))]


def test_a_program_on_disk(files: Files, tmp_path: Path) -> None:
    (tmp_path / "main.po").write_text("from pkg.m import f\nprint(f(1))\n")
    (tmp_path / "pkg").mkdir()
    (tmp_path / "pkg/m.po").write_text("def f(x) x\n")
    main = files.open(tmp_path / "main.po")
    assert main == str(tmp_path / "main.po")
    assert find_module(files.db, main, "pkg.m") == str(tmp_path / "pkg/m.po")
    assert resolve(files.db, main, "f") is not None
    assert codes(files, tmp_path / "main.po") == []
    assert files.all_files() == (main, str(tmp_path / "pkg/m.po"))


@pytest.mark.parametrize(
    ("data", "code", "words"),
    [
        (b"def f(x) x + \xff\n", "P0209", ["byte 13", "0xff"]),
        (b"\xef\xbb\xbfdef f(x) \xc3(\n", "P0209", ["byte 12", "0xc3"]),
        ("def f(x) x\n".encode("utf-16"), "P0209", ["UTF-16"]),
        (b"x" * (MAX_BYTES + 1), "P0208", ["too large", "16,000,001"]),
    ],
)
def test_what_is_no_text_is_told_with_the_place(
    files: Files, tmp_path: Path, data: bytes, code: str, words: list[str]
) -> None:
    path = tmp_path / "m.po"
    path.write_bytes(data)
    (found,) = module_diagnostics(files.db, files.open(path))
    assert found.code == code
    assert all(word in found.message for word in words), found.message
    assert source(files.db, str(path)) is None
    (tmp_path / "main.po").write_text("from m import f\nprint(f(1))\n")
    assert codes(files, tmp_path / "main.po") == [code], "said of the import too, and nothing about its names"


def test_a_small_file_takes_little_memory(tmp_path: Path) -> None:
    (tmp_path / "m.po").write_text("def f(x) x\n")
    tracemalloc.start()
    try:
        assert load(str(tmp_path / "m.po")).content == "def f(x) x\n"
        assert tracemalloc.get_traced_memory()[1] < 100_000  # bytes; a page or two of it for the buffer
    finally:
        tracemalloc.stop()


def test_a_file_that_grows_while_it_is_read_is_read_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "m.po"
    path.write_text("def f(x) x\n")
    before = os.stat(path)
    path.write_text("def f(x) x\ndef g(x) f(x)\n")
    monkeypatch.setattr("potto.modules.files.os.stat", lambda _: before)
    assert load(str(path)).content == "def f(x) x\ndef g(x) f(x)\n"


def test_what_is_no_file(files: Files, tmp_path: Path) -> None:
    (tmp_path / "m.po").mkdir()
    os.mkfifo(tmp_path / "pipe.po")
    assert codes(files, tmp_path / "gone.po") == ["P0208"]
    assert codes(files, tmp_path / "m.po") == ["P0208"]
    assert codes(files, tmp_path / "pipe.po") == ["P0208"]
    assert codes(files, tmp_path / "gone.po" / "below.po") == ["P0208"]
    assert codes(files, tmp_path / "nul\0.po") == ["P0208"]
    (tmp_path / "main.po").write_text("import m\nprint(m.f(1))\n")
    assert codes(files, tmp_path / "main.po") == ["P0202"], "a folder is not a module"


def test_a_file_without_permission(files: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "m.po").write_text("def f(x) x\n")

    def refuse(*args: object, **kwargs: object) -> object:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("builtins.open", refuse)
    (found,) = module_diagnostics(files.db, str(tmp_path / "m.po"))
    assert (found.code, "Permission denied" in found.message) == ("P0208", True)


def test_a_byte_order_mark_is_no_part_of_the_text(files: Files, tmp_path: Path) -> None:
    path = tmp_path / "m.po"
    path.write_bytes(b"\xef\xbb\xbfdef f(x) x\n")
    assert names(files.db, files.open(path)) == ("f",)
    assert codes(files, path) == []


def test_refresh_sees_what_changed_appeared_and_went(files: Files, tmp_path: Path) -> None:
    main, m = tmp_path / "main.po", tmp_path / "m.po"
    main.write_text("from m import f\nprint(f(1))\n")
    files.open(main)
    assert codes(files, main) == ["P0202"]
    assert files.refresh() == ()
    m.write_text("def f(x) x\n")
    assert codes(files, main) == ["P0202"], "nobody has looked yet"
    assert files.refresh() == (str(m),)
    assert codes(files, main) == []
    m.write_text("def g(x) x\n")
    os.utime(m, ns=(1, 1))
    assert files.refresh([str(m)]) == (str(m),)
    assert codes(files, main) == ["P0203"]
    m.unlink()
    assert files.refresh() == (str(m),)
    assert codes(files, main) == ["P0202"]


def test_an_open_editor_wins_until_it_is_closed(files: Files, tmp_path: Path) -> None:
    path = tmp_path / "m.po"
    path.write_text("def f(x) x\n")
    key = files.open(path, "def g(x) x\n")
    assert names(files.db, key) == ("g",)
    path.write_text("def on_disk(x) x\n")
    files.refresh()
    assert names(files.db, key) == ("g",)
    files.close(key)
    assert names(files.db, key) == ("on_disk",)
    unsaved = files.open(tmp_path / "new.po", "def n(x) x\n")
    assert unsaved in files.all_files()
    files.close(unsaved)
    assert content(files.db, unsaved) is None


def test_hints_come_from_the_disk(files: Files, tmp_path: Path) -> None:
    (tmp_path / "half_plane.diffeo").write_text("cond = \\x . x\n")
    (tmp_path / "shaders").mkdir()
    (tmp_path / "shaders/kinds.po").write_text("def lin(x) x\n")
    (tmp_path / "main.po").write_text("from half_plne import cond\nfrom half_plane import lin\nprint(cond(1), lin)\n")
    first, second = module_diagnostics(files.db, files.open(tmp_path / "main.po"))
    assert first.help == "did you mean `half_plane`?"
    assert "`shaders.kinds`" in second.help
    (tmp_path / "half_plne.po").write_text("def cond(x) x\n")
    files.refresh()
    assert codes(files, tmp_path / "main.po") == ["P0203"]


def test_roots_can_change(files: Files, tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "m.po").write_text(f"def {name}(x) x\n")
    assert len(files.all_files()) == 2
    files.set_roots([tmp_path / "two", tmp_path / "one"])
    assert find_module(files.db, "<text>", "m") == str(tmp_path / "two/m.po")
    files.set_roots([tmp_path / "one"])
    assert find_module(files.db, "<text>", "m") == str(tmp_path / "one/m.po")
    assert files.all_files() == (str(tmp_path / "one/m.po"),)
    assert files.roots == (str(tmp_path / "one"),)


def test_load_file_reads_now(tmp_path: Path) -> None:
    db, path = Database(), tmp_path / "m.po"
    path.write_text("def f(x) x\n")
    key = load_file(db, path)
    path.write_text("def g(x) x\n")
    assert names(db, key) == ("f",)
    assert names(db, load_file(db, path)) == ("g",)
    path.write_bytes(b"\xff\xfe")
    assert isinstance(content(db, load_file(db, path)), Unreadable)


def test_typing_verifies_nothing_of_files_that_are_not_open(files: Files, tmp_path: Path) -> None:
    (tmp_path / "a.po").write_text("from b import f\ndef g(x) f(x)\n")
    (tmp_path / "b.po").write_text("def f(x) x\n")
    main = files.open(tmp_path / "main.po", "from a import g\nprint(g(1))\n")
    a = str(tmp_path / "a.po")
    module_diagnostics(files.db, main), module_diagnostics(files.db, a)
    files.set_text(main, "from a import g\nprint(g(12))\n")
    with files.db.recording() as events:
        module_diagnostics(files.db, main), module_diagnostics(files.db, a)
    of_a = [event for event in events if a in event.args]
    assert {event.kind for event in of_a} == {"reused"}
    assert len(of_a) <= 4, "each where it is read, and nothing below"


def test_many_threads(files: Files, tmp_path: Path) -> None:
    (tmp_path / "main.po").write_text("from m import f\nprint(f(1))\n")
    main, m = files.open(tmp_path / "main.po"), str(tmp_path / "m.po")
    failures: list[BaseException] = []

    def work(number: int) -> None:
        try:
            for turn in range(30):
                files.set_text(m, f"def f(x) x + {number} + {turn}\n")
                files.refresh()
                module_diagnostics(files.db, main)
                files.all_files()
                files.close(m)
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
    assert not failures and not any(thread.is_alive() for thread in threads)
