"""A stranger's first hours: transcripts of a shell and of Python on `docs/hour-*.md`, run as they stand.

A block of `console` is a transcript: `$` before a command, `>` before a further line of it, `>>>` and `...` in Python.
`...` in an answer stands for anything. `make hours` runs them in a fresh clone with an environment of its own.
"""

from __future__ import annotations

import doctest
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from msgspec import Struct

DOCS = Path(__file__).resolve().parents[2] / "docs"
NEEDED = {"hour-jax.md": ("jax", "optax"), "hour-torch.md": ("torch",), "hour-scipy.md": ()}
_SAID = doctest.OutputChecker()


class Step(Struct, frozen=True):
    """What is typed, and what is answered; in Python or in a shell."""

    typed: str
    answered: str
    python: bool


def steps(text: str) -> Iterator[Step]:
    """A command or a statement at a time. To start Python is no step."""
    for block in re.findall(r"(?m)^```console\n(.*?)^```", text, re.DOTALL):
        for piece in re.split(r"(?m)^(?=\$ |>>> )", block):
            lines = piece.splitlines(keepends=True)
            python = piece.startswith(">>> ")
            more = ("...",) if python else (">",)
            count = 1 + next((n for n, line in enumerate(lines[1:]) if not line.startswith(more)), len(lines) - 1)
            typed = "".join(line[4:] or "\n" if python else line[2:] or "\n" for line in lines[:count])
            if piece.strip() and typed != "python\n":
                yield Step(typed, "".join(lines[count:]), python)


def in_a_shell(typed: str, folder: Path, path: str) -> str:
    done = subprocess.run(
        ["sh", "-c", typed], cwd=folder, env={**os.environ, "PATH": path, "COLUMNS": "200"},
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300,
    )  # fmt: skip
    return re.sub(r"(?m)^step \d+: .*\n", "", done.stdout)  # progress, told where it takes its time


@pytest.fixture
def path(tmp_path: Path) -> str:
    """Where the shell finds this Potto, whatever else is installed."""
    (tmp_path / "bin").mkdir()
    command = tmp_path / "bin" / "potto"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m potto "$@"\n')
    command.chmod(0o755)
    return f"{command.parent}{os.pathsep}{os.environ['PATH']}"


@pytest.mark.skipif(os.name != "posix", reason="the transcripts are those of a POSIX shell")
@pytest.mark.parametrize("page", NEEDED)
def test_an_hour(page: str, tmp_path: Path, path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for library in NEEDED[page]:
        pytest.importorskip(library, reason=f"{library} is not installed: `make test-bridges` runs this")
    folder = tmp_path / "work"
    folder.mkdir()
    monkeypatch.chdir(folder)
    names: dict[str, object] = {"__name__": "__main__"}
    runner = doctest.DocTestRunner(_SAID, verbose=False, optionflags=doctest.ELLIPSIS)
    tried = 0
    for number, step in enumerate(steps((DOCS / page).read_text("utf-8"))):
        tried += 1
        if step.python:
            example = doctest.Example(step.typed, step.answered)
            told: list[str] = []
            test = doctest.DocTest([example], {}, f"{page}, step {number}", page, 0, None)
            test.globs = names  # not a copy of them
            assert not runner.run(test, out=told.append, clear_globs=False).failed, "".join(told)
        else:
            said = in_a_shell(step.typed, folder, path)
            assert _SAID.check_output(step.answered, said, doctest.ELLIPSIS), f"$ {step.typed}{said}"
    assert tried > 10


def test_every_hour_is_run() -> None:
    assert {page.name for page in DOCS.glob("hour-*.md")} == set(NEEDED)
