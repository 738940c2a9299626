"""Inline values: what a line's live expression is expected to give, and what can be evaluated there.

Owns `inline_values`. Numbers are for who evaluates; here only the places and the expressions are found.
"""

from __future__ import annotations

from potto.ide.model import InlineValue
from potto.ide.names.descriptions import kind_of
from potto.ide.names.places import all_chunks, owner
from potto.query import Database
from potto.source import Span
from potto.syntax import live_expressions, nodes


def inline_values(db: Database, file: str, span: Span) -> tuple[InlineValue, ...]:
    """The live expressions, the constants and the printed expressions that touch a span: each a text to evaluate."""
    found: list[InlineValue] = []
    for chunk in all_chunks(db, file, span):
        if "#>" in chunk.text:
            found += (
                InlineValue(chunk.absolute(live.text_span), live.text, "expression")
                for live in live_expressions(chunk.text)
            )
        item = chunk.parsed(db).item
        name = owner(db, chunk)
        if isinstance(item, nodes.Definition) and name is not None and kind_of(db, file, name) == "constant":
            found.append(InlineValue(chunk.absolute(item.name_span), name, "expression"))
        shown: tuple[nodes.Expr, ...] = ()
        if isinstance(item, nodes.Print):
            shown = item.arguments
        elif isinstance(item, nodes.ExpressionStatement):
            shown = (item.value,)
        found += (
            InlineValue(chunk.absolute(e.span), chunk.text[e.span.start : e.span.end], "expression") for e in shown
        )
    return tuple(
        v for v in sorted(found, key=lambda v: v.span) if v.span.start <= span.end and span.start <= v.span.end
    )
