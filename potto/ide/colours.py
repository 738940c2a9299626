"""Owns `semantic_tokens`."""

from __future__ import annotations

from potto.ide.model import SemanticToken
from potto.query import Database
from potto.source import Span


def semantic_tokens(db: Database, file: str, span: Span | None = None) -> tuple[SemanticToken, ...]:
    return ()
