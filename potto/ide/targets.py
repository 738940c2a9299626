"""Owns `definition`, `declaration`, `type_definition`, `implementation`."""

from __future__ import annotations

from potto.ide.model import Links
from potto.query import Database


def definition(db: Database, file: str, offset: int) -> Links | None:
    return None


def declaration(db: Database, file: str, offset: int) -> Links | None:
    return None


def type_definition(db: Database, file: str, offset: int) -> Links | None:
    return None


def implementation(db: Database, file: str, offset: int) -> Links | None:
    return None
