"""What an earlier session has kept of a workspace is taken over as far as it is what a new one finds, whatever was
edited before, between and after them.

`make fuzz` tries more of them.
"""

from __future__ import annotations

import random
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import pytest
from edited_programs import WORKSPACE, edited
from how_many import examples

from potto.checking.check import diagnostics
from potto.checking.kept import Keeper, KeptWorkspace, parts_of
from potto.checking.library import Library
from potto.elaborate import core
from potto.modules import names
from potto.types import interface

SCRIPTS = examples(30, 500)
FORGOTTEN = frozenset({"parsed", "head", "definition", "core", "_analyses", "layout", "interface", "texts", "called"})


def session(root: Path, texts: dict[str, str], rng: random.Random) -> Library:
    """A library of these texts, some of them in open editors and the others on disk."""
    made = Library([root])
    for name, text in texts.items():
        (root / name).write_text(text, newline="")
        if rng.random() < 0.5:
            made.put(str(root / name), text)
    return made


def edit(texts: dict[str, str], rng: random.Random) -> str:
    """Edit one of the texts, or take back all its edits."""
    name = rng.choice(list(texts))
    texts[name] = WORKSPACE[name] if rng.random() < 0.3 else edited(texts[name], rng)
    return name


def ask(library: Library, root: Path) -> dict[Hashable, Any]:
    """Diagnostics, interfaces and terms of all files."""
    found: dict[Hashable, Any] = {}
    for name in WORKSPACE:
        file = str(root / name)
        found[name] = library.diagnostics(file)
        for each in names(library.db, file):
            found[name, each] = interface(library.db, file, each), core(library.db, file, each).term
    return found


def edit_and_ask(library: Library, root: Path, texts: dict[str, str], rng: random.Random) -> None:
    for _ in range(rng.randrange(5)):
        name = edit(texts, rng)
        library.put(str(root / name), texts[name])
        if rng.random() < 0.7:
            ask(library, root)
        if rng.random() < 0.3:
            library.db.forget(lambda query, args: rng.random() < 0.5, FORGOTTEN)


def keep(library: Library, root: Path) -> None:
    keeper = Keeper(library.db, [str(root)])
    for name in WORKSPACE:
        for part in parts_of(library.db, str(root / name)):
            keeper.add(part)
    assert keeper.finish()


def taken(library: Library, root: Path) -> list[str]:
    kept = KeptWorkspace(library.db, [str(root)])
    found = list[str | None]()
    while kept.is_left:
        found.append(kept.take())
    return [file for file in found if file is not None]


def fresh(root: Path, texts: dict[str, str]) -> Library:
    made = Library([root])
    for name, text in texts.items():
        made.put(str(root / name), text)
    return made


def run_script(root: Path, seed: int) -> None:
    rng = random.Random(seed)
    texts = dict(WORKSPACE)
    earlier = session(root, texts, rng)
    edit_and_ask(earlier, root, texts, rng)
    keep(earlier, root)
    same = rng.random() < 0.2
    for _ in range(0 if same else rng.randrange(1, 4)):
        edit(texts, rng)
    later = session(root, texts, rng)
    files = taken(later, root)
    assert not same or len(files) == len(WORKSPACE)
    assert ask(later, root) == ask(fresh(root, texts), root), seed
    edit_and_ask(later, root, texts, rng)
    assert ask(later, root) == ask(fresh(root, texts), root), seed


@pytest.mark.parametrize("seed", range(20))
def test_what_was_kept_is_what_is_found(tmp_path: Path, seed: int) -> None:
    run_script(tmp_path, seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(1000, 1000 + SCRIPTS, 10))
def test_what_was_kept_is_what_is_found_for_long(tmp_path: Path, first: int) -> None:
    for seed in range(first, first + 10):
        run_script(tmp_path, seed)


def executed(library: Library, root: Path) -> dict[str, set[str]]:
    """The queries that checking all files runs, after what was kept is taken over; each with the files it is about."""
    found: dict[str, set[str]] = {}
    with library.db.recording() as events:
        taken(library, root)
        for name in WORKSPACE:
            diagnostics(library.db, str(root / name))
    for event in events:
        if event.kind == "executed":
            about = event.args[0][0].file if event.query == "_analyses" else str(event.args[0])  # type: ignore[index,attr-defined]
            found.setdefault(event.query, set()).add(Path(about).name)
    return found


def test_an_edit_between_sessions_is_checked_and_what_it_reaches(tmp_path: Path) -> None:
    rng = random.Random(0)
    keep(session(tmp_path, WORKSPACE, rng), tmp_path)
    assert "_analyses" not in executed(session(tmp_path, WORKSPACE, rng), tmp_path)
    body = {**WORKSPACE, "shapes.po": WORKSPACE["shapes.po"].replace("exp(-u)", "exp(-2*u)")}
    assert executed(session(tmp_path, body, rng), tmp_path)["_analyses"] == {"shapes.po"}
    signature = {**WORKSPACE, "shapes.po": WORKSPACE["shapes.po"].replace("smooth(u)", "smooth(u, v)")}
    assert executed(session(tmp_path, signature, rng), tmp_path)["_analyses"] >= {"shapes.po", "middle.po"}


def test_what_is_interrupted_by_an_edit_is_not_kept(tmp_path: Path) -> None:
    library = session(tmp_path, WORKSPACE, random.Random(0))
    keeper = Keeper(library.db, [str(tmp_path)])
    for name in WORKSPACE:
        for part in parts_of(library.db, str(tmp_path / name)):
            keeper.add(part)
        library.put(str(tmp_path / "main.po"), f"# {name}\n")
    assert not keeper.finish() and not taken(Library([tmp_path]), tmp_path)


def test_what_is_damaged_or_of_another_workspace_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cache, root = tmp_path / "cache", tmp_path / "root"
    root.mkdir()
    monkeypatch.setenv("POTTO_CACHE", str(cache))
    keep(session(root, WORKSPACE, random.Random(0)), root)
    assert len(taken(Library([root]), root)) == len(WORKSPACE)
    assert not taken(Library([root]), tmp_path)
    (entry,) = (cache / "store" / "workspaces").iterdir()
    whole = entry.read_bytes()
    for damaged in (b"", whole[:100], whole[: len(whole) // 2], whole[:-1], whole[:-1] + bytes([whole[-1] ^ 1])):
        entry.write_bytes(damaged)
        assert not taken(Library([root]), root)
    entry.write_bytes(whole)
    assert len(taken(Library([root]), root)) == len(WORKSPACE)
