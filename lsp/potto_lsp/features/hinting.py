"""`textDocument/inlayHint` with the values of live expressions among them, `inlineValue`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from potto import ide
from potto.ide.display.inlay_hints import piece_hints
from potto.ide.display.inline_values import piece_values
from potto.ide.names.places import PieceAt
from potto.query import Database, query
from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.features.by_piece import PieceItems, part_of, sent, touching
from potto_lsp.text import DocumentText, Encoding
from potto_lsp.wire import Encoded

KINDS = {"type": 1, "parameter": 2}
SETTINGS = {"type": "hints.types", "parameter": "hints.coordinates"}


def inlay_hints(ask: Ask) -> Encoded:
    encoding = ask.text.encoding
    off = frozenset(kind for kind, setting in SETTINGS.items() if ask.analysis.settings.get(setting) is False)

    def part(at: PieceAt) -> PieceItems:
        return _part(ask.db, ask.file, at.text, at.hidden, encoding, off)

    def near(at: PieceAt, span: Span) -> Iterator[protocol.InlayHint]:
        text = DocumentText(at.text, encoding)
        for hint in piece_hints(ask.db, ask.file, at.text, at.hidden):
            if span.start <= hint.offset <= span.end and hint.kind not in off:
                yield _hint(text, hint)

    return Encoded([*touching(ask, part, near), sent(_live(ask, ask.span))])


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


def inline_values(ask: Ask) -> Encoded:
    encoding = ask.text.encoding

    def near(at: PieceAt, span: Span) -> Iterator[dict[str, Any]]:
        text = DocumentText(at.text, encoding)
        values = piece_values(ask.db, ask.file, at.text, at.hidden)
        return (_value(text, value) for value in values if value.span.touches(span))

    return Encoded(touching(ask, lambda at: _values(ask.db, ask.file, at.text, at.hidden, encoding), near))


@query(keep=1024)
def _values(db: Database, file: str, text: str, hidden: tuple[str, ...], encoding: Encoding) -> PieceItems:
    """The inline values of a piece."""
    place = DocumentText(text, encoding)
    return part_of(_value(place, value) for value in piece_values(db, file, text, hidden))


def _value(text: DocumentText, value: ide.InlineValue) -> dict[str, Any]:
    key = "expression" if value.kind == "expression" else "text"
    return {"range": convert.range_of(text, value.span), key: value.text}
