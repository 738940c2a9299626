"""Quick fixes: what can be done about a diagnostic.

Owns `fixes`. Most are the suggestions that a diagnostic carries. What takes more than its place is found here: names
that could be imported or defined (`fixes_of_names`), conditions (`fixes_of_conditions`), what is not used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from potto.diagnostics import Diagnostic
from potto.ide.actions.edits import applied, one_file
from potto.ide.actions.fixes_of_conditions import bracket_fixes, inverse_fixes
from potto.ide.actions.fixes_of_names import undefined_fixes
from potto.ide.actions.offers import At, PendingAction, diagnostics_at
from potto.ide.model import Change, Edit
from potto.ide.names.live_expressions import live_diagnostics, live_in
from potto.ide.names.places import ChunkAt, chunk_at, line_end, line_start
from potto.modules.kinds import IMPORTED_TWICE, UNUSED_IMPORT
from potto.source import Span
from potto.syntax import nodes, parse_chunk, parse_expression, walk
from potto.types.kinds import NOT_DEFINED, UNUSED_LOCAL, UNUSED_VARIABLE, VARYING_CONDITION


def fixes(place: At) -> Iterator[PendingAction]:
    """What can be done about the diagnostics that the selection touches."""
    for said in diagnostics_at(place.db, place.file, place.span):
        chunk = chunk_at(place.db, place.file, said.span.start)
        if chunk is not None:
            yield from _suggested(place, said, partial(_errors, chunk))
        if said.code == NOT_DEFINED.code:
            yield from undefined_fixes(place, said)
        elif said.code == VARYING_CONDITION.code:
            yield from bracket_fixes(place, said)
        elif said.code.startswith("P04"):
            yield from inverse_fixes(place, said)
        elif said.code in (UNUSED_IMPORT.code, IMPORTED_TWICE.code):
            yield from _unused_import(place, said)
        elif said.code in (UNUSED_LOCAL.code, UNUSED_VARIABLE.code):
            yield from _unused_local(place, said)
    for said in live_diagnostics(place.db, place.file):
        if said.span.start <= place.span.end and place.span.start <= said.span.end:
            for text, at in _live_texts(place, said):
                yield from _suggested(place, said, partial(_errors_of_expression, text, at))


def _suggested(place: At, said: Diagnostic, errors: Callable[[Sequence[Edit]], int]) -> Iterator[PendingAction]:
    """The changes that a diagnostic carries. What can't be read was guessed at, so that a change is kept if more can be
    read after it; any other must leave as much. errors: how many there are after some edits."""
    before, preferred = errors(()), True
    for suggestion in said.suggestions:
        edits = [Edit(edit.span, edit.text) for edit in suggestion.edits]
        after = errors(edits)
        of_reading = before > 0 and said.code.startswith("P01")
        if after < before or (after == before and not of_reading):
            change = one_file(place.file, *edits)
            yield PendingAction(suggestion.title, "quickfix", lambda c=change: c, said, preferred)  # type: ignore[misc]
            preferred = False


def _errors(chunk: ChunkAt, edits: Sequence[Edit]) -> int:
    """How many errors a chunk has after some edits, as far as it can't be read."""
    found = parse_chunk(_edited(chunk.text, chunk.start, edits), chunk.diffeo).diagnostics
    return sum(said.severity == "error" for said in found)


def _live_texts(place: At, said: Diagnostic) -> Iterator[tuple[str, int]]:
    """What stands in a comment and is evaluated, with its place, where something is said about that."""
    for live in live_in(place.db, place.file):
        for text, span in ((live.text, live.text_span), (live.expected, live.expected_span)):
            if text is not None and span is not None and span.start <= said.span.start <= span.end:
                yield text, span.start


def _errors_of_expression(text: str, start: int, edits: Sequence[Edit]) -> int:
    return len(parse_expression(_edited(text, start, edits)).diagnostics)


