"""Owns `derivative_markdown`."""

from __future__ import annotations

from potto.query import Database


def derivative_markdown(db: Database, file: str, name: str) -> str | None:
    return None
