"""`textDocument/hover`."""

from __future__ import annotations

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask


def hover(ask: Ask) -> protocol.Hover | None:
    found = ide.hover(ask.db, ask.file, ask.offset)
    if found is None:
        return None
    return {"contents": convert.markdown(found.markdown), "range": ask.range(found.span)}
