"""`textDocument/rename`, `prepareRename`, `workspace/willRenameFiles`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from potto import ide
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.failures import RequestRefused
from potto_lsp.uris import to_key


def prepare(ask: Ask) -> dict[str, Any] | None:
    found = ide.prepare_rename(ask.db, ask.file, ask.offset)
    if isinstance(found, ide.Refused):
        raise RequestRefused(found.message)
    return None if found is None else {"range": ask.range(found.span), "placeholder": found.placeholder}


def rename(ask: Ask) -> protocol.WorkspaceEdit:
    found = ide.rename(ask.db, ask.file, ask.offset, ask.string("newName"))
    if isinstance(found, ide.Refused):
        raise RequestRefused(found.message)
    edits = "workspace.workspaceEdit."
    moves = ask.client.can(edits + "documentChanges") and ask.client.lists(edits + "resourceOperations", "rename")
    if found.renames and not moves:
        raise RequestRefused("this editor cannot be asked to rename a file, and a module is named by its file")
    return convert.workspace_edit(ask.analysis, ask.client, found)


def will_rename_files(ask: Ask) -> protocol.WorkspaceEdit | None:
    renames = [
        ide.FileRename(to_key(str(item.get("oldUri"))), to_key(str(item.get("newUri"))))
        for item in ask.items("files")
        if isinstance(item, Mapping)
    ]
    found = ide.rename_files(ask.db, renames)
    return convert.workspace_edit(ask.analysis, ask.client, found) if found.files else None
