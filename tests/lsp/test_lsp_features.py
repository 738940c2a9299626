"""Each feature once through a real server: what `potto.ide` finds arrives in the client's terms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from lsp_client import Client

Server = Callable[..., Client]
Uri = Callable[[str], str]
TEXT = """\
# how bright
import shapes
from shapes import half
def f(t, k)
    width = half(t)*k
    integral [0, 1] [x < width]*x d(x)
def g(t)
    f(t, 2) + f(k=1, t)
    + shapes.half(3)
"""
SHAPES = "# a half of it\ndef half(t)\n    t/2\n"
RICH: dict[str, Any] = {
    "textDocument": {
        "definition": {"linkSupport": True},
        "documentSymbol": {"hierarchicalDocumentSymbolSupport": True},
        "completion": {"completionItem": {"snippetSupport": True}},
    },
    "workspace": {"workspaceEdit": {"documentChanges": True, "resourceOperations": ["rename"]}},
}


@pytest.fixture
def client(server: Server, uri: Uri) -> Client:
    made = server(RICH, shapes=SHAPES, main=TEXT)
    made.open(uri("main"), TEXT)
    return made


def at(uri: str, line: int, character: int) -> dict[str, Any]:
    return {"textDocument": {"uri": uri}, "position": {"line": line, "character": character}}


def whole(uri: str) -> dict[str, Any]:
    span = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
    return {"textDocument": {"uri": uri}, "range": span}


def cut(range: dict[str, Any], text: str = TEXT) -> str:
    """What a range of a text of single-unit characters on one line covers."""
    start, end = range["start"], range["end"]
    assert start["line"] == end["line"]
    return text.splitlines()[start["line"]][start["character"] : end["character"]]


def test_hover(client: Client, uri: Uri) -> None:
    found = client.ask("textDocument/hover", at(uri("main"), 7, 4))
    assert found["contents"]["kind"] == "markdown" and "f" in found["contents"]["value"]
    assert cut(found["range"]) == "f"


def test_definition_in_another_file(client: Client, uri: Uri) -> None:
    (found,) = client.ask("textDocument/definition", at(uri("main"), 4, 13))
    assert found["targetUri"] == uri("shapes")
    assert cut(found["targetSelectionRange"], SHAPES) == "half"
    assert cut(found["originSelectionRange"]) == "half"


@pytest.mark.parametrize("method", ["declaration", "typeDefinition", "implementation"])
def test_other_ways_to_go(client: Client, uri: Uri, method: str) -> None:
    found = client.ask(f"textDocument/{method}", at(uri("main"), 4, 13))
    assert found is None or isinstance(found, list)


def test_references_and_highlights(client: Client, uri: Uri) -> None:
    params = {**at(uri("shapes"), 1, 5), "context": {"includeDeclaration": True}}
    found = client.ask("textDocument/references", params)
    assert {place["uri"] for place in found} == {uri("main"), uri("shapes")} and len(found) == 4
    found = client.ask("textDocument/documentHighlight", at(uri("main"), 4, 5))
    assert {cut(item["range"]) for item in found} == {"width"} and len(found) == 2


def test_symbols(client: Client, uri: Uri) -> None:
    found = client.ask("textDocument/documentSymbol", {"textDocument": {"uri": uri("main")}})
    assert [symbol["name"] for symbol in found if symbol["kind"] == 12] == ["f", "g"]
    found = client.ask("workspace/symbol", {"query": "half"})
    assert [(s["name"], s["location"]["uri"]) for s in found] == [("half", uri("shapes"))]


def test_call_hierarchy(client: Client, uri: Uri) -> None:
    (item,) = client.ask("textDocument/prepareCallHierarchy", at(uri("main"), 3, 4))
    incoming = client.ask("callHierarchy/incomingCalls", {"item": item})
    assert [call["from"]["name"] for call in incoming] == ["g"] and len(incoming[0]["fromRanges"]) == 2
    outgoing = client.ask("callHierarchy/outgoingCalls", {"item": item})
    assert [call["to"]["name"] for call in outgoing] == ["half"]


def test_rename_reaches_other_files(client: Client, uri: Uri) -> None:
    found = client.ask("textDocument/prepareRename", at(uri("main"), 4, 13))
    assert found["placeholder"] == "half"
    change = client.ask("textDocument/rename", {**at(uri("main"), 4, 13), "newName": "part"})
    edited = {item["textDocument"]["uri"]: len(item["edits"]) for item in change["documentChanges"]}
    assert edited == {uri("main"): 3, uri("shapes"): 1}
    assert client.error("textDocument/rename", {**at(uri("main"), 4, 13), "newName": "not a name"}) == -32803


def test_a_module_is_renamed_with_its_file(client: Client, uri: Uri, server: Server) -> None:
    change = client.ask("textDocument/rename", {**at(uri("main"), 1, 9), "newName": "forms"})
    assert change["documentChanges"][-1] == {"kind": "rename", "oldUri": uri("shapes"), "newUri": uri("forms")}
    for capabilities in ({}, {"workspace": {"workspaceEdit": {"resourceOperations": ["rename"]}}}):  # as Neovim 0.7
        poor = server(capabilities)
        poor.open(uri("main"), TEXT)
        assert poor.error("textDocument/rename", {**at(uri("main"), 1, 9), "newName": "forms"}) == -32803


def test_files_that_are_renamed(client: Client, uri: Uri) -> None:
    files = [{"oldUri": uri("shapes"), "newUri": uri("forms")}]
    change = client.ask("workspace/willRenameFiles", {"files": files})
    texts = {edit["newText"] for item in change["documentChanges"] for edit in item["edits"]}
    assert texts and all("forms" in text for text in texts)


def test_completion_and_its_details(client: Client, uri: Uri) -> None:
    found = client.ask("textDocument/completion", at(uri("main"), 7, 5))
    item = next(item for item in found["items"] if item["label"] == "f")
    assert item["textEdit"]["newText"].startswith("f")
    resolved = client.ask("completionItem/resolve", item)
    assert "->" in str(resolved.get("detail", "")) + str(resolved.get("documentation", ""))


def test_a_client_without_snippets_is_proposed_plain_words(server: Server, uri: Uri) -> None:
    client = server({})
    client.open(uri("main"), "def f(t)\n    \n")
    items = {item["label"]: item for item in client.ask("textDocument/completion", at(uri("main"), 1, 4))["items"]}
    assert items["integral"]["textEdit"]["newText"] == "integral" and items["if"]["insertTextFormat"] == 1


def test_signature_help(client: Client, uri: Uri) -> None:
    found = client.ask("textDocument/signatureHelp", at(uri("main"), 7, 6))
    label = found["signatures"][0]["label"]
    first, second = found["signatures"][0]["parameters"]
    assert label[slice(*first["label"])].startswith("t") and label[slice(*second["label"])].startswith("k")


def test_code_actions(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), "def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\n")
    (said,) = client.note("textDocument/publishDiagnostics", uri=uri("main"))["diagnostics"]
    params = {"textDocument": {"uri": uri("main")}, "range": said["range"], "context": {"diagnostics": [said]}}
    for action in client.ask("textDocument/codeAction", params):
        resolved = client.ask("codeAction/resolve", action) if "edit" not in action else action
        assert "edit" in resolved or "disabled" in resolved or "command" in resolved


RECORDS = """\
record Camera(eye: Real, focal: Real)
front = Camera(eye=0, focal=2)
near = front with focal = 3
wide = front.fokal
"""


def test_fields_of_records(server: Server, uri: Uri) -> None:
    client = server(RICH, main=RECORDS)
    client.open(uri("main"), RECORDS)
    (said,) = client.note("textDocument/publishDiagnostics", uri=uri("main"))["diagnostics"]
    assert (said["code"], cut(said["range"], RECORDS)) == ("P0332", "fokal")
    params = {"textDocument": {"uri": uri("main")}, "range": said["range"], "context": {"diagnostics": [said]}}
    action = next(a for a in client.ask("textDocument/codeAction", params) if a["title"] == "Change to `focal`")
    action = action if "edit" in action else client.ask("codeAction/resolve", action)
    (change,) = action["edit"]["documentChanges"]
    assert [(cut(e["range"], RECORDS), e["newText"]) for e in change["edits"]] == [("fokal", "focal")]
    change = client.ask("textDocument/rename", {**at(uri("main"), 2, 20), "newName": "zoom"})
    (edited,) = change["documentChanges"]
    assert [cut(edit["range"], RECORDS) for edit in edited["edits"]] == ["focal"] * 3
    (target,) = client.ask("textDocument/definition", at(uri("main"), 2, 20))
    assert target["targetRange"]["start"]["line"] == 0
    items = client.ask("textDocument/completion", at(uri("main"), 2, 18))["items"]
    assert [item["label"] for item in items] == ["eye", "focal"]
    help = client.ask("textDocument/signatureHelp", at(uri("main"), 1, 22))
    assert help["signatures"][0]["label"].startswith("Camera(eye: Real*, focal: Real*)")
    (camera, *_) = client.ask("textDocument/documentSymbol", {"textDocument": {"uri": uri("main")}})
    assert camera["kind"] == 23 and [child["kind"] for child in camera["children"]] == [8, 8]


def test_lenses(client: Client, uri: Uri) -> None:
    found = client.ask("textDocument/codeLens", {"textDocument": {"uri": uri("main")}})
    done = [lens if "command" in lens else client.ask("codeLens/resolve", lens) for lens in found]
    assert {lens["command"]["command"] for lens in done} == {"potto.evaluate", "potto.more"}
    lines = [lens["range"]["start"]["line"] for lens in done]
    assert max(lines.count(line) for line in lines) == 2


@pytest.mark.parametrize(
    ("kind", "gone"),
    [("value", "evaluate"), ("more", "more"), ("run", "run")],
)
def test_a_kind_of_lens_can_be_turned_off(server: Server, uri: Uri, kind: str, gone: str) -> None:
    """And only that kind."""
    text = "def f(t)\n    t^2\nprint(f(1))\n#> 1 + 1\n"

    def titles(settings: dict[str, Any]) -> list[str]:
        client = server(main=text)
        client.tell("workspace/didChangeConfiguration", {"settings": {"potto": settings}})
        client.open(uri("main"), text)
        found = client.ask("textDocument/codeLens", {"textDocument": {"uri": uri("main")}})
        done = [lens if "command" in lens else client.ask("codeLens/resolve", lens) for lens in found]
        return sorted(lens["command"]["title"] for lens in done)

    every, fewer = titles({}), titles({"lenses": {kind: False}})
    assert any(gone in title for title in every)
    assert fewer == [title for title in every if gone not in title]


def test_hints(client: Client, uri: Uri) -> None:
    found = client.ask("textDocument/inlayHint", whole(uri("main")))
    assert any("Real" in hint["label"] for hint in found)
    resolved = client.ask("inlayHint/resolve", found[0])
    assert resolved["position"] == found[0]["position"]
    assert isinstance(client.ask("textDocument/inlineValue", {**whole(uri("main")), "context": {}}), list)


def test_hints_can_be_switched_off(client: Client, uri: Uri) -> None:
    assert client.ask("textDocument/inlayHint", whole(uri("main")))
    client.tell("workspace/didChangeConfiguration", {"settings": {"potto": {"hints": {"types": False}}}})
    assert client.ask("textDocument/inlayHint", whole(uri("main"))) == []


def test_semantic_tokens_whole_in_range_and_by_difference(client: Client, uri: Uri) -> None:
    document = {"textDocument": {"uri": uri("main")}}
    first = client.ask("textDocument/semanticTokens/full", document)
    assert first["data"] and len(first["data"]) % 5 == 0
    assert client.ask("textDocument/semanticTokens/range", whole(uri("main")))["data"] == first["data"]
    client.change(uri("main"), 2, {"text": TEXT.replace("x < width", "x < k")})
    delta = client.ask("textDocument/semanticTokens/full/delta", {**document, "previousResultId": first["resultId"]})
    data = first["data"]
    for edit in delta["edits"]:
        data[edit["start"] : edit["start"] + edit["deleteCount"]] = edit["data"]
    assert data == client.ask("textDocument/semanticTokens/full", document)["data"]
    unknown = client.ask("textDocument/semanticTokens/full/delta", {**document, "previousResultId": "?"})
    assert unknown["data"] == data


def test_pieces_of_the_text(client: Client, uri: Uri) -> None:
    folds = client.ask("textDocument/foldingRange", {"textDocument": {"uri": uri("main")}})
    assert {"startLine": 3, "endLine": 5} in [{k: f[k] for k in ("startLine", "endLine")} for f in folds]
    params = {"textDocument": {"uri": uri("main")}, "positions": [{"line": 4, "character": 13}]}
    (selection,) = client.ask("textDocument/selectionRange", params)
    assert cut(selection["range"]) == "half"
    lengths = 0
    while (selection := selection.get("parent")) is not None:
        lengths += 1
    assert lengths >= 2


def test_links_and_formatting(client: Client, uri: Uri) -> None:
    links = client.ask("textDocument/documentLink", {"textDocument": {"uri": uri("main")}})
    assert {link["target"] for link in links} == {uri("shapes")}
    options = {"tabSize": 4, "insertSpaces": True}
    found = client.ask("textDocument/formatting", {"textDocument": {"uri": uri("main")}, "options": options})
    assert isinstance(found, list)
    assert isinstance(client.ask("textDocument/rangeFormatting", {**whole(uri("main")), "options": options}), list)
    typed = {**at(uri("main"), 5, 0), "ch": "\n", "options": options}
    assert isinstance(client.ask("textDocument/onTypeFormatting", typed), list)
    linked = client.ask("textDocument/linkedEditingRange", at(uri("main"), 4, 5))
    assert linked is None or linked["ranges"]


def test_the_announced_legend_is_that_of_the_tokens() -> None:
    from potto_lsp import features

    from potto import ide

    assert features.TOKEN_TYPES == ide.TOKEN_TYPES and features.TOKEN_MODIFIERS == ide.TOKEN_MODIFIERS


def test_every_kind_has_a_number() -> None:
    from typing import get_args

    from potto_lsp.features import completing, outlines

    from potto.ide import model

    assert set(completing.KINDS) == set(get_args(model.CompletionKind))
    assert set(outlines.KINDS) == set(get_args(model.SymbolKind))
