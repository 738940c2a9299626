"""Cells of notebooks: entries with the lines that they have in their cell, and answers as what notebooks show.

Owns `placed` and `result`. Knows nothing of Jupyter.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from potto.runtime.answers.rich import rows_html, rows_latex
from potto_repl.reply import Part
from potto_repl.without_terminal import entries

_NAMED = re.compile(r"_[0-9]* = ")
_MISSED = "not converged"


def placed(cell: str) -> Iterator[str]:
    """The entries of a cell, after as many empty lines as stand above them, so that messages name the lines of the
    cell."""
    lines = [line.rstrip() for line in cell.splitlines()]
    after = 0
    for text in entries(cell.splitlines()):
        start = lines.index(text.partition("\n")[0].rstrip(), after)
        after = start + text.count("\n") + 1
        yield "\n" * start + text


def result(part: Part) -> dict[str, str] | None:
    """An answer in all forms that a notebook may show; None if the part is not an answer to an expression.

    Its name is left out, for the notebook writes `Out[3]` beside it.
    """
    data = part.data or {}
    typeset = data["_latex"]() if "_latex" in data else None
    if typeset is not None:
        return {"text/plain": part.plain(), "text/latex": f"${typeset}$"}
    if part.kind != "answer" or not _NAMED.match(part.text):
        return None
    found = {"text/plain": _NAMED.sub("", part.plain(), count=1)}
    rows = [row for row in data.get("_rows", ()) if row[1] is not None]
    if rows:
        missed = "" if data.get("converged", True) else _MISSED
        cost = " : ".join(["", data["type"]]).strip() if data.get("type") else ""
        found["text/html"] = rows_html(rows, missed, cost)
        found["text/latex"] = rows_latex(rows)
    return found
