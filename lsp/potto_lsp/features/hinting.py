"""`textDocument/inlayHint` with the values of live expressions among them, `inlineValue`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from potto import ide
from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask

KINDS = {"type": 1, "parameter": 2}
SETTINGS = {"type": "hints.types", "parameter": "hints.coordinates"}


def inlay_hints(ask: Ask) -> list[protocol.InlayHint]:
    span = ask.span
    off = {kind for kind, setting in SETTINGS.items() if ask.analysis.settings.get(setting) is False}
    hints = ide.inlay_hints(ask.db, ask.file, span)
    found = [_hint(ask, hint) for hint in hints if hint.kind not in off]
    return found + _live(ask, span)


def _hint(ask: Ask, hint: ide.InlayHint) -> protocol.InlayHint:
    found: protocol.InlayHint = {
        "position": ask.position(hint.offset),
        "label": hint.label,
        "kind": KINDS[hint.kind],
        "paddingLeft": hint.pad_left,
        "paddingRight": hint.pad_right,
    }
    if hint.tooltip:
        found["tooltip"] = convert.markdown(hint.tooltip)
    if hint.edits:
        found["textEdits"] = convert.text_edits(ask.text, hint.edits)
    if hint.data:
        found["data"] = list(hint.data)
    return found


def _live(ask: Ask, span: Span) -> list[protocol.InlayHint]:
    """The values that are known, behind their expressions."""
    found: list[protocol.InlayHint] = []
    for live, value in ask.session.live.values(ask.file):
        if value is not None and span.start <= live.span.end <= span.end:
            found.append({
                "position": ask.position(live.span.end),
                "label": value.label,
                "tooltip": convert.markdown(value.tooltip),
                "paddingLeft": True,
            })  # fmt: skip
    return found


def resolve(ask: Ask) -> Any:
    data = ask.optional("data")
    if not isinstance(ask.params, Mapping) or not isinstance(data, list) or not data:
        return ask.params
    hint = ide.resolve_inlay_hint(ask.db, ide.InlayHint(0, "", "type", data=tuple(map(str, data))))
    return {**ask.params, "tooltip": convert.markdown(hint.tooltip)} if hint.tooltip else ask.params


def inline_values(ask: Ask) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for value in ide.inline_values(ask.db, ask.file, ask.span):
        key = "expression" if value.kind == "expression" else "text"
        found.append({"range": ask.range(value.span), key: value.text})
    return found
