"""Owns `document_links`, `linked_editing`."""

from __future__ import annotations

from potto.ide.model import DocumentLink
from potto.query import Database


def document_links(db: Database, file: str) -> tuple[DocumentLink, ...]:
    return ()


def linked_editing(db: Database, file: str, offset: int) -> tuple[Span, ...]:
    return ()
