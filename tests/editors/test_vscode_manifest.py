"""What the extension says of the language and of the server is what they say themselves."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from potto_lsp.features import COMMANDS, TOKEN_MODIFIERS, TOKEN_TYPES, hinting, lenses

from potto.modules.builtins import CONSTANTS, PROJECTIONS, SPECIALS
from potto.primitives import PRIMITIVES
from potto.syntax import RESERVED

EDITORS = Path(__file__).resolve().parents[2] / "editors"
VSCODE = EDITORS / "vscode"
BUILTINS = {name for name, primitive in PRIMITIVES.items() if primitive.surface}


def read(path: str) -> Any:
    return json.loads((VSCODE / path).read_text(encoding="utf-8"))


PACKAGE = read("package.json")
CONTRIBUTES = PACKAGE["contributes"]
SOURCES = "\n".join(path.read_text(encoding="utf-8") for path in sorted((VSCODE / "src").rglob("*.ts")))


def patterns(found: Any) -> list[str]:
    """All regular expressions of a grammar."""
    if isinstance(found, list):
        return [pattern for item in found for pattern in patterns(item)]
    if not isinstance(found, dict):
        return []
    own = [text for key, text in found.items() if key in ("match", "begin", "end") and isinstance(text, str)]
    return own + [pattern for item in found.values() for pattern in patterns(item)]


def test_the_grammar_knows_every_word_of_the_language() -> None:
    words = set(re.findall(r"\w+", " ".join(patterns(read("syntaxes/potto.tmLanguage.json")))))
    assert words >= RESERVED
    assert words >= BUILTINS | set(CONSTANTS) | set(SPECIALS) | set(PROJECTIONS)


@pytest.mark.parametrize("path", ["vim/syntax/potto.vim", "emacs/potto-mode.el"])
def test_the_other_grammars_know_every_word_too(path: str) -> None:
    words = set(re.findall(r"\w+", (EDITORS / path).read_text(encoding="utf-8")))
    assert words >= RESERVED | BUILTINS | set(CONSTANTS) | set(SPECIALS) | set(PROJECTIONS)


def test_the_files_that_are_named_exist() -> None:
    named = [
        CONTRIBUTES["languages"][0]["configuration"], *CONTRIBUTES["languages"][0]["icon"].values(), PACKAGE["icon"],
        *(grammar["path"] for grammar in CONTRIBUTES["grammars"]), *(s["path"] for s in CONTRIBUTES["snippets"]),
        *(step["media"]["markdown"] for step in CONTRIBUTES["walkthroughs"][0]["steps"]),
    ]  # fmt: skip
    assert [name for name in named if not (VSCODE / name).is_file()] == []


def test_every_command_is_registered_and_every_command_of_the_server_is_offered() -> None:
    registered = {f"potto.{name}" for name in re.findall(r'command\("(\w+)"', SOURCES)}
    offered = {command["command"] for command in CONTRIBUTES["commands"]}
    assert offered <= registered
    assert set(COMMANDS) <= offered
    written = json.dumps(CONTRIBUTES)
    used = set(re.findall(r'"command": "(potto\.\w+)"', written)) | set(re.findall(r"command:(potto\.\w+)", written))
    assert used <= registered


def test_settings_are_described_and_read() -> None:
    settings = CONTRIBUTES["configuration"]["properties"]
    assert all(setting.get("description") or setting.get("markdownDescription") for setting in settings.values())
    server = (EDITORS.parent / "docs" / "lsp.md").read_text(encoding="utf-8")
    for name in settings:
        short = name.removeprefix("potto.")
        assert f'"{short}"' in SOURCES or f"`{short}`" in server, name


def test_semantic_tokens_are_those_of_the_server() -> None:
    standard = {"declaration", "definition", "readonly", "defaultLibrary", "documentation"}
    assert {modifier["id"] for modifier in CONTRIBUTES["semanticTokenModifiers"]} == set(TOKEN_MODIFIERS) - standard
    for selector in CONTRIBUTES["semanticTokenScopes"][0]["scopes"]:
        type, _, modifier = selector.partition(".")
        assert type in TOKEN_TYPES and (not modifier or modifier in TOKEN_MODIFIERS), selector


def test_snippets_are_programs() -> None:
    """Each snippet, with its placeholders as they are proposed, is something that Potto reads."""
    from potto.syntax import parse_chunk, split

    for name, snippet in read("snippets/potto.json").items():
        text = "\n".join(snippet["body"]).replace("\\\\", "\x00")
        text = re.sub(r"\$\{\d+\|((?:\\,|[^,|])+)[^}]*\}", lambda m: m[1].replace("\\,", ","), text)
        for _ in range(2):
            seen = dict(re.findall(r"\$\{(\d+):([^{}$]*)\}", text))
            text = re.sub(r"\$\{(\d+):([^{}$]*)\}", lambda m: m[2], text)
            text = re.sub(r"\$(\d+)", lambda m, seen=seen: seen.get(m[1], ""), text)
        text = text.replace("\x00", "\\") + "\n"
        for chunk in split(text):
            found = parse_chunk(chunk.text, chunk.diffeo) if hasattr(chunk, "diffeo") else parse_chunk(chunk.text)
            assert not [d for d in found.diagnostics if d.severity == "error"], (name, text)


def test_the_lock_files_name_no_host() -> None:
    for path in (VSCODE / "package-lock.json", VSCODE / "e2e" / "package-lock.json"):
        assert '"resolved"' not in path.read_text(encoding="utf-8"), path


def test_nothing_that_is_built_is_kept() -> None:
    ignored = (EDITORS / ".gitignore").read_text(encoding="utf-8").split()
    assert {"node_modules/", "dist/", "*.vsix", "test-results/"} <= set(ignored)


def test_every_setting_of_the_server_can_be_set_and_is_explained() -> None:
    read_by_the_server = {*hinting.SETTINGS.values(), *lenses.SETTINGS.values()}
    sources = (EDITORS.parent / "lsp/potto_lsp").rglob("*.py")
    known = r'(?:settings\.get|_setting)\("([\w.]+)"'
    for source in sources:
        read_by_the_server |= set(re.findall(known, source.read_text(encoding="utf-8")))
    offered = {name.removeprefix("potto.") for name in CONTRIBUTES["configuration"]["properties"]}
    ours = {name for name in offered if name.partition(".")[0] in ("server", "trace", "preview")}
    assert offered - ours == read_by_the_server - {"potto"}  # what clients send may have that around it
    page = (EDITORS.parent / "docs/lsp.md").read_text(encoding="utf-8")
    assert [name for name in offered - ours if f"`{name}`" not in page] == []
