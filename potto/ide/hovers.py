"""Owns `hover`."""

from __future__ import annotations

from potto.ide.model import Hover
from potto.query import Database


def hover(db: Database, file: str, offset: int) -> Hover | None:
    return None
