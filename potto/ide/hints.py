"""Owns `inlay_hints`, `resolve_inlay_hint`."""

from __future__ import annotations

from potto.ide.model import InlayHint
from potto.query import Database
from potto.source import Span


def inlay_hints(db: Database, file: str, span: Span) -> tuple[InlayHint, ...]:
    return ()


def resolve_inlay_hint(db: Database, hint: InlayHint) -> InlayHint:
    return hint
