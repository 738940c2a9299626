"""Owns `references`, `highlights`."""

from __future__ import annotations

from potto.ide.model import Highlight, Location
from potto.query import Database


def references(db: Database, file: str, offset: int, declaration: bool = True) -> tuple[Location, ...]:
    return ()


def highlights(db: Database, file: str, offset: int) -> tuple[Highlight, ...]:
    return ()
