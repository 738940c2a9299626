"""Potto in Helix: its configuration."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from editors_folder import EDITORS, Run

# The keys that the manual of Helix has for languages.toml; it refuses a file with one that it does not know.
LANGUAGE = {
    "name", "language-id", "scope", "injection-regex", "file-types", "shebangs", "roots", "auto-format",
    "diagnostic-severity", "comment-token", "comment-tokens", "block-comment-tokens", "indent", "language-servers",
    "grammar", "formatter", "soft-wrap", "text-width", "rulers", "path-completion", "word-completion",
    "workspace-lsp-roots", "persistent-diagnostic-sources", "auto-pairs",
}  # fmt: skip
SERVER = {"command", "args", "config", "timeout", "environment", "required-root-patterns"}

CONFIGURATION = tomllib.loads((EDITORS / "helix" / "languages.toml").read_text(encoding="utf-8"))


def test_the_configuration_names_the_server_and_the_files() -> None:
    (language,) = CONFIGURATION["language"]
    assert language["file-types"] == ["po", "diffeo"] and language["comment-token"] == "#"
    (server,) = language["language-servers"]
    assert CONFIGURATION["language-server"][server] == {"command": "potto", "args": ["lsp"]}


def test_the_configuration_has_the_keys_and_kinds_that_helix_documents() -> None:
    """Helix itself is seldom there to ask (below)."""
    assert CONFIGURATION.keys() == {"language", "language-server"}
    (language,) = CONFIGURATION["language"]
    assert language.keys() <= LANGUAGE and language["name"] == "potto" and language["scope"].startswith("source.")
    assert language["indent"] == {"tab-width": 4, "unit": " " * 4}
    assert all(isinstance(key, str) and len(key) == len(value) == 1 for key, value in language["auto-pairs"].items())
    assert all(server.keys() <= SERVER for server in CONFIGURATION["language-server"].values())


def test_a_session_as_helix_speaks(folder: Path) -> None:
    """The server, started as the configuration says, counts in UTF-8 for a client that asks as Helix does."""
    server = CONFIGURATION["language-server"]["potto"]
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    command = [shutil.which(server["command"], path=path), *server["args"]]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=folder)  # type: ignore[arg-type]
    try:
        encodings = {"general": {"positionEncodings": ["utf-8", "utf-32", "utf-16"]}}
        params = {"processId": None, "rootUri": folder.as_uri(), "capabilities": encodings}
        assert process.stdin is not None and process.stdout is not None
        body = json.dumps({"jsonrpc": "2.0", "id": 0, "method": "initialize", "params": params}).encode()
        process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        process.stdin.flush()
        length = int(process.stdout.readline().split(b":")[1])
        while process.stdout.readline().strip():
            pass
        answer = json.loads(process.stdout.read(length))
        assert answer["result"]["capabilities"]["positionEncoding"] == "utf-8"
    finally:
        process.kill()
        process.communicate()


def test_helix_reads_it(run: Run, folder: Path) -> None:
    (folder / "helix").mkdir()
    shutil.copy(EDITORS / "helix" / "languages.toml", folder / "helix")
    said = run("hx", "--health", "potto")
    assert "potto" in said and "✓" in said
