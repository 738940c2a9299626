"""Helper processes: what they find out is what is found in one process, and one that dies costs nothing."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from how_many import examples

from potto.checking.library import Library
from potto.crew import Crew, helpers_for, processes
from potto.crew import crew as crews
from potto.crew.crew import ENOUGH, ENOUGH_FOR_COPIES
from potto.modules import names
from potto.modules.texts import pieces
from potto.types import interface

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
LEAF = "def f(t)\n    t^2\n\ndef g(t)\n    f(t) + 1\n"
USER = "from leaf import f\n\ndef h(t)\n    f(t)*2\n"
MISSING = "def f(t)\n    missing\n"


@pytest.fixture(params=["copies", "new processes"], autouse=True)
def copies(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether helpers are copies of this process: where they can be, all holds for both kinds."""
    copied = request.param == "copies"
    if copied and sys.platform != "linux":
        pytest.skip("processes are copied on Linux alone")
    for module in (processes, crews):
        monkeypatch.setattr(module, "can_be_copied", lambda: copied)
    return copied


def programs(folder: Path) -> list[str]:
    return sorted(str(path) for suffix in ("po", "diffeo") for path in folder.rglob(f"*.{suffix}"))


def taken(crew: Crew) -> Iterator[str | None]:
    """All that the helpers of a crew have to say, until they have nothing to do any more or are gone."""
    while crew.expects or crew.has_found:
        if crew.has_found:
            yield crew.take()
        time.sleep(0.001)


def checked(library: Library, files: Sequence[str]) -> list[object]:
    found: list[object] = []
    for file in files:
        found.append(library.diagnostics(file))
        found += [(file, name, interface(library.db, file, name)) for name in names(library.db, file)]
    return found


def modules(folder: Path, count: int) -> list[str]:
    """A chain of modules with a warning in each."""
    for number in range(count):
        lines = [f"from m{number - 1} import f, unused"] if number else []
        name = f"f{number}" if number else "f"
        lines += [f"def {name}(t)", "    t^2", "", "def g(t)"]
        lines += [f"    integral [0, 1] [x < t] * f(x) d(x) + {name}(t)", "", "unused = 1", ""]
        (folder / f"m{number}.po").write_text("\n".join(lines))
    return [str(folder / f"m{number}.po") for number in range(count)]


def test_examples_are_checked_by_helpers_as_in_one_process() -> None:
    files = programs(EXAMPLES)
    library = Library([EXAMPLES])
    with Crew(library.db, library.files.roots, files, 2) as helped:
        assert sorted(filter(None, taken(helped))) == files
    with library.db.recording() as events:
        found = checked(library, files)
    assert not any(event.query in ("_analyses", "parsed") for event in events if event.kind == "executed")
    assert found == checked(Library([EXAMPLES]), files)


def test_after_helpers_an_edit_runs_as_little_as_ever(tmp_path: Path) -> None:
    (tmp_path / "leaf.po").write_text(LEAF)
    (tmp_path / "user.po").write_text(USER)
    files = programs(tmp_path)
    library = Library([tmp_path])
    with Crew(library.db, library.files.roots, files, 1) as helped:
        assert len(list(filter(None, taken(helped)))) == 2
    library.put(files[0], LEAF.replace("t^2", "t^3"))
    with library.db.recording() as events:
        assert [library.diagnostics(file) for file in files] == [(), ()]
    analysed = [event.args for event in events if event.query == "_analyses" and event.kind == "executed"]
    assert [[target.name for target in group] for (group,) in analysed] == [["f"]]
    library.put(files[0], LEAF.replace("f(t)", "k(t)"))
    assert library.errors(files[1])


def test_a_text_that_is_edited_meanwhile_is_checked_as_it_is_now(tmp_path: Path) -> None:
    files = modules(tmp_path, 12)
    library = Library([tmp_path])
    with Crew(library.db, library.files.roots, files, 1) as helped:
        for turn, _ in enumerate(taken(helped)):
            library.put(files[0], f"def f(t)\n    wrong{turn}\n\nunused = 1\n")
    fresh = Library([tmp_path])
    fresh.put(files[0], library.source(files[0]).text)  # type: ignore[union-attr]
    assert checked(library, files) == checked(fresh, files)


