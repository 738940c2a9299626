"""Hover of conditions: the diffeomorphism that one is, or why it isn't one; for plain conditions, what decides them.

Owns `at_condition` and `condition_after`.
"""

from __future__ import annotations

from collections.abc import Iterable

from potto.calculus.checking.solvability import ConditionProblem
from potto.calculus.explanation.notation import Notation, numbers_in
from potto.checking.check import definition_diagnostics
from potto.core.simplify import simplify
from potto.ide.actions.fixes_of_conditions import compared, judged
from potto.ide.hover.derivatives import code, condition_infos, condition_markdown, fence
from potto.ide.hover.local_names import written
from potto.ide.model import Hover
from potto.ide.names.places import ChunkAt
from potto.query import Database
from potto.source import Span
from potto.syntax import extent, node_at, nodes
from potto.syntax.as_written import without_parentheses
from potto.types.kinds import VARYING_CONDITION

RULE = "\n\n---\n\n"


def at_condition(db: Database, chunk: ChunkAt, name: str, relative: int) -> Hover | None:
    """The innermost condition around a place of a definition."""
    around = [i for i in condition_infos(db, chunk.file, name) if _near(chunk.text, i.span, relative)]
    if not around:
        return _other(db, chunk, name, relative)
    innermost = min(around, key=lambda info: len(info.span)).span
    shown = [condition_markdown(info) for info in around if info.span == innermost]
    return Hover(chunk.absolute(_around(chunk.text, innermost)), RULE.join(shown))


def condition_after(db: Database, chunk: ChunkAt, name: str, relative: int) -> Hover | None:
    """The condition of the `if` at a place."""
    for info in condition_infos(db, chunk.file, name):
        if 0 <= info.span.start - relative <= 3:
            return Hover(chunk.absolute(info.span), condition_markdown(info))
    return None


def _near(text: str, span: Span, at: int) -> bool:
    around = _around(text, span)
    return around.start <= at <= around.end


def _around(text: str, span: Span) -> Span:
    """A condition with the bracket around it."""
    left = text[max(span.start - 1, 0) : span.start]
    closed = {"[": "]", "(": ")"}.get(left, "")
    return Span(span.start - 1, span.end + 1) if closed and text[span.end : span.end + 1] == closed else span


# Conditions that the calculus has nothing to say of


def _other(db: Database, chunk: ChunkAt, name: str, relative: int) -> Hover | None:
    """A plain condition, or a bracket that no integral of the definition is around."""
    item = chunk.parsed(db).item
    comparison: nodes.Expr | None = None
    for node in reversed(() if item is None else node_at(item, relative)):
        if isinstance(node, nodes.Compare) and comparison is None:
            comparison = node
        elif isinstance(node, nodes.Bracket):
            said = _bracket(db, chunk, name, comparison or without_parentheses(node.condition))
            return None if said is None else Hover(chunk.absolute(node.span), said)
        elif isinstance(node, nodes.If):
            place = extent(node.condition)
            if place.start <= relative <= place.end and _is_plain(node.condition):
                return Hover(chunk.absolute(place), _plain(db, chunk, name, without_parentheses(node.condition)))
    return None


def _is_plain(condition: nodes.Expr) -> bool:
    """Whether a condition is made of comparisons that stand in no bracket."""
    match without_parentheses(condition):
        case nodes.Compare():
            return True
        case nodes.Logic(operands=operands):
            return all(map(_is_plain, operands))
        case nodes.Unary(op="not", operand=operand):
            return _is_plain(operand)
        case _:
            return False


def _bracket(db: Database, chunk: ChunkAt, name: str, comparison: nodes.Expr) -> str | None:
    known = _judged(db, chunk, comparison)
    if known is not None:
        return known
    if not isinstance(comparison, nodes.Compare) or compared(db, chunk, comparison) is None:
        return None
    equation = f"{written(chunk.text, comparison.first)} = {written(chunk.text, comparison.rest[0].value)}"
    by = ", ".join(code(n) for n in _names(db, chunk, extent(comparison)))
    where = f"**jump** where {code(equation)}" + (f", moved by {by}" if by else "")
    return f"{where}\n\nIt is made a diffeomorphism where {code(name)} is given something that varies."


def _plain(db: Database, chunk: ChunkAt, name: str, condition: nodes.Expr) -> str:
    place = extent(condition)
    varies = any(
        said.code == VARYING_CONDITION.code and place.start <= said.span.start and said.span.end <= place.end
        for said in definition_diagnostics(db, chunk.file, name)
    )
    if not varies:
        by = ", ".join(code(n) for n in _names(db, chunk, place))
        return "**plain condition**" + (f", decided by {by}" if by else "") + ": no integral jumps with it"
    known = _judged(db, chunk, condition)
    first = "**plain condition**, but it varies inside the integral: its jump would not be counted"
    return first if known is None else f"{first}\n\nIn brackets it would be\n\n{known}"


def _judged(db: Database, chunk: ChunkAt, comparison: nodes.Expr) -> str | None:
    """What a comparison over variables of integration is in brackets."""
    verdict = judged(db, chunk, comparison, "map")
    if isinstance(verdict, ConditionProblem):
        return "\n\n".join([f"**no diffeomorphism**: {verdict.message}", *verdict.notes])
    if verdict is None:
        return None
    write = Notation(numbers=numbers_in(chunk.parsed(db).item, comparison)).text
    return fence(f"diffeo({', '.join(write(simplify(part)) for part in verdict)})")


def _names(db: Database, chunk: ChunkAt, place: Span) -> Iterable[str]:
    """The local names in a part of a chunk."""
    inside = (o for o in chunk.index(db).occurrences if place.start <= o.span.start and o.span.end <= place.end)
    return dict.fromkeys(o.name for o in inside if o.binder >= 0)
