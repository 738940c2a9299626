"""Expressions as they are written: what stands inside parentheses, and the numbers that are spelled out."""

from __future__ import annotations

from potto.syntax import nodes


def without_parentheses(expr: nodes.Expr) -> nodes.Expr:
    """An expression without the parentheses around it."""
    while isinstance(expr, nodes.Paren):
        expr = expr.inner
    return expr


def number(expr: nodes.Expr) -> float | None:
    """The number that is written, with its signs."""
    expr = without_parentheses(expr)
    if isinstance(expr, nodes.Unary) and expr.op == "-":
        found = number(expr.operand)
        return None if found is None else -found
    return expr.value if isinstance(expr, nodes.Number) else None
