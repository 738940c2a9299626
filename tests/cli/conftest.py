"""Commands run inside of this process, in a folder of their own."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from command_runs import Potto, Ran

from potto.__main__ import main


@pytest.fixture
def potto(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Potto:
    """`potto("check", "main.po", main="def f(t) t")`: keywords are files (`main_diffeo` is `main.diffeo`)."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str, stdin: str | None = None, **files: str) -> Ran:
        for name, text in files.items():
            stem, _, suffix = name.rpartition("_") if name.endswith("_diffeo") else (name, "", "po")
            (tmp_path / f"{stem}.{suffix}").write_bytes(text.encode())
        if stdin is not None:
            monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(stdin.encode()), encoding="utf-8"))
        capsys.readouterr()
        status = main(list(arguments))
        said = capsys.readouterr()
        assert "Traceback" not in said.out + said.err
        return Ran(status, said.out, said.err)

    return run
