"""Owns `prepare_call_hierarchy`, `incoming_calls`, `outgoing_calls`."""

from __future__ import annotations

from potto.ide.model import Call, CallItem
from potto.query import Database


def prepare_call_hierarchy(db: Database, file: str, offset: int) -> CallItem | None:
    return None


def incoming_calls(db: Database, file: str, name: str) -> tuple[Call, ...]:
    return ()


def outgoing_calls(db: Database, file: str, name: str) -> tuple[Call, ...]:
    return ()
