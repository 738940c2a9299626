"""Inline values: what a line's live expression is expected to give, and what can be evaluated there.

Owns `inline_values` and `piece_values`. Numbers are for who evaluates; here only the places and the expressions are
found.
"""

from __future__ import annotations

from msgspec.structs import replace

from potto.ide.model import InlineValue
from potto.ide.names.descriptions import kind_of
from potto.ide.names.places import PieceAt, pieces_of
from potto.query import Database, query
from potto.source import Span
from potto.syntax import live_expressions, nodes


def inline_values(db: Database, file: str, span: Span) -> tuple[InlineValue, ...]:
    """The live expressions, the constants and the printed expressions that touch a span: each a text to evaluate."""
    found: list[InlineValue] = []
    for at in pieces_of(db, file):
        if at.span.touches(span):
            there = span.shift(-at.start)
            near = (value for value in piece_values(db, file, at.text, at.hidden) if value.span.touches(there))
            found += [replace(value, span=value.span.shift(at.start)) for value in near]
    return tuple(found)


@query(keep=1024)
def piece_values(db: Database, file: str, text: str, hidden: tuple[str, ...]) -> tuple[InlineValue, ...]:
    """Those of a piece of a file, in order, relative to it."""
    found: list[InlineValue] = []
    for chunk, name in PieceAt(file, 0, text, hidden).chunks(db):
        if "#>" in chunk.text:
            asked = live_expressions(chunk.text)
            found += [InlineValue(chunk.absolute(live.text_span), live.text, "expression") for live in asked]
        item = chunk.parsed(db).item
        if isinstance(item, nodes.Definition) and name is not None and kind_of(db, file, name) == "constant":
            found.append(InlineValue(chunk.absolute(item.name_span), name, "expression"))
        shown: tuple[nodes.Expr, ...] = ()
        if isinstance(item, nodes.Print):
            shown = item.arguments
        elif isinstance(item, nodes.ExpressionStatement):
            shown = (item.value,)
        spans = [expression.span for expression in shown]
        found += [InlineValue(chunk.absolute(each), chunk.text[each.start : each.end], "expression") for each in spans]
    return tuple(sorted(found, key=lambda value: value.span))
