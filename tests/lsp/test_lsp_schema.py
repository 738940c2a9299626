"""What the server sends, held against lsprotocol's classes of the protocol."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from lsp_client import Client
from lsprotocol import converters, types

Server = Callable[..., Client]
Uri = Callable[[str], str]
TEXT = "from a import g\ndef f(t, k)\n    w = g(t)*k\n    integral [0, 1] [x < w]*x d(x)\ndef h(t) f(t, 2)\n#> h(1)\n"
RICH: dict[str, Any] = {
    "textDocument": {
        "definition": {"linkSupport": True},
        "documentSymbol": {"hierarchicalDocumentSymbolSupport": True},
        "completion": {"completionItem": {"snippetSupport": True}},
        "publishDiagnostics": {"relatedInformation": True},
    },
    "workspace": {"workspaceEdit": {"documentChanges": True, "resourceOperations": ["rename"]}},
}
METHODS = [
    "hover", "completion", "signatureHelp", "definition", "declaration", "typeDefinition", "implementation",
    "references",
    "documentHighlight", "documentSymbol", "prepareCallHierarchy", "rename", "prepareRename", "codeAction", "codeLens",
    "inlayHint", "inlineValue", "semanticTokens/full", "semanticTokens/full/delta", "semanticTokens/range",
    "foldingRange", "selectionRange", "linkedEditingRange", "documentLink", "formatting", "rangeFormatting",
    "onTypeFormatting", "diagnostic",
]  # fmt: skip
CONVERTER = converters.get_converter()


def holds(method: str, answer: dict[str, Any]) -> None:
    CONVERTER.structure(answer, types.METHOD_TO_TYPES[method][1])


@pytest.mark.parametrize("capabilities", [RICH, {}], ids=["rich", "poor"])
def test_every_answer_is_of_its_class(server: Server, uri: Uri, capabilities: dict[str, Any]) -> None:
    client = server(capabilities, greet=False, a="def g(t) t\n", main=TEXT)
    client.start()
    holds("initialize", client.answer(1))
    client.open(uri("main"), TEXT)
    pushed = client.note("textDocument/publishDiagnostics", uri=uri("main"))
    CONVERTER.structure(pushed, types.PublishDiagnosticsParams)
    whole = {"start": {"line": 0, "character": 0}, "end": {"line": 6, "character": 0}}
    for method in METHODS:
        for line, character in ((0, 15), (2, 8), (3, 22), (4, 9)):
            position = {"line": line, "character": character}
            params = {
                "textDocument": {"uri": uri("main")}, "position": position, "positions": [position], "range": whole,
                "context": {"diagnostics": [], "includeDeclaration": True}, "newName": "other", "ch": "\n",
                "options": {}, "previousResultId": "none",
            }  # fmt: skip
            answer = client.answer(client.begin(f"textDocument/{method}", params))
            if "error" not in answer:
                holds(f"textDocument/{method}", answer)
            else:
                assert answer["error"]["code"] == -32803, answer
    for method, params in (("workspace/symbol", {"query": ""}), ("workspace/diagnostic", {"previousResultIds": []})):
        holds(method, client.answer(client.begin(method, params)))
