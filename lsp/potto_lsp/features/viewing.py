"""`potto/viewPage`, `potto/viewed` and `potto/view`: the integral view in an editor.

Beyond the protocol: the page, what it shows for the place of the cursor, and the answers to its questions.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from potto import ide
from potto.applications.integral_page import parts
from potto_lsp.asking import Ask
from potto_lsp.deferred import Deferred
from potto_lsp.failures import InvalidParams
from potto_lsp.features.commands import task


def page(ask: Ask) -> dict[str, str]:
    """The page's body, style and script, for a client to put into a page of its own."""
    return parts()


def viewed(ask: Ask) -> dict[str, Any] | None:
    """The function, the integral and the condition at a place, and where the function's conditions are written."""
    found = ide.viewed(ask.db, ask.file, ask.offset)
    return None if found is None else {
        "name": found.name, "range": ask.range(found.span), "which": found.which, "lit": found.lit,
        "conditions": [{"equation": each.equation, "range": ask.range(each.span)} for each in found.conditions],
    }  # fmt: skip


def view(ask: Ask) -> Deferred:
    """An answer to the page, from the evaluation process."""
    question = ask.optional("question")
    if not isinstance(question, Mapping):
        raise InvalidParams("`question` is an object")
    return task(ask, "view", ask.file, ask.string("path"), {"question": question}, quiet=True)
