"""Owns `document_symbols`, `workspace_symbols`."""

from __future__ import annotations

from potto.ide.model import DocumentSymbol, WorkspaceSymbol
from potto.query import Database


def document_symbols(db: Database, file: str) -> tuple[DocumentSymbol, ...]:
    return ()


def workspace_symbols(db: Database, text: str) -> tuple[WorkspaceSymbol, ...]:
    return ()
