"""`textDocument/inlayHint` with the values of live expressions among them, `inlineValue`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from potto import ide
from potto.ide.display.inlay_hints import piece_hints
from potto.query import Database, query
from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.features.by_piece import PieceItems, lined, part_of, sent
from potto_lsp.text import DocumentText, Encoding
from potto_lsp.wire import Encoded

KINDS = {"type": 1, "parameter": 2}
SETTINGS = {"type": "hints.types", "parameter": "hints.coordinates"}


def inlay_hints(ask: Ask) -> Encoded:
    span, text, found = ask.span, ask.text, list[bytes]()
    off = frozenset(kind for kind, setting in SETTINGS.items() if ask.analysis.settings.get(setting) is False)
    for at, line in lined(ask):
        if span.start <= at.start and at.start + len(at.text) <= span.end:
            found.append(_part(ask.db, ask.file, at.text, at.hidden, text.encoding, off).placed(line))
        elif at.start <= span.end and span.start <= at.start + len(at.text):
            hints = piece_hints(ask.db, ask.file, at.text, at.hidden)
            near = [hint for hint in hints if span.start <= at.start + hint.offset <= span.end and hint.kind not in off]
            found.append(part_of(_hint(DocumentText(at.text, text.encoding), hint) for hint in near).placed(line))
    found.append(sent(_live(ask, span)))
    return Encoded(found)


@query(keep=1024)
def _part(
    db: Database, file: str, text: str, hidden: tuple[str, ...], encoding: Encoding, off: frozenset[str]
) -> PieceItems:
    """The hints of a piece."""
    place, hints = DocumentText(text, encoding), piece_hints(db, file, text, hidden)
    return part_of(_hint(place, hint) for hint in hints if hint.kind not in off)


def _hint(text: DocumentText, hint: ide.InlayHint) -> protocol.InlayHint:
    found: protocol.InlayHint = {
        "position": convert.position(text, hint.offset),
        "label": hint.label,
        "kind": KINDS[hint.kind],
        "paddingLeft": hint.pad_left,
        "paddingRight": hint.pad_right,
    }
    if hint.tooltip:
        found["tooltip"] = convert.markdown(hint.tooltip)
    if hint.edits:
        found["textEdits"] = convert.text_edits(text, hint.edits)
    if hint.data:
        found["data"] = list(hint.data)
    return found


def _live(ask: Ask, span: Span) -> list[protocol.InlayHint]:
    """The known values, behind their expressions."""
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
