"""Owns `signature_help`."""

from __future__ import annotations

from potto.ide.model import SignatureHelp
from potto.query import Database


def signature_help(db: Database, file: str, offset: int) -> SignatureHelp | None:
    return None
