"""Owns `prepare_rename`, `rename`."""

from __future__ import annotations

from potto.ide.model import Change, Refused, Renaming
from potto.query import Database


def prepare_rename(db: Database, file: str, offset: int) -> Renaming | Refused | None:
    return None


def rename(db: Database, file: str, offset: int, new_name: str) -> Change | Refused:
    return Refused("")
