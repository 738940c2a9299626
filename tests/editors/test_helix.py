"""Potto in Helix: its configuration."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

from editors_folder import EDITORS, Run

CONFIGURATION = tomllib.loads((EDITORS / "helix" / "languages.toml").read_text(encoding="utf-8"))


def test_the_configuration_names_the_server_and_the_files() -> None:
    (language,) = CONFIGURATION["language"]
    assert language["file-types"] == ["po", "diffeo"] and language["comment-token"] == "#"
    (server,) = language["language-servers"]
    assert CONFIGURATION["language-server"][server] == {"command": "potto", "args": ["lsp"]}


def test_helix_reads_it(run: Run, folder: Path) -> None:
    (folder / "helix").mkdir()
    shutil.copy(EDITORS / "helix" / "languages.toml", folder / "helix")
    said = run("hx", "--health", "potto")
    assert "potto" in said and "✓" in said