def test_texts_of_open_files_count(tmp_path: Path) -> None:
    files = modules(tmp_path, 3)
    library = Library([tmp_path])
    library.put(files[0], MISSING)
    with Crew(library.db, library.files.roots, files, 1, {files[0]: MISSING}) as helped:
        assert sorted(filter(None, taken(helped))) == files
    fresh = Library([tmp_path])
    fresh.put(files[0], MISSING)
    assert checked(library, files) == checked(fresh, files)


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_helper_that_dies_or_hangs_costs_nothing_but_time(tmp_path: Path) -> None:
    files = modules(tmp_path, 20)
    library = Library([tmp_path])
    crew = Crew(library.db, library.files.roots, files, 2)
    dead, hanging = crew.processes
    os.kill(dead, signal.SIGKILL)
    os.kill(hanging, signal.SIGSTOP)
    found = checked(library, files)  # nothing waits
    crew.close()
    assert not crew.processes
    assert found == checked(Library([tmp_path]), files)


def test_a_helper_that_does_not_start_costs_nothing_but_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, copies: bool
) -> None:
    files = modules(tmp_path, 3)
    if copies:
        monkeypatch.setattr(os, "fork", no_process)
    else:
        monkeypatch.setattr(sys, "executable", str(tmp_path / "no such python"))
    library = Library([tmp_path])
    with Crew(library.db, library.files.roots, files, 1) as helped:
        assert not helped.processes
        assert list(taken(helped)) == []
    assert checked(library, files) == checked(Library([tmp_path]), files)


def no_process() -> int:
    raise BlockingIOError("as many processes run as may")


def test_helpers_end_with_who_has_started_them(tmp_path: Path) -> None:
    files = modules(tmp_path, 3)
    library = Library([tmp_path])
    with Crew(library.db, library.files.roots, files, 1) as helped:
        (process,) = helped.processes
        list(taken(helped))
    assert not helped.processes
    if sys.platform == "linux":
        assert not Path(f"/proc/{process}").exists()


def test_helpers_are_asked_only_if_there_is_enough_to_do(tmp_path: Path, copies: bool) -> None:
    enough = ENOUGH_FOR_COPIES if copies else ENOUGH
    files = modules(tmp_path, 3)
    assert helpers_for(files, processors=8) == 0
    large = tmp_path / "large.po"
    large.write_text("#" * (3 * enough))
    assert helpers_for([str(large)], processors=8) == 3
    assert helpers_for([str(large)], processors=2) == 1
    assert helpers_for([str(large)], processors=1) == 0
    assert helpers_for([str(tmp_path / "missing.po")], processors=8) == 0
    assert helpers_for([], 2 * enough, processors=8) == 2


def test_pieces_of_a_file_are_checked_before_whole_files_from_its_end(tmp_path: Path) -> None:
    files = modules(tmp_path, 2)
    text = "".join(f"def h{n}(t)\n    integral [0, 1] [x < t + {n}] * wrong{n % 7 or ''} d(x)\n\n" for n in range(200))
    library, alone, large = Library([tmp_path]), Library([tmp_path]), str(tmp_path / "large.po")
    library.put(large, text)
    alone.put(large, text)
    parts = pieces(library.db, large)
    assert len(parts) > 5
    with Crew(
        library.db, library.files.roots, files, 1, {large: text}, [(large, part) for part in parts[3:]]
    ) as helped:
        assert list(taken(helped)) == [None] * len(parts[3:]) + files[::-1]
    with library.db.recording() as events:
        assert library.diagnostics(large) == alone.diagnostics(large) != ()
    here = [event.args[1] for event in events if event.query == "definition_diagnostics" and event.kind == "executed"]
    last = "".join(parts[3:])
    assert here and not any(f"def {name}(" in last for name in here)
    read = [event.args[0] for event in events if event.query == "parsed" and event.kind == "executed"]
    assert read and not any(text in last for text in read)


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
def test_a_copy_holds_nothing_open_of_the_process_that_it_was_made_of(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    library = Library([tmp_path])
    with Crew(library.db, library.files.roots, modules(tmp_path, 3), 2) as helped:
        os.close(writer)
        assert os.read(reader, 1) == b""  # the end: no helper could write there
        assert len(list(taken(helped))) == 3
    os.close(reader)


@pytest.mark.slow
def test_a_large_workspace_is_checked_by_helpers_as_in_one_process(tmp_path: Path) -> None:
    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        from lsp_workspace import workspace
    finally:
        sys.path.pop(0)
    for name, text in workspace().items():
        (tmp_path / f"{name}.po").write_text(text)
    files = programs(tmp_path)[:: examples(4, 1)]
    library, alone = Library([tmp_path]), Library([tmp_path])
    with Crew(library.db, library.files.roots, files, 2) as helped:
        assert sorted(filter(None, taken(helped))) == files
    assert checked(library, files) == checked(alone, files)
    leaf = str(tmp_path / "m0.po")
    text = Path(leaf).read_text()
    for edited in (text.replace("def f1(t, k)", "def f1(t)"), text.replace("t", "u"), text):
        library.put(leaf, edited)
        alone.put(leaf, edited)
        assert checked(library, files) == checked(alone, files)
