"""Owns `selection_ranges`."""

from __future__ import annotations

from potto.query import Database


def selection_ranges(db: Database, file: str, offset: int) -> tuple[Span, ...]:
    return ()
