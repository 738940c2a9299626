"""`textDocument/diagnostic`, `workspace/diagnostic`: what is wrong, for clients that ask."""

from __future__ import annotations

import os.path
from collections.abc import Mapping
from typing import Any

from potto.projects.project import NAME as PROJECT
from potto_lsp.asking import Ask
from potto_lsp.session import TREES
from potto_lsp.uris import to_key


def document(ask: Ask) -> dict[str, Any]:
    """What is wrong with a program. A project file is not one: what is wrong with it is pushed."""
    if os.path.basename(ask.file) == PROJECT:
        return {"kind": "full", "items": []}
    return ask.session.publisher.answer(ask.file, ask.optional("previousResultId"))


def workspace(ask: Ask) -> dict[str, Any]:
    """The diagnostics of all programs: `unchanged` for those that did not change, and empty for those that are gone."""
    known = ask.optional("previousResultIds")
    ids = {
        to_key(str(item.get("uri"))): item.get("value")
        for item in (known if isinstance(known, list) else ())
        if isinstance(item, Mapping)
    }
    ask.analysis.take_all_kept()
    publisher, programs = ask.session.publisher, ask.analysis.programs()
    items: list[dict[str, Any]] = []
    for number, key in enumerate(programs):
        items.append(publisher.workspace_answer(key, ids.get(key)))
        if number % TREES == TREES - 1 and not ask.session.checked:
            ask.analysis.forget_trees()
    return {"items": [*items, *publisher.gone(ids)]}
