"""Owns `format_document`, `format_range`, `format_on_type`."""

from __future__ import annotations

from potto.ide.model import Edit
from potto.query import Database
from potto.source import Span


def format_document(db: Database, file: str) -> tuple[Edit, ...]:
    return ()


def format_range(db: Database, file: str, span: Span) -> tuple[Edit, ...]:
    return ()


def format_on_type(db: Database, file: str, offset: int, typed: str) -> tuple[Edit, ...]:
    return ()
