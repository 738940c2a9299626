"""What of a folder is listed as programs: not what tools, translators and machines have put there."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from potto.modules import Files, find_module, names
from potto.modules import folders as module
from potto.modules.folders import Programs, is_translation
from potto.query import Database

TRANSLATION = """# German.
# Copyright (C) 2024
#
msgid ""
msgstr "Content-Type: text/plain; charset=UTF-8\\n"

#: src/main.c:12
msgid "File"
msgstr "Datei"
"""


def listed(folder: Path) -> list[str]:
    return sorted(os.path.relpath(path, folder) for path in Programs().under([str(folder)]))


def write(folder: Path, **texts: str) -> None:
    for name, text in texts.items():
        path = folder / (name.replace("__", "/") + ".po")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def test_translations_are_no_programs(tmp_path: Path) -> None:
    write(tmp_path, de=TRANSLATION, a="def f(x) x\n", context='msgctxt "menu"\nmsgid "a"\nmsgstr "b"\n')
    write(tmp_path, about="# a program about msgid\ndef msgid(x) x\nprint(msgid(1))\n")
    assert listed(tmp_path) == ["a.po", "about.po"]
    assert is_translation(str(tmp_path / "de.po"))


def test_a_file_that_becomes_a_program_is_listed(tmp_path: Path) -> None:
    write(tmp_path, a=TRANSLATION)
    files = Files(Database(), [tmp_path])
    assert files.all_files() == ()
    write(tmp_path, a="def f(x) x\n")
    files.refresh()
    assert files.all_files() == (str(tmp_path / "a.po"),)


def test_folders_of_tools_are_passed_by(tmp_path: Path) -> None:
    write(tmp_path, a="", src__b="", node_modules__c="", venv__lib__d="", build__e="", locale__de__LC_MESSAGES__f="")
    write(tmp_path / ".git", g="")
    assert listed(tmp_path) == ["a.po", "src/b.po"]


def test_a_root_is_looked_into_whatever_it_is_called(tmp_path: Path) -> None:
    write(tmp_path, build__a="")
    assert listed(tmp_path / "build") == ["a.po"]


def test_what_is_too_large_is_not_listed_but_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_FILE_BYTES", 1000)
    write(tmp_path, small="from large import f\n", large="def f(x) x\n" + "# more\n" * 200)
    files = Files(Database(), [tmp_path])
    assert files.all_files() == (str(tmp_path / "small.po"),)
    target = find_module(files.db, str(tmp_path / "small.po"), "large")
    assert target is not None and names(files.db, target) == ("f",)


def test_what_is_open_is_listed_whatever_it_is(tmp_path: Path) -> None:
    write(tmp_path, node_modules__a="def f(x) x\n", de=TRANSLATION)
    files = Files(Database(), [tmp_path])
    files.set_text(str(tmp_path / "de.po"), "def g(x) x\n")
    files.set_text(str(tmp_path / "node_modules/a.po"), "def f(x) x\n")
    assert files.all_files() == (str(tmp_path / "de.po"), str(tmp_path / "node_modules/a.po"))


def test_the_bytes_of_all_are_bounded_the_nearest_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_TOTAL_BYTES", 250)
    write(tmp_path, deep__er__c="#" * 100, a="#" * 100, deep__b="#" * 100, z="#" * 60)
    assert listed(tmp_path) == ["a.po", "z.po"]
    monkeypatch.setattr(module, "MAX_TOTAL_BYTES", 300)
    assert listed(tmp_path) == ["a.po", "deep/b.po", "z.po"]


def test_files_and_folders_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, **{f"f{n}__a": "" for n in range(20)}, **{f"g{n}": "" for n in range(20)})
    monkeypatch.setattr(module, "MAX_FOLDERS", 3)
    assert len(listed(tmp_path)) == 22
    monkeypatch.setattr(module, "MAX_FILES", 7)
    assert len(listed(tmp_path)) == 7


def test_a_loop_of_links_and_a_folder_called_like_a_program(tmp_path: Path) -> None:
    write(tmp_path, pkg__a="")
    (tmp_path / "pkg/back").symlink_to(tmp_path)
    (tmp_path / "odd.po").mkdir()
    (tmp_path / "dangling.po").symlink_to(tmp_path / "nowhere")
    assert listed(tmp_path) == ["pkg/a.po"]
