"""Owns `code_actions`, `resolve_code_action`."""

from __future__ import annotations

from collections.abc import Sequence

from potto.ide.model import CodeAction
from potto.query import Database
from potto.source import Span


def code_actions(db: Database, file: str, span: Span, kinds: Sequence[str] = ()) -> tuple[CodeAction, ...]:
    return ()


def resolve_code_action(db: Database, action: CodeAction) -> CodeAction:
    return action
