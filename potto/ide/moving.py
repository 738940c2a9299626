"""Owns `rename_files`."""

from __future__ import annotations

from collections.abc import Sequence

from potto.ide.model import Change, FileRename
from potto.query import Database


def rename_files(db: Database, renames: Sequence[FileRename]) -> Change:
    return Change(())
