"""Every request about a place, all along every example, through a real server: never an internal error.

The features themselves are asked more often by `tests/ide/test_every_offset.py`, at a fraction of the cost; `make fuzz`
asks at every offset.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from how_many import examples
from lsp_client import Client
from lsp_sessions import capabilities_of
from potto_lsp.features import FEATURES

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FILES = sorted(path for suffix in ("po", "diffeo") for path in EXAMPLES.rglob(f"*.{suffix}"))
FOLDERS = sorted({path.parent.name for path in FILES})
# What is asked of a whole file, whatever the place: once a line is enough.
ABOUT_FILES = {
    f"textDocument/{name}"
    for name in ("documentSymbol", "codeLens", "semanticTokens/full", "semanticTokens/full/delta", "foldingRange",
                 "documentLink", "formatting", "diagnostic")
}  # fmt: skip
QUESTIONS = [method for method in FEATURES if method.startswith("textDocument/")]
RESOLVED = {
    "textDocument/completion": "completionItem/resolve",
    "textDocument/codeAction": "codeAction/resolve",
    "textDocument/codeLens": "codeLens/resolve",
    "textDocument/inlayHint": "inlayHint/resolve",
}


def ask_at(client: Client, uri: str, line: int, character: int) -> None:
    """Every question about one place, and one of the things that each brought resolved."""
    position = {"line": line, "character": character}
    params = {
        "textDocument": {"uri": uri}, "position": position, "positions": [position], "newName": "another_name",
        "range": {"start": position, "end": {"line": line + 2, "character": 0}}, "ch": "\n", "options": {},
        "context": {"diagnostics": [], "includeDeclaration": True},
    }  # fmt: skip
    begun = {method: client.begin(method, params) for method in QUESTIONS if method not in ABOUT_FILES or not character}
    for method, id in begun.items():
        answer = client.answer(id, 60)
        assert answer.get("error", {}).get("code") in (None, -32803), (method, position, answer)
        resolve(client, method, answer.get("result"))
    prepared: Any = client.answers[begun["textDocument/prepareCallHierarchy"]][0]["result"]
    for item in prepared or ():
        client.ask("callHierarchy/incomingCalls", {"item": item})
        client.ask("callHierarchy/outgoingCalls", {"item": item})


def resolve(client: Client, method: str, result: Any) -> None:
    items = result.get("items", []) if isinstance(result, dict) else result
    if method in RESOLVED and items:
        client.ask(RESOLVED[method], items[len(items) // 2])


def at_offsets(paths: list[Path], step: int) -> None:
    client = Client(EXAMPLES, capabilities_of("vscode"))
    client.start()
    for path in paths:
        text = path.read_text(encoding="utf-8")
        client.open(path.as_uri(), text)
        for offset in range(0, len(text) + 1, step):
            before = text[:offset]
            ask_at(client, path.as_uri(), before.count("\n"), len(before) - before.rfind("\n") - 1)
    assert client.stop() == 0
    assert b"Traceback" not in client.stderr


def test_at_some_offsets() -> None:
    at_offsets([path for path in FILES if path.name in ("renderer.po", "half_plane.diffeo", "shortfall.po")], 29)


@pytest.mark.slow
@pytest.mark.parametrize("folder", FOLDERS)
def test_at_offsets_of_every_example(folder: str) -> None:
    at_offsets([path for path in FILES if path.parent.name == folder], examples(1999, 1))
