"""A folder with programs, and editors without a screen that find Potto on their PATH."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from editors_folder import Run

MAIN = """from shapes import disc
def shade(c)
    integral [0, 1] (if x + c > 0.5 then 1 else 0) d(x)
def cover(r) integral ([0, 1], [0, 1]) disc(x, y, r) d(x, y)
"""
SHAPES = "def disc(x, y, r) [x^2 + y^2 < r^2]\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "main.po").write_text(MAIN, encoding="utf-8")
    (tmp_path / "shapes.po").write_text(SHAPES, encoding="utf-8")
    (tmp_path / "potto.toml").write_text("", encoding="utf-8")
    return tmp_path


@pytest.fixture
def run(folder: Path) -> Run:
    """`run("nvim", …)`: what an editor says; the test is skipped where it is not installed."""

    def call(*command: str, seconds: float = 60) -> str:
        if shutil.which(command[0]) is None:
            pytest.skip(f"{command[0]} is not installed")
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        env = {**os.environ, "PATH": path, "HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "TERM": "dumb"}
        done = subprocess.run(
            command, cwd=folder, env=env, capture_output=True, text=True, timeout=seconds, stdin=subprocess.DEVNULL
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    return call
