"""`textDocument/formatting`, `rangeFormatting`, `onTypeFormatting`."""

from __future__ import annotations

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask


def document(ask: Ask) -> list[protocol.TextEdit]:
    return convert.text_edits(ask.text, ide.format_document(ask.db, ask.file))


def in_range(ask: Ask) -> list[protocol.TextEdit]:
    return convert.text_edits(ask.text, ide.format_range(ask.db, ask.file, ask.span))


def on_type(ask: Ask) -> list[protocol.TextEdit]:
    return convert.text_edits(ask.text, ide.format_on_type(ask.db, ask.file, ask.offset, ask.string("ch")))
