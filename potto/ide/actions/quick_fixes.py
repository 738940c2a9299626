"""Quick fixes: what can be done about a diagnostic.

Owns `fixes`. Names are in `fixing_names`, conditions in `fixing_conditions`, texts that can't be read in
`fixing_texts`; here is what any diagnostic may bring: a replacement that it asks about (did you mean `x`?), and the
removal of what is not used.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from potto.diagnostics import Diagnostic
from potto.ide.actions.edits import one_file
from potto.ide.actions.fixes_of_conditions import bracket_fixes, inverse_fixes
from potto.ide.actions.fixes_of_names import undefined_fixes
from potto.ide.actions.fixes_of_texts import bracketed, suggested_fixes
from potto.ide.actions.offers import At, Offer, diagnostics_at, reads
from potto.ide.model import Change, Edit
from potto.ide.names.places import ChunkAt, chunk_at, line_end, line_start
from potto.modules.kinds import IMPORTED_TWICE, UNUSED_IMPORT
from potto.source import Span
from potto.syntax import nodes, walk
from potto.types.kinds import NO_TANGENT, NOT_DEFINED, TRUTH_ESCAPES, UNUSED_LOCAL, UNUSED_VARIABLE, VARYING_CONDITION

_MEANT = re.compile(r"did you mean `([^`]+)`(?: or `([^`]+)`)?\?")


def fixes(place: At) -> Iterator[Offer]:
    """What can be done about the diagnostics that the selection touches."""
    for said in diagnostics_at(place.db, place.file, place.span):
        yield from _meant(place, said)
        if said.code.startswith("P01"):
            yield from suggested_fixes(place, said)
        elif said.code == TRUTH_ESCAPES.code:
            yield from bracketed(place, said)
        elif said.code == NOT_DEFINED.code:
            yield from undefined_fixes(place, said)
        elif said.code == VARYING_CONDITION.code:
            yield from bracket_fixes(place, said)
        elif said.code.startswith("P04"):
            yield from inverse_fixes(place, said)
        elif said.code in (UNUSED_IMPORT.code, IMPORTED_TWICE.code):
            yield from _unused_import(place, said)
        elif said.code == NO_TANGENT.code:
            yield from _with_tangent(place, said)
        elif said.code in (UNUSED_LOCAL.code, UNUSED_VARIABLE.code):
            yield from _unused_local(place, said)


def _meant(place: At, said: Diagnostic) -> Iterator[Offer]:
    """The names that a diagnostic asks about, in the place of what it is about."""
    found = _MEANT.search(said.help)
    written = place.text[said.span.start : said.span.end]
    if found is None or not re.fullmatch(r"[\w.]+", written):
        return
    for number, meant in enumerate(name for name in found.groups() if name):
        text = meant if "." in written or said.code.startswith("P0202") else meant.rpartition(".")[2]
        change = one_file(place.file, Edit(said.span, text))
        yield Offer(f"Change to `{text}`", "quickfix", lambda c=change: c, said, preferred=number == 0)  # type: ignore[misc]


def _with_tangent(place: At, said: Diagnostic) -> Iterator[Offer]:
    """A number with the tangent 1, where none was given."""
    chunk = chunk_at(place.db, place.file, said.span.start)
    written = place.text[said.span.start : said.span.end]
    before = place.text[: said.span.start].rstrip(" ")[-1:]
    both = f"(({written}, 1), (1, 0))"  # of a second derivative
    pair = both if both in said.help else f"({written}, 1)"
    written_as = pair if before in ("(", ",", "=") else f"({pair})"
    if chunk is None or reads(chunk, [Edit(said.span.shift(-chunk.start), written_as)]) is None:
        return
    change = one_file(place.file, Edit(said.span, written_as))
    yield Offer(f"Write `{pair}`", "quickfix", lambda: change, said, preferred=True)


# What is not used


def _unused_import(place: At, said: Diagnostic) -> Iterator[Offer]:
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
        yield Offer(f"Remove the import of `{what}`", "quickfix", lambda: one_file(place.file, whole), said, True)
        return
    edit = Edit(chunk.absolute(list_item(names.index(gone), tuple(n.span for n in names))), "")
    yield Offer(f"Remove the import of `{gone.name}`", "quickfix", lambda: one_file(place.file, edit), said, True)


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


def _unused_local(place: At, said: Diagnostic) -> Iterator[Offer]:
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
                    yield Offer(f"Remove `{name}`", "quickfix", lambda c=change: c, said, True)  # type: ignore[misc]
    yield Offer(f"Rename it to `_{name}`", "quickfix", lambda: _underscored(place, chunk, relative, name), said)


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
