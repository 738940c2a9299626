"""Quick fixes for a name that is not defined: import it, define it, make it a parameter. Owns `undefined_fixes`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice

from potto.diagnostics import Diagnostic
from potto.ide.actions.edits import one_file
from potto.ide.actions.imports import import_edit, new_line
from potto.ide.actions.offers import At, PendingAction
from potto.ide.model import Change, Edit
from potto.ide.names.places import ChunkAt, chunk_at
from potto.modules import find_module
from potto.modules.workspace import definers, module_name
from potto.source import Span
from potto.syntax import nodes, walk
from potto.syntax.as_written import without_parentheses

_NAME = re.compile(r"[^\W\d]\w*")
MOST_MODULES = 5  # that are offered to import a name from


def undefined_fixes(place: At, said: Diagnostic) -> Iterator[PendingAction]:
    """Where the name could come from."""
    name = place.text[said.span.start : said.span.end]
    chunk = chunk_at(place.db, place.file, said.span.start)
    if chunk is None:
        return
    if find_module(place.db, place.file, name) is not None and place.text[said.span.end : said.span.end + 1] == ".":
        edit = new_line(place.db, place.file, f"import {name}")
        yield PendingAction(f"Import the module `{name}`", "quickfix", lambda: one_file(place.file, edit), said, True)
        return
    if not _NAME.fullmatch(name) or place.text[said.span.start - 1 : said.span.start] == ".":
        return
    found = list(islice((file for file in definers(place.db, name) if file != place.file), MOST_MODULES))
    for target in found:
        module = module_name(place.db, place.file, target)
        if module is not None:
            title = f"Import `{name}` from `{module}`"
            yield PendingAction(title, "quickfix", lambda t=target: _import(place, t, name), said, len(found) == 1)  # type: ignore[misc]
    yield PendingAction(f"Define `{name}`", "quickfix", lambda: _define(place, chunk, said.span, name), said)
    item = chunk.parsed(place.db).item
    if isinstance(item, nodes.Definition) and item.keyword and item.groups:
        group = item.groups[0]
        title = f"Make `{name}` a parameter of `{item.name}`"
        end = chunk.start + (group[-1].span.end if group else item.name_span.end + 1)
        edit = Edit(Span(end, end), f", {name}" if group else name)
        yield PendingAction(title, "quickfix", lambda: one_file(place.file, edit), said)


def _import(place: At, target: str, name: str) -> Change | None:
    edit = import_edit(place.db, place.file, target, name)
    return None if edit is None else one_file(place.file, edit)


def _define(place: At, chunk: ChunkAt, span: Span, name: str) -> Change:
    """A definition above, as the name is used: with parameters if it is called."""
    groups = _groups(chunk.parsed(place.db).item, span.shift(-chunk.start))
    if groups:
        head = "".join("(" + ", ".join(group) + ")" for group in groups)
        text = f"def {name}{head}\n    0"
    else:
        text = f"{name} = 0"
    end_of_line = "\r\n" if "\r\n" in place.text else "\n"
    text = f"{text}\n\n".replace("\n", end_of_line)
    return one_file(place.file, Edit(Span(chunk.start, chunk.start), text))


def _groups(item: nodes.Item | None, span: Span) -> list[list[str]]:
    """Names for the parameters that the calls of a name ask for, outermost call last."""
    calls: dict[Span, nodes.Apply] = {}
    for node in () if item is None else walk(item):
        if isinstance(node, nodes.Apply):
            calls[without_parentheses(node.function).span] = node
    groups: list[list[str]] = []
    used: set[str] = set()
    while span in calls:
        node = calls[span]
        groups.append([_parameter(argument, used) for argument in node.arguments])
        span = node.span
    return groups


def _parameter(argument: nodes.Argument, used: set[str]) -> str:
    """The argument's own name if it has one, else a letter."""
    wanted = argument.name or (argument.value.id if isinstance(argument.value, nodes.Name) else "")
    letters = (wanted, *"xyzuvwabcstpqr")
    name = next((letter for letter in letters if letter and letter not in used), f"x{len(used)}")
    used.add(name)
    return name
