"""`textDocument/completion`, `completionItem/resolve`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from msgspec.structs import replace

from potto import ide
from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask

KINDS = {
    "variable": 6, "parameter": 6, "constant": 21, "function": 3, "diffeo": 3, "module": 9, "keyword": 14,
    "snippet": 15, "builtin": 3, "measure": 7, "symbol": 1, "argument": 10, "type": 25, "command": 1, "field": 5,
    "record": 22, "file": 17,
}  # fmt: skip
PLAIN, SNIPPET = 1, 2
ITEM = "textDocument.completion.completionItem."


def complete(ask: Ask) -> protocol.CompletionList:
    typed = ask.optional("context", "triggerCharacter")
    found = ide.completions(ask.db, ask.file, ask.offset, typed if isinstance(typed, str) else "")
    can_snippet = ask.client.can(ITEM + "snippetSupport")
    waits = ask.client.lists(ITEM + "resolveSupport.properties", "additionalTextEdits")
    whole = found.items if waits else [_with_import(ask, item) for item in found.items]
    items = [_item(ask, item if can_snippet else _plain(item)) for item in whole]
    return {"isIncomplete": found.incomplete, "items": items}


def _with_import(ask: Ask, item: ide.Completion) -> ide.Completion:
    """For a client that cannot take edits later: include the import that a name needs."""
    return replace(item, edits=ide.resolve_completion(ask.db, item).edits) if item.data[:1] == ("import",) else item


def _plain(item: ide.Completion) -> ide.Completion:
    """For a client without snippets: the word alone."""
    return replace(item, snippet=False, insert=item.label) if item.snippet else item


def _item(ask: Ask, item: ide.Completion) -> protocol.CompletionItem:
    found: protocol.CompletionItem = {
        "label": item.label,
        "kind": KINDS[item.kind],
        "sortText": item.sort,
        "textEdit": {"range": ask.range(item.span), "newText": item.insert},
        "insertTextFormat": SNIPPET if item.snippet else PLAIN,
    }
    if item.filter and item.filter != item.label:
        found["filterText"] = item.filter
    if item.description:
        found["labelDetails"] = {"description": item.description}
    if item.retrigger:
        found["command"] = {"title": "propose", "command": "editor.action.triggerSuggest"}
    if item.data:
        found["data"] = {"uri": ask.uri, "item": [item.kind, *item.data]}
    _add_details(ask, found, item, ask.file)
    return found


def _add_details(ask: Ask, found: protocol.CompletionItem, item: ide.Completion, file: str) -> None:
    if item.detail:
        found["detail"] = item.detail
    if item.documentation:
        found["documentation"] = convert.markup(ask.client, ITEM + "documentationFormat", item.documentation)
    if item.edits:
        found["additionalTextEdits"] = convert.text_edits(ask.analysis.text(file), item.edits)


def resolve(ask: Ask) -> Any:
    from potto_lsp.uris import to_key

    uri, written = ask.optional("data", "uri"), ask.optional("data", "item")
    if not isinstance(ask.params, Mapping) or not isinstance(uri, str) or not isinstance(written, list):
        return ask.params
    label, (kind, *data) = str(ask.params.get("label", "")), written
    item = ide.Completion(label, kind, Span(0, 0), "", "", data=tuple(map(str, data)))
    found: Any = dict(ask.params)
    _add_details(ask, found, ide.resolve_completion(ask.db, item), to_key(uri))
    return found
