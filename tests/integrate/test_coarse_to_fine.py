"""Asking for more digits never gives fewer: where the budget runs out, those of a looser tolerance are kept."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

RIDGE = """
def ridge(t)
    integral ([-10, 10], [-10, 10], [-10, 10])
        exp(-(x/0.0778 + y/0.13985 - z/0.1)^2/(2*(2*1.61/1.13)^2))*exp(-(x/t)^2/2) d(x, y, z)
"""
EXACT = 35.772954650781904284  # two of the variables by error functions, the third by mpmath


def asked(tmp_path: Path, *options: str) -> Any:
    file = tmp_path / "ridge.po"
    file.write_text(RIDGE)
    command = [sys.executable, "-m", "potto", "eval", str(file), "ridge(1)", "--json", *options]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)


@pytest.mark.slow
def test_a_ridge_in_space(tmp_path: Path) -> None:
    fine, loose = asked(tmp_path), asked(tmp_path, "--rtol", "1e-3")
    for answer in (fine, loose):
        assert abs(answer["value"] - EXACT) <= answer["error"]
    assert fine["error"] <= loose["error"] <= 1e-3 * EXACT
