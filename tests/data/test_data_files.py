"""Files on disk: those that can't be read, kinds that are not known, names that are nearly right, what is kept."""

from __future__ import annotations

import os
import subprocess
import sys
from array import array
from pathlib import Path

import pytest
from data_files import mistake

from potto.data import SUFFIXES, TITLES, DataMistake, NumberArray, RealNumber, read, shape_of, suggest, values_of
from potto.data.parsed_files import Memory


def unread(path: Path) -> tuple[str, str, str]:
    found = read(path)
    assert isinstance(found, DataMistake)
    return found.code, found.message, found.hint


def test_files_are_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"1,2\r\n")
    assert read(tmp_path / "a.csv") == b"1,2\r\n"


def test_what_is_not_there(tmp_path: Path) -> None:
    for name in ("points.csv", "points.json", "other.npy", "notes.txt"):
        (tmp_path / name).write_text("1")
    code, message, hint = unread(tmp_path / "point.csv")
    assert (code, message) == ("P0801", "there is no file `point.csv`")
    assert hint == "did you mean `points.csv` or `points.json`?"
    assert unread(tmp_path / "zzzzzz.csv") == ("P0801", "there is no file `zzzzzz.csv`", "")
    assert unread(tmp_path / "no" / "a.csv")[1] == f"there is no folder `{str(tmp_path / 'no')[:39]}…`"
    assert unread(tmp_path / "points.csv" / "a.csv")[0] == "P0801"
    assert unread(Path("a\0b.csv"))[0] == "P0801"


def test_folders_and_devices(tmp_path: Path) -> None:
    (tmp_path / "data.csv").mkdir()
    assert unread(tmp_path / "data.csv")[:2] == ("P0801", "`data.csv` is a folder, not a file")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.csv")
        assert unread(tmp_path / "pipe.csv")[:2] == ("P0801", "`pipe.csv` is not an ordinary file")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="who may read everything is never refused")
def test_what_may_not_be_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1")
    (tmp_path / "a.csv").chmod(0)
    assert unread(tmp_path / "a.csv")[:2] == ("P0801", "the file `a.csv` cannot be read: permission denied")


def test_names_that_are_nearly_right() -> None:
    beside = ["Points.csv", "points.npz", "image.png", "main.po", "pints.csv"]
    assert suggest(Path("data/points.csv"), beside) == ("Points.csv", "pints.csv", "points.npz")
    assert suggest(Path("image.jpg"), beside) == ("image.png",)
    assert suggest(Path("quite_different.csv"), ["a.csv"]) == ()


@pytest.mark.parametrize(
    ("name", "message", "hint"),
    [
        ("a.xlsx", "files with the suffix .xlsx can't be read", "save the sheet as a table in text, with the suffix"),
        ("a.GIF", "files with the suffix .gif can't be read", "save the picture as PNG"),
        ("a.txt", "files with the suffix .txt can't be read", "if it is a table in text, give it the suffix .csv"),
        ("a", "a file without a suffix can't be read", "if it is a table in text, give it the suffix .csv"),
        ("a.xyz", "files with the suffix .xyz can't be read", "known are .csv, .tsv"),
    ],
)
def test_kinds_that_are_not_known(name: str, message: str, hint: str) -> None:
    found = mistake(name, b"1,2")
    assert (found.code, found.message) == ("P0802", message)
    assert found.hint.startswith(hint) and found.hint.endswith(".jpeg")
    assert shape_of(Path(name), b"1,2") == found


def test_every_code_has_a_title() -> None:
    assert list(TITLES) == ["P0801", "P0802", "P0803", "P0804", "P0805"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_empty_files_are_malformed(suffix: str) -> None:
    assert mistake(f"a{suffix}", b"").code == "P0805"


def test_a_file_is_parsed_once() -> None:
    content = b"x,y\n1,2\n"
    first = values_of(Path("a.csv"), content)
    assert values_of(Path("elsewhere/b.csv"), bytes(bytearray(content))) is first
    assert values_of(Path("a.tsv"), content) is not first


def numbers(length: int) -> NumberArray:
    return NumberArray((length,), RealNumber(), array("d", bytes(8 * length)))


def test_what_is_kept_is_bounded() -> None:
    memory = Memory(numbers=10, files=3)
    memory.put("large", numbers(11))
    assert memory.get("large") is None
    for key in "abc":
        memory.put(key, numbers(3))
    assert memory.get("a") is not None  # used: so `b` is the longest unused
    memory.put("d", numbers(4))
    assert [key for key in "abcd" if memory.get(key) is not None] == ["a", "c", "d"]
    memory.put("d", numbers(10))
    assert [key for key in "abcd" if memory.get(key) is not None] == ["d"] and len(memory) == 1
    memory.clear()
    assert memory.get("d") is None


def test_shapes_are_found_without_numpy_and_pillow() -> None:
    code = """
import sys, io, zipfile, zlib, struct
from pathlib import Path
from potto.data import shape_of, values_of
head = "{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }\\n".encode()
npy = b"\\x93NUMPY\\x01\\x00" + struct.pack("<H", len(head)) + head + bytes(16)
file = io.BytesIO()
with zipfile.ZipFile(file, "w") as archive:
    archive.writestr("x.npy", npy)
def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
png = b"\\x89PNG\\r\\n\\x1a\\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 3, 2, 8, 2, 0, 0, 0))
png += chunk(b"IDAT", zlib.compress(bytes(20))) + chunk(b"IEND", b"")
files = {"a.csv": b"x\\n1", "a.json": b"[1]", "a.npy": npy, "a.npz": file.getvalue(), "a.png": png, "a.tsv": b"1"}
for name, content in files.items():
    print(shape_of(Path(name), content))
values_of(Path("a.csv"), files["a.csv"])
sys.exit("numpy" in sys.modules or "PIL" in sys.modules)
"""
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert told.returncode == 0 and "DataMistake" not in told.stdout, told.stdout + told.stderr
