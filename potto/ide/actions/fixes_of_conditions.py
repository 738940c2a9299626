"""Quick fixes for conditions: a plain one over a variable of integration made diffeomorphic, an inverse written down.

Owns `bracket_fixes` and `inverse_fixes`, and `judged`: what a comparison would be in brackets.
"""

from __future__ import annotations

from collections.abc import Iterator

from potto.calculus.checking.solvability import ConditionProblem, Role, judge
from potto.calculus.explanation.notation import Notation, numbers_in
from potto.core.simplify import simplify
from potto.core.terms import Branch, Hole, Term, postorder
from potto.diagnostics import Diagnostic
from potto.elaborate import elaborate_expression
from potto.ide.actions.edits import one_file
from potto.ide.actions.offers import At, PendingAction, reads
from potto.ide.hover.derivatives import diffeo_of, inverse_text
from potto.ide.model import Change, Edit
from potto.ide.names.places import ChunkAt, chunk_at
from potto.query import Database
from potto.source import Span
from potto.syntax import extent, node_at, nodes, walk
from potto.syntax.as_written import without_parentheses
from potto.syntax.nodes import Expr


def bracket_fixes(place: At, said: Diagnostic) -> Iterator[PendingAction]:
    """A bracket around the condition, or the diffeomorphism that the checker makes of it.

    The condition may be in another definition, to which a variable of integration is given here.
    """
    for file, span in ((place.file, said.span), *((r.file or place.file, r.span) for r in said.related)):
        chunk = chunk_at(place.db, file, span.start)
        condition = None if chunk is None else condition_at(place, chunk, span.shift(-chunk.start))
        if chunk is not None and condition is not None:
            yield from _bracket(place, chunk, condition, said)


def condition_at(place: At, chunk: ChunkAt, span: Span) -> Expr | None:
    """The whole condition of a conditional that a place in a chunk is, or is a part of."""
    item = chunk.parsed(place.db).item
    path = () if item is None else node_at(item, span.start)
    for number, node in enumerate(path):
        if not isinstance(node, nodes.If):
            continue
        for inner in path[number + 1 :]:
            if inner is node.condition or isinstance(inner, nodes.Paren | nodes.Logic | nodes.Unary | nodes.Compare):
                whole = without_parentheses(node.condition)
                if extent(inner) == span and whole.span.start <= span.start and span.end <= whole.span.end:
                    return whole
            else:
                break
    return None


def _bracket(place: At, chunk: ChunkAt, condition: Expr, said: Diagnostic) -> Iterator[PendingAction]:
    written = chunk.text[condition.span.start : condition.span.end]
    item = chunk.parsed(place.db).item
    where = "" if place.chunk is not None and chunk.start == place.chunk.start else f" in `{getattr(item, 'name', '')}`"
    equal = any(isinstance(n, nodes.Compare) and any(o.op in ("==", "!=") for o in n.rest) for n in walk(condition))
    verdict = None if equal else judged(place.db, chunk, condition)
    if equal or isinstance(verdict, ConditionProblem):
        return  # a bracket would only be the next mistake
    if reads(chunk, [Edit(condition.span, f"[{written}]")]) is not None:
        edit = Edit(chunk.absolute(condition.span), f"[{written}]")
        title = f"Count the jump{where}: `[{written}]`"
        yield PendingAction(title, "quickfix", lambda: one_file(chunk.file, edit), said, True)
    completed = completed_diffeo(place, chunk, condition)
    if completed is not None:
        other = Edit(chunk.absolute(condition.span), completed)
        title = f"Make it the diffeomorphism `{completed}`"
        yield PendingAction(title, "quickfix", lambda: one_file(chunk.file, other), said)


def completed_diffeo(place: At, chunk: ChunkAt, condition: Expr) -> str | None:
    """`diffeo(…)` for a comparison over variables of integration, with the coordinates that complete it."""
    verdict = judged(place.db, chunk, condition, "map")
    if not isinstance(verdict, tuple):
        return None
    notation = _notation(place.db, chunk)
    shown = [notation.text(simplify(part)) for part in verdict]
    return f"diffeo({', '.join(shown)})"


def _notation(db: Database, chunk: ChunkAt) -> Notation:
    return Notation(numbers=numbers_in(chunk.parsed(db).item))


def judged(
    db: Database, chunk: ChunkAt, condition: Expr, role: Role = "bracket"
) -> tuple[Term, ...] | ConditionProblem | None:
    """The coordinates of a comparison over variables of integration, completed, or why there are none; None for what is
    no comparison over them."""
    term = compared(db, chunk, condition)
    if term is None:
        return None
    visible = [binder for _, binder in chunk.index(db).visible(condition.span.start)]
    variables = tuple(binder.name for binder in visible if binder.kind == "variable")
    used = tuple(v for v in variables if any(v in c.free for c in term.coordinates))
    if not used:
        return None
    verdict = judge(term.coordinates, variables, {}, role=role)
    return verdict if isinstance(verdict, ConditionProblem) else (*term.coordinates, *verdict.completion)


def compared(db: Database, chunk: ChunkAt, condition: Expr) -> Branch | None:
    """The branch that one comparison is in brackets; None for anything else."""
    if not isinstance(condition, nodes.Compare) or len(condition.rest) != 1:
        return None
    names = [binder.name for _, binder in chunk.index(db).visible(condition.span.start)]
    bracket = nodes.Bracket(condition.span, condition)
    term = elaborate_expression(db, chunk.file, bracket, names).term
    return term if isinstance(term, Branch) and not any(isinstance(n, Hole) for n in postorder(term)) else None


def inverse_fixes(place: At, said: Diagnostic) -> Iterator[PendingAction]:
    """An `inverse` to fill in, for a diffeomorphism whose inverse was not found."""
    chunk = chunk_at(place.db, place.file, said.span.start)
    item = None if chunk is None else chunk.parsed(place.db).item
    if chunk is None or not isinstance(item, nodes.DiffeoDefinition) or item.inverse is not None:
        return
    if said.code != "P0402":
        return
    names = [name for name in ("u", "v", "w", "p", "q", "r") if name not in {v.name for v in item.variables}]
    count = len(item.components)
    if count > len(names):
        return
    text = inverse_text(names[:count], [v.name for v in item.variables])
    edit = inverse_edit(chunk, item, text)
    yield PendingAction("Add an `inverse` to fill in", "quickfix", lambda: one_file(place.file, edit), said)


def inverse_edit(chunk: ChunkAt, item: nodes.DiffeoDefinition, text: str) -> Edit:
    """The edit that writes an inverse behind the components of a diffeomorphism."""
    last = item.components[-1].span.end if item.components else item.span.end
    close = chunk.text.find(")", last)
    end = chunk.start + (close + 1 if close >= 0 else last)
    return Edit(Span(end, end), f"\n    inverse {text}")


def written_inverse(place: At) -> Change | None:
    """The inverse that the checker found, written down."""
    chunk = place.chunk
    item = None if chunk is None else chunk.parsed(place.db).item
    if chunk is None or not isinstance(item, nodes.DiffeoDefinition) or item.inverse is not None:
        return None
    info = diffeo_of(place.db, place.file, item.name)
    if info is None or len(info.branches) != 1:
        return None
    text = inverse_text(info.values, map(_notation(place.db, chunk).text, info.branches[0]))
    edit = inverse_edit(chunk, item, text)
    relative = Edit(edit.span.shift(-chunk.start), edit.text)
    return one_file(place.file, edit) if reads(chunk, [relative]) is not None else None
