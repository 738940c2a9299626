"""Potto in Emacs with Eglot, as `editors/emacs/potto-mode.el` sets it up, against the real server."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path

import pytest
from editors_folder import EDITORS, Run

SESSION = Path(__file__).with_name("emacs.el")


def has_eglot() -> bool:
    if shutil.which("emacs") is None:
        return False
    asked = ["emacs", "--batch", "--eval", "(progn (package-initialize) (require 'eglot))"]
    return subprocess.run(asked, capture_output=True, timeout=60).returncode == 0


def test_a_session(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    if not has_eglot():
        pytest.skip("Emacs with Eglot is not installed")
    monkeypatch.setenv("POTTO_EDITORS", str(EDITORS))
    said = run("emacs", "--batch", "-l", str(SESSION))
    found = json.loads(said.partition("FOUND")[2].splitlines()[0])
    assert found["mode"] == "potto-mode"
    assert found["line"] == 3 and found["text"] == "x + c > 0.5" and "variable of integration" in found["message"]
    assert "cover : (r: Real) -> Real" in found["hover"]
    assert float(found["value"].split()[0]) == pytest.approx(math.pi / 16, rel=1e-8)  # a quarter of a disc
    assert "if [x + c > 0.5] then 1 else 0" in found["text-now"]
    keyword, function = "font-lock-keyword-face", "font-lock-function-name-face"
    assert found["faces"][:4] == [keyword, function, keyword, keyword]
    assert found["file"] == "font-lock-string-face"
    assert found["indented"] == "    x"


def test_the_mode_compiles_without_warnings(run: Run, folder: Path) -> None:
    copy = shutil.copy(EDITORS / "emacs" / "potto-mode.el", folder)
    run("emacs", "--batch", "--eval", "(setq byte-compile-error-on-warn t)", "-f", "batch-byte-compile", str(copy))
