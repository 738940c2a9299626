"""Inlining a local name: its value in the place of its uses. Owns `inlinings`."""

from __future__ import annotations

from collections.abc import Iterator

from potto.ide.actions.edits import one_file
from potto.ide.actions.offers import At, PendingAction, as_operand, reads
from potto.ide.actions.quick_fixes import without_binding
from potto.ide.model import Change, Edit
from potto.ide.names.index import NameIndex
from potto.ide.names.places import ChunkAt
from potto.ide.names.symbols import LocalSymbol, symbol_at
from potto.source import Span
from potto.syntax import nodes, walk

Block = nodes.Definition | nodes.DiffeoDefinition | nodes.Let


def inlinings(place: At) -> Iterator[PendingAction]:
    """The local name at the selection, if it can be inlined."""
    found = symbol_at(place.db, place.file, place.span.start)
    if found is None or not isinstance(found.symbol, LocalSymbol) or found.symbol.binder.kind != "local":
        return
    symbol = found.symbol
    item = symbol.chunk.parsed(place.db).item
    for node in () if item is None else walk(item):
        if isinstance(node, Block):
            for binding in node.bindings:
                if len(binding.targets) == 1 and binding.targets[0].span == symbol.binder.span:
                    title = f"Inline `{symbol.binder.name}`"
                    yield PendingAction(
                        title, "refactor.inline",
                        lambda n=node, b=binding: _inlined(place, symbol, n, b),  # type: ignore[misc]
                    )  # fmt: skip


def _inlined(place: At, symbol: LocalSymbol, node: Block, binding: nodes.Binding) -> Change | None:
    chunk, value = symbol.chunk, binding.value
    names = chunk.index(place.db)
    text = as_operand(chunk.text[value.span.start : value.span.end], value)
    uses = [o.span for o in names.of(symbol.number) if o.role == "use"]
    if any(_captures(names, value.span, use) for use in uses):
        return None
    edits = [without_binding(place.text, chunk, node, binding), *(Edit(chunk.absolute(u), text) for u in uses)]
    if reads(chunk, _relative(chunk, edits)) is None:
        return None
    return one_file(place.file, *edits)


def _relative(chunk: ChunkAt, edits: list[Edit]) -> list[Edit]:
    return [Edit(edit.span.shift(-chunk.start), edit.text) for edit in edits]


def _captures(names: NameIndex, value: Span, use: Span) -> bool:
    """Whether a name in the value would mean something else at a use."""
    visible = {binder.name: number for number, binder in names.visible(use.start)}
    inside = [o for o in names.occurrences if value.start <= o.span.start and o.span.end <= value.end]
    own = {n for n, binder in enumerate(names.binders) if value.start <= binder.span.start < value.end}
    for occurrence in inside:
        if occurrence.binder in own or occurrence.role not in ("use", "path"):
            continue
        if visible.get(occurrence.name.partition(".")[0], -1) != occurrence.binder:
            return True
    return False
