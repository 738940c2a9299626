"""`textDocument/hover`: what is known in symbols, and values where live expressions give some."""

from __future__ import annotations

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.live import shown

FORMATS = "textDocument.hover.contentFormat"


def hover(ask: Ask) -> protocol.Hover | None:
    offset = ask.offset
    found = ide.hover_at(ask.db, ask.file, offset)
    if found is None:
        return _live(ask, offset)
    values = _values(ask, offset)
    markdown = f"{found.markdown}\n\n**values**\n\n{values}" if values else found.markdown
    return {"contents": convert.markup(ask.client, FORMATS, markdown), "range": ask.range(found.span)}


def _values(ask: Ask, offset: int) -> str:
    """The values of the definition that is named at an offset."""
    named = ide.definition_at(ask.db, ask.file, offset) if ask.session.live.enabled else None
    if named is None or "#>" not in ask.analysis.text(named[0]).text:
        return ""
    return "\n".join(filter(None, (shown(*each) for each in ask.session.live.at_points(*named))))


def _live(ask: Ask, offset: int) -> protocol.Hover | None:
    """A live expression: its value and its error."""
    if "#>" not in ask.text.text:
        return None
    if all(not live.span.start <= offset <= live.span.end for live in ide.live_in(ask.db, ask.file)):
        return None
    for live, value in ask.session.live.values(ask.file):
        if value is not None and live.span.start <= offset <= live.span.end:
            told = convert.markup(ask.client, FORMATS, f"`{live.text}` {value.label}\n\n{value.tooltip}")
            return {"contents": told, "range": ask.range(live.span)}
    return None
