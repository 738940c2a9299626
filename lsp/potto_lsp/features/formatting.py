"""`textDocument/formatting`, `rangeFormatting`, `onTypeFormatting`."""

from __future__ import annotations

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask


def document(ask: Ask) -> list[protocol.TextEdit]:
    edits = ide.format_document(ask.db, ask.file)
    return [{"range": ask.range(edit.span), "newText": edit.text} for edit in edits]


def in_range(ask: Ask) -> list[protocol.TextEdit]:
    return convert.text_edits(ask.text, ide.format_range(ask.db, ask.file, ask.span))


def on_type(ask: Ask) -> list[protocol.TextEdit]:
    return convert.text_edits(ask.text, ide.format_on_type(ask.db, ask.file, ask.offset, ask.string("ch")))