def _edited(text: str, start: int, edits: Sequence[Edit]) -> str:
    """A part of a file that begins at `start` after edits of the file."""
    return applied(text, [Edit(edit.span.shift(-start), edit.text) for edit in edits])


# What is not used


def _unused_import(place: At, said: Diagnostic) -> Iterator[PendingAction]:
    chunk = chunk_at(place.db, place.file, said.span.start)
    item = None if chunk is None else chunk.parsed(place.db).item
    if chunk is None or not isinstance(item, nodes.FromImport | nodes.Import):
        return
    relative = said.span.shift(-chunk.start)
    names = item.names if isinstance(item, nodes.FromImport) else ()
    gone = next((name for name in names if name.span == relative), None)
    if gone is None or len(names) == 1:
        what = names[0].name if len(names) == 1 else item.module
        whole = without_chunk(place.text, chunk)
        yield PendingAction(
            f"Remove the import of `{what}`", "quickfix", lambda: one_file(place.file, whole), said, True
        )
        return
    edit = Edit(chunk.absolute(list_item(names.index(gone), tuple(n.span for n in names))), "")
    yield PendingAction(
        f"Remove the import of `{gone.name}`", "quickfix", lambda: one_file(place.file, edit), said, True
    )


def without_chunk(text: str, chunk: ChunkAt) -> Edit:
    """The edit that removes a chunk with the end of its line."""
    end = line_end(text, chunk.start + len(chunk.text))
    end += 2 if text.startswith("\r\n", end) else 1 if end < len(text) else 0
    return Edit(Span(chunk.start, end), "")


def list_item(number: int, spans: tuple[Span, ...]) -> Span:
    """An item of a list with the comma that goes with it."""
    if number + 1 < len(spans):
        return Span(spans[number].start, spans[number + 1].start)
    return Span(spans[number - 1].end if number else spans[number].start, spans[number].end)


def _unused_local(place: At, said: Diagnostic) -> Iterator[PendingAction]:
    chunk = chunk_at(place.db, place.file, said.span.start)
    item = None if chunk is None else chunk.parsed(place.db).item
    if chunk is None or item is None:
        return
    name = place.text[said.span.start : said.span.end]
    relative = said.span.shift(-chunk.start)
    for node in walk(item):
        if isinstance(node, nodes.Definition | nodes.DiffeoDefinition | nodes.Let):
            for binding in node.bindings:
                if len(binding.targets) == 1 and binding.targets[0].span == relative:
                    edit = without_binding(place.text, chunk, node, binding)
                    change = one_file(place.file, edit)
                    yield PendingAction(f"Remove `{name}`", "quickfix", lambda c=change: c, said, True)  # type: ignore[misc]
    yield PendingAction(f"Rename it to `_{name}`", "quickfix", lambda: _underscored(place, chunk, relative, name), said)


def _underscored(place: At, chunk: ChunkAt, relative: Span, name: str) -> Change | None:
    found = chunk.index(place.db)
    for number, binder in enumerate(found.binders):
        if binder.span == relative:
            spans = [chunk.absolute(o.span) for o in found.of(number)]
            return one_file(place.file, *(Edit(span, f"_{name}") for span in spans))
    return None


def without_binding(
    text: str, chunk: ChunkAt, node: nodes.Definition | nodes.DiffeoDefinition | nodes.Let, binding: nodes.Binding
) -> Edit:
    """The edit that removes a binding from a block or a `let`."""
    number, count = node.bindings.index(binding), len(node.bindings)
    if isinstance(node, nodes.Let):
        if count == 1:
            return Edit(chunk.absolute(Span(node.span.start, node.body.span.start)), "")
        return Edit(chunk.absolute(list_item(number, tuple(b.span for b in node.bindings))), "")
    span = chunk.absolute(binding.span)
    start, end = line_start(text, span.start), line_end(text, span.end)
    if text[start : span.start].strip() or text[span.end : end].strip(" \t;"):
        return Edit(span, "")
    end += 2 if text.startswith("\r\n", end) else 1 if end < len(text) else 0
    return Edit(Span(start, end), "")
