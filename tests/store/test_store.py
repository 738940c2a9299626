"""What is kept on disk comes back whole or not at all, whoever shares the folder and whatever was done to it."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from potto import store

posix = pytest.mark.skipif(sys.platform == "win32", reason="a user's folders are the user's own there")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("POTTO_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("POTTO_CACHE_MB", raising=False)
    store._judged.cache_clear()
    return tmp_path / "cache"


def files(folder: Path) -> list[Path]:
    return sorted(path for path in (folder / "store").glob("*/*"))


def test_what_was_put_is_there(folder: Path) -> None:
    assert store.get("text", b"a") is None
    store.put("text", b"a", b"1")
    store.put("text", b"b", b"2")
    store.put("object", b"a", b"3")
    assert [store.get("text", b"a"), store.get("text", b"b"), store.get("object", b"a")] == [b"1", b"2", b"3"]
    store.put("text", b"a", b"4")
    assert store.get("text", b"a") == b"4"
    assert store.complaint() is None
    assert [(kind.name, kind.entries) for kind in store.report().kinds] == [("object", 1), ("text", 2)]
    assert store.report().size == sum(path.stat().st_size for path in files(folder))


def test_anything_can_be_a_key_and_data(folder: Path) -> None:
    @given(key=st.binary(max_size=300), data=st.binary(max_size=3000))
    def comes_back(key: bytes, data: bytes) -> None:
        store.put("bytes", key, data)
        assert store.get("bytes", key) == data

    comes_back()


@pytest.mark.parametrize("kind", ["", "..", "a/b", "A", "a.b", "x" * 99])
def test_a_kind_is_the_name_of_a_folder(kind: str) -> None:
    with pytest.raises(ValueError, match="not a kind"):
        store.put(kind, b"a", b"1")


def test_keys_hold_the_program(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store.put("text", b"a", b"1")
    monkeypatch.setattr(store, "program", lambda: b"another version")
    assert store.get("text", b"a") is None
    store.put("text", b"a", b"2")
    monkeypatch.undo()
    os.environ["POTTO_CACHE"] = str(folder)
    assert store.get("text", b"a") == b"1"


class TestDamage:
    """An entry that is not as it was written counts as not there, and is written anew."""

    @pytest.fixture
    def entry(self, folder: Path) -> Path:
        store.put("text", b"a", b"some text that is kept")
        (path,) = files(folder)
        return path

    def check(self) -> None:
        assert store.get("text", b"a") is None
        store.put("text", b"a", b"anew")
        assert store.get("text", b"a") == b"anew"

    def test_cut_off_anywhere(self, entry: Path) -> None:
        whole = entry.read_bytes()
        for length in range(len(whole)):
            entry.write_bytes(whole[:length])
            assert store.get("text", b"a") is None, length
        self.check()

    def test_any_bit_changed(self, entry: Path) -> None:
        whole = entry.read_bytes()
        for at in range(len(whole)):
            entry.write_bytes(whole[:at] + bytes([whole[at] ^ 4]) + whole[at + 1 :])
            assert store.get("text", b"a") is None, at
        self.check()

    def test_longer(self, entry: Path) -> None:
        entry.write_bytes(entry.read_bytes() + b"\0")
        self.check()

    def test_another_entry_under_its_name(self, entry: Path, folder: Path) -> None:
        store.put("text", b"b", b"another")
        (other,) = set(files(folder)) - {entry}
        entry.write_bytes(other.read_bytes())
        self.check()

    @posix
    def test_a_link(self, entry: Path, tmp_path: Path) -> None:
        elsewhere = tmp_path / "elsewhere"
        entry.rename(elsewhere)
        entry.symlink_to(elsewhere)
        self.check()
        assert elsewhere.exists() and not entry.is_symlink()

    def test_a_folder(self, entry: Path) -> None:
        entry.unlink()
        entry.mkdir()
        self.check()

    @posix
    def test_a_pipe(self, entry: Path) -> None:
        entry.unlink()
        os.mkfifo(entry)
        self.check()

    def test_a_full_folder(self, entry: Path) -> None:
        entry.unlink()
        entry.mkdir()
        (entry / "mine").write_text("keep")
        store.put("text", b"a", b"anew")
        assert store.get("text", b"a") is None and (entry / "mine").exists()

    @posix
    @pytest.mark.skipif(hasattr(os, "getuid") and os.getuid() == 0, reason="root reads everything")
    def test_unreadable(self, entry: Path) -> None:
        entry.chmod(0)
        self.check()


class TestFolder:
    @posix
    def test_is_the_users_alone(self, folder: Path) -> None:
        old = os.umask(0)
        try:
            store.put("text", b"a", b"1")
        finally:
            os.umask(old)
        (entry,) = files(folder)
        for path in (folder / "store", entry.parent, entry):
            assert not stat.S_IMODE(path.stat().st_mode) & 0o077, path

    @posix
    @pytest.mark.parametrize("mode", [0o777, 0o770, 0o722])
    def test_others_can_write_to_it(self, folder: Path, mode: int) -> None:
        store.put("text", b"a", b"1")
        (folder / "store").chmod(mode)
        store._judged.cache_clear()
        assert store.get("text", b"a") is None
        store.put("text", b"b", b"2")
        assert len(files(folder)) == 1
        said = store.complaint()
        assert said is not None and "others can write" in said and f"chmod go-w {folder / 'store'}" in said
        assert store.report().complaint == said

    @posix
    def test_others_can_write_to_a_folder_in_it(self, folder: Path) -> None:
        store.put("text", b"a", b"1")
        (folder / "store" / "text").chmod(0o777)
        store._judged.cache_clear()
        assert store.get("text", b"a") is None
        assert f"chmod go-w {folder / 'store' / 'text'}" in str(store.complaint())

    def test_who_asks_is_told_of_a_folder_that_cannot_be_made(self, tmp_path: Path, monkeypatch: Any) -> None:
        (tmp_path / "file").write_text("")
        monkeypatch.setenv("POTTO_CACHE", str(tmp_path / "file"))
        assert store.complaint() is None
        assert "cannot be made or written" in str(store.report().complaint)

    @posix
    def test_others_can_replace_it(self, tmp_path: Path, folder: Path) -> None:
        folder.mkdir()
        folder.chmod(0o777)
        store.put("text", b"a", b"1")
        assert not list(folder.iterdir()) and f"chmod go-w {folder}" in str(store.complaint())
        folder.chmod(0o1777)  # as /tmp: others can add, but neither rename nor delete what is not theirs
        store._judged.cache_clear()
        store.put("text", b"a", b"1")
        assert files(folder) and store.complaint() is None

    @posix
    def test_belongs_to_somebody_else(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        store.put("text", b"a", b"1")
        store._judged.cache_clear()
        monkeypatch.setattr(os, "getuid", lambda: 12345)
        assert store.get("text", b"a") is None
        assert "set POTTO_CACHE to a folder of yours" in str(store.complaint())

    @posix
    def test_is_a_link(self, folder: Path, tmp_path: Path) -> None:
        folder.mkdir()
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        (folder / "store").symlink_to(tmp_path / "elsewhere")
        store.put("text", b"a", b"1")
        assert not list((tmp_path / "elsewhere").iterdir()) and "is not a folder" in str(store.complaint())

    def test_cannot_be_made(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        folder.write_text("a file")
        store.put("text", b"a", b"1")
        assert store.get("text", b"a") is None and store.complaint() is None and store.report().size == 0

    @pytest.mark.parametrize("word", ["off", "OFF"])
    def test_turned_off(self, word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("POTTO_CACHE", word)
        monkeypatch.chdir(tmp_path)
        store.put("text", b"a", b"1")
        assert store.get("text", b"a") is None and not list(tmp_path.iterdir())
        assert store.report().folder is None and store.complaint() is None
        store.clear()

    def test_deleted_meanwhile(self, folder: Path) -> None:
        import shutil

        store.put("text", b"a", b"1")
        shutil.rmtree(folder)
        store.put("text", b"a", b"1")
        assert store.get("text", b"a") is None


class TestBound:
    """Entries of 10 kB in a store of 1 MB: 87 to 100 of them, whatever heads and counts come to."""

    @pytest.fixture(autouse=True)
    def small(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("POTTO_CACHE_MB", "1")

    def fill(self, numbers: range, folder: Path) -> None:
        for number in numbers:
            store.put("text", b"%d" % number, b"x" * 10_000)
            os.utime(max(files(folder), key=lambda path: path.stat().st_ctime_ns), (number, number))

    def test_it_holds_and_the_longest_unused_go_first(self, folder: Path) -> None:
        self.fill(range(80), folder)
        assert store.get("text", b"3") is not None  # and is the youngest from now on
        self.fill(range(80, 300), folder)
        assert store.report().size <= 1_000_000
        kept = [number for number in range(300) if store.get("text", b"%d" % number) is not None]
        assert kept[0] == 3 and kept[1:] == list(range(kept[1], 300))
        assert len(kept) > 80

    def test_no_entry_is_most_of_it(self, folder: Path) -> None:
        store.put("text", b"a", b"x" * 200_000)
        assert store.get("text", b"a") is None

    @pytest.mark.parametrize("text", ["", "many", "-1", "0", "1e999", "nan"])
    def test_nonsense_is_no_bound(self, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("POTTO_CACHE_MB", text)
        assert store.bound() in (1, 256_000_000)

    def test_what_was_abandoned_goes(self, folder: Path) -> None:
        self.fill(range(1), folder)
        left = folder / "store" / "text" / ".new-1-2-3"
        left.write_bytes(b"half")
        self.fill(range(1, 50), folder)
        assert left.exists(), "somebody may still be writing it"
        os.utime(left, (0, 0))
        self.fill(range(50, 100), folder)
        assert not left.exists()


def test_cleared_but_for_what_is_not_ours(folder: Path) -> None:
    store.put("text", b"a", b"1")
    (folder / "store" / "mine.txt").write_text("keep")
    (folder / "store" / "text" / "mine.txt").write_text("keep")
    store.clear()
    assert store.get("text", b"a") is None and store.report().kinds == ()
    assert len(list((folder / "store").rglob("mine.txt"))) == 2
    store.put("text", b"a", b"1")
    assert store.get("text", b"a") == b"1"


def test_processes_share_it(folder: Path) -> None:
    """Three processes put and get the same 60 entries, in a store that has room for a third of them."""
    script = """
import random, sys
from potto import store
random.seed(int(sys.argv[1]))
for _ in range(400):
    n = random.randrange(60)
    data = b"%d " % n * 8000
    found = store.get("text", b"%d" % n)
    assert found in (None, data), (n, found[:30])
    if found is None:
        store.put("text", b"%d" % n, data)
"""
    environment = {**os.environ, "POTTO_CACHE_MB": "0.5"}
    running = [
        subprocess.Popen([sys.executable, "-c", script, str(n)], env=environment, stderr=subprocess.PIPE, text=True)
        for n in range(3)
    ]
    assert ["" for _ in running] == [process.communicate()[1] for process in running]
    assert 0 < store.report().size <= 500_000 + 3 * 24_000  # each may have counted just before another one wrote
    assert not list(folder.rglob(".new-*"))
