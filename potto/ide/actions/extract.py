"""Extracting the selected expression: to a local name, or to a definition of its own. Owns `extractions`.

A local name goes as far out as what the expression uses allows: a line of the definition's block, else a `let` around
the body of the innermost binder that it needs. The text must read without errors afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from potto.ide.actions.edits import applied, one_file
from potto.ide.actions.offers import At, PendingAction, fresh_name, reads
from potto.ide.model import Change, Edit
from potto.ide.names.index import BoundName
from potto.ide.names.places import ChunkAt, line_start
from potto.modules import is_recursive
from potto.source import Span
from potto.syntax import extent, node_at, nodes
from potto.syntax.nodes import Node

_EXPRESSIONS = (
    nodes.Number, nodes.Unary, nodes.Chain, nodes.Power, nodes.Bracket, nodes.Tuple, nodes.Paren, nodes.If,
    nodes.Apply, nodes.Integral, nodes.Reduction, nodes.Fold, nodes.Comprehension, nodes.Index, nodes.Field,
    nodes.Let, nodes.Name, nodes.Member, nodes.Lambda, nodes.InlineDiffeo,
)  # fmt: skip
_SCOPES = (nodes.Lambda, nodes.Integral, nodes.Reduction, nodes.Fold, nodes.Comprehension, nodes.Let)


def extractions(place: At) -> Iterator[PendingAction]:
    """The ways to give the selected expression a name."""
    chunk = place.chunk
    if chunk is None or not len(place.span):
        return
    item = chunk.parsed(place.db).item
    span = _trimmed(place.text, place.span).shift(-chunk.start)
    if not isinstance(item, nodes.Definition) or not len(span):
        return
    path = node_at(item, span.start)
    place_in = next((n for n, node in enumerate(path) if isinstance(node, _EXPRESSIONS) and node.span == span), None)
    if place_in is None:
        return
    path = path[: place_in + 1]
    work = Extraction(place, chunk, item, path)
    yield PendingAction("Extract to a local name", "refactor.extract", work.local, rename_at=work.local_name_at)
    if not isinstance(path[-1], nodes.InlineDiffeo) and not _decides(path):
        yield PendingAction(
            "Extract to a definition", "refactor.extract", work.definition, rename_at=work.definition_name_at
        )


def _decides(path: Sequence[Node]) -> bool:
    """Whether an expression is a bracket that stands as a condition: a function would give a number there."""
    inner = path[-1]
    for node in reversed(path[:-1]):
        if not isinstance(node, nodes.Paren | nodes.Unary | nodes.Logic):
            return isinstance(path[-1], nodes.Bracket) and isinstance(node, nodes.If) and node.condition is inner
        inner = node
    return False


def _trimmed(text: str, span: Span) -> Span:
    inner = text[span.start : span.end]
    start = span.start + len(inner) - len(inner.lstrip())
    return Span(start, max(start, span.start + len(inner.rstrip())))


class Extraction:
    """One selected expression, and where it could go."""

    def __init__(self, place: At, chunk: ChunkAt, item: nodes.Definition, path: Sequence[Node]) -> None:
        self.place, self.chunk, self.item, self.path = place, chunk, item, path
        self.span = extent(path[-1])
        self.text = chunk.text[self.span.start : self.span.end]

    def used(self) -> list[BoundName]:
        """The local names that the expression uses and does not bind, in the order of their binders."""
        found = self.chunk.index(self.place.db)
        numbers = {o.binder for o in found.occurrences if o.binder >= 0 and self._inside(o.span)}
        return [found.binders[n] for n in sorted(numbers) if not self._inside(found.binders[n].span)]

    def _inside(self, span: Span) -> bool:
        return self.span.start <= span.start and span.end <= self.span.end

    # A local name

    def local(self) -> Change | None:
        """A line of the block, or a `let`."""
        name = fresh_name(self.place.db, self.chunk, "value")
        here = Edit(self.span, name)
        for added in self._places(name):
            if added.span.start <= self.span.start and reads(self.chunk, [added, here]) is not None:
                return self._absolute([added, here])
        return None

    def _places(self, name: str) -> Iterator[Edit]:
        used = self.used()
        choice = self._choice()
        if choice is not None:
            yield Edit(Span(choice.start, choice.start), f"let {name} = {self.text} in ")
            return
        if self.item.keyword and all(self._of_block(binder) for binder in used):
            yield self._line(name)
        for node in self.path[:-1]:  # outermost first
            body = node.body if isinstance(node, (*_SCOPES, nodes.Definition)) else None
            if body is None or not (body.span.start <= self.span.start and self.span.end <= body.span.end):
                continue
            if all(binder.scope.start <= body.span.start <= binder.scope.end for binder in used):
                yield Edit(Span(body.span.start, body.span.start), f"let {name} = {self.text} in ")
                return

    def _choice(self) -> Span | None:
        """The side of a conditional that an expression of a recursion may not leave, for the condition ends that."""
        calls = any(o.binder < 0 and self._inside(o.span) for o in self.chunk.index(self.place.db).occurrences)
        if not calls or not is_recursive(self.place.db, self.place.file, self.item.name):
            return None
        for node in reversed(self.path[:-1]):
            if isinstance(node, _SCOPES):
                return None
            if isinstance(node, nodes.If):
                sides = (extent(side) for side in (node.then, node.orelse))
                return next((side for side in sides if self._within(side)), None)
        return None

    def _within(self, span: Span) -> bool:
        return span.start <= self.span.start and self.span.end <= span.end

    def _of_block(self, binder: BoundName) -> bool:
        """Whether a name is a parameter or a line of the definition."""
        head = any(p.span.start == binder.span.start for group in self.item.groups for p in group)
        return head or any(t.span == binder.span for b in self.item.bindings for t in b.targets)

    def _line(self, name: str) -> Edit:
        """A line in front of the one that the expression is in."""
        lines: list[nodes.Binding | nodes.Expr] = [*self.item.bindings, self.item.body]
        at = next((n.span.start for n in lines if n.span.start <= self.span.start < n.span.end), lines[-1].span.start)
        start = line_start(self.chunk.text, at)
        blanks = self.chunk.text[start:at]
        if blanks.strip():  # the body stands on the line of the head
            head = len(self.chunk.text[:at].rstrip(" \t"))
            return Edit(Span(head, at), f"\n    {name} = {self.text}\n    ")
        return Edit(Span(at, at), f"{name} = {self.text}\n{blanks}")

    def local_name_at(self) -> int | None:
        """Where the new name is bound after the change."""
        return self._name_at(self.local(), fresh_name(self.place.db, self.chunk, "value"))

    # A definition

    def definition(self) -> Change | None:
        """A definition above, over the local names that the expression uses."""
        name = fresh_name(self.place.db, self.chunk, "extracted")
        parameters = list(dict.fromkeys(binder.name for binder in self.used()))
        body = self.text if "\n" not in self.text else f"({self.text})"
        head = f"def {name}({', '.join(parameters)})\n    {body}" if parameters else f"{name} = {body}"
        call = f"{name}({', '.join(parameters)})" if parameters else name
        edits = [Edit(Span(0, 0), f"{head}\n\n"), Edit(self.span, call)]
        if reads(self.chunk, edits[1:]) is None:
            return None
        return self._absolute(edits)

    def definition_name_at(self) -> int | None:
        """Where the new name is defined after the change."""
        return self._name_at(self.definition(), fresh_name(self.place.db, self.chunk, "extracted"))

    def _name_at(self, change: Change | None, name: str) -> int | None:
        if change is None:
            return None
        at = applied(self.place.text, change.files[0].edits).find(name, self.chunk.start)
        return at if at >= 0 else None

    def _absolute(self, edits: Sequence[Edit]) -> Change:
        return one_file(self.place.file, *(Edit(self.chunk.absolute(e.span), e.text) for e in edits))
