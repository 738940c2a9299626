"""Text to syntax trees.

Owns `parse_chunk` and `parse_expression`. Every text gives a tree: mistakes are diagnostics beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

from potto.diagnostics import Diagnostic
from potto.source import Span
from potto.syntax.build import Context
from potto.syntax.engine import Engine
from potto.syntax.lexer import lex
from potto.syntax.nodes import BrokenItem, ErrorExpr, Expr, Item
from potto.syntax.tokens import Comment


@dataclass(frozen=True, slots=True)
class ParsedChunk:
    """The item of a chunk (None if it has only comments), with spans and diagnostics relative to the chunk."""

    item: Item | None
    diagnostics: tuple[Diagnostic, ...]
    comments: tuple[Comment, ...]


@dataclass(frozen=True, slots=True)
class ParsedExpression:
    """An expression by itself."""

    expr: Expr
    diagnostics: tuple[Diagnostic, ...]


def parse_chunk(text: str, diffeo: bool = False) -> ParsedChunk:
    """Parse one chunk of a file; `diffeo`: of a `.diffeo` file."""
    lexed = lex(text, diffeo)
    comments = tuple(lexed.comments)
    if len(lexed.tokens) <= 1:
        return ParsedChunk(None, tuple(lexed.diagnostics), comments)
    context = Context(text, diffeo, lexed.diagnostics)
    engine = Engine(context, "chunk")
    stopped = engine.run(lexed.tokens, 0)
    if stopped < len(lexed.tokens):
        from potto.syntax import kinds
        tok = lexed.tokens[stopped]
        context.report(kinds.UNEXPECTED(tok.span, f"unexpected `{tok.text}`"))
        return ParsedChunk(BrokenItem(Span(0, len(text)), None), tuple(context.diagnostics), comments)
    return ParsedChunk(engine.result, tuple(context.diagnostics), comments)


def parse_expression(text: str) -> ParsedExpression:
    """Parse a single expression."""
    lexed = lex(text)
    context = Context(text, False, lexed.diagnostics)
    engine = Engine(context, "expression")
    stopped = engine.run(lexed.tokens, 0)
    if stopped < len(lexed.tokens):
        from potto.syntax import kinds
        tok = lexed.tokens[stopped]
        context.report(kinds.UNEXPECTED(tok.span, f"unexpected `{tok.text}`"))
        return ParsedExpression(ErrorExpr(Span(0, len(text)), text), tuple(context.diagnostics))
    return ParsedExpression(engine.result, tuple(context.diagnostics))
