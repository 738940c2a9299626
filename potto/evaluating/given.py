"""Other values for names of a program: what `--set NAME=EXPR` gives. Owns `give`.

The program is checked and evaluated as if it said so itself: a definition of that name is replaced, else there is one
more. So all who use the name get the new value, functions of the file as well as what is asked for.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.checking.library import Library
from potto.modules import chunk_start, definition, names
from potto.reports.render import Located, ProgramError
from potto.source import SourceText
from potto.syntax import parse_expression


def give(library: Library, file: str, given: Sequence[tuple[str, str]]) -> None:
    """Let names at the top of a file have these values. Raises ProgramError for what is no expression."""
    for name, text in given:
        wrong = [d for d in parse_expression(text).diagnostics if d.severity == "error"]
        if wrong:
            where = f"<{name}>"
            source = SourceText(where, text)
            raise ProgramError([Located(where, d) for d in wrong], lambda key, s=source: s)  # type: ignore[misc]
        library.put(file, _changed(library, file, name, text))


def _changed(library: Library, file: str, name: str, text: str) -> str:
    """The text of a file with a definition. Lines stay where they are."""
    source = library.source(file)
    whole = "" if source is None else source.text
    item = definition(library.db, file, name) if name in names(library.db, file) else None
    if item is None:
        return f"{whole.rstrip()}\n{name} = {text}\n" if whole.strip() else f"{name} = {text}\n"
    start = chunk_start(library.db, file, name) + item.span.start
    end = start + len(item.span)
    lines = whole.count("\n", start, end) - text.count("\n")
    return f"{whole[:start]}{name} = {text}" + "\n" * lines + whole[end:]
