"""`textDocument/prepareCallHierarchy`, `callHierarchy/incomingCalls`, `outgoingCalls`: who calls whom."""

from __future__ import annotations

from typing import Any

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.failures import InvalidParams
from potto_lsp.features.outlines import KINDS


def prepare(ask: Ask) -> list[protocol.CallHierarchyItem] | None:
    found = ide.prepare_call_hierarchy(ask.db, ask.file, ask.offset)
    return None if found is None else [_item(ask, found)]


def incoming(ask: Ask) -> list[dict[str, Any]]:
    calls = ide.incoming_calls(ask.db, *_asked(ask))
    return [
        {"from": _item(ask, call.item), "fromRanges": _ranges(ask, call.item.location.file, call)} for call in calls
    ]


def outgoing(ask: Ask) -> list[dict[str, Any]]:
    file, name = _asked(ask)
    calls = ide.outgoing_calls(ask.db, file, name)
    return [{"to": _item(ask, call.item), "fromRanges": _ranges(ask, file, call)} for call in calls]


def _item(ask: Ask, item: ide.CallItem) -> protocol.CallHierarchyItem:
    text = ask.analysis.text(item.location.file)
    return {
        "name": item.name,
        "kind": KINDS[item.kind],
        "detail": item.detail,
        "uri": ask.analysis.uri(item.location.file),
        "range": convert.range_of(text, item.location.full),
        "selectionRange": convert.range_of(text, item.location.span),
        "data": list(item.data),
    }


def _ranges(ask: Ask, caller: str, call: ide.HierarchyCall) -> list[protocol.Range]:
    text = ask.analysis.text(caller)
    return [convert.range_of(text, span) for span in call.spans]


def _asked(ask: Ask) -> tuple[str, str]:
    """The file and the name in the `data` of one of our items."""
    data = ask.optional("item", "data")
    if not isinstance(data, list) or len(data) != 2 or not all(isinstance(part, str) for part in data):
        raise InvalidParams("`item.data` is not as it was given")
    return data[0], data[1]
