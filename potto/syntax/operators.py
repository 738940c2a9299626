"""Precedence: a flat list of operands and operators to a tree.

Owns `climb`. Lowest first: `or`, `and`, `not`, comparisons, `+ -`, `* /`, unary `-`, `^` (to the right). Runs of one
level make one flat node. The work is done on explicit stacks, so that a long chain is no deeper than a short one.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, cast

from potto.source import Span
from potto.syntax.nodes import Chain, Compare, Expr, Logic, Operand, Power, Unary
from potto.syntax.tokens import PLAIN_OPERATOR, Token

LEVEL: dict[str, int] = {
    "or": 1,
    "and": 2,
    "<": 4,
    "<=": 4,
    ">": 4,
    ">=": 4,
    "==": 4,
    "!=": 4,
    "+": 5,
    "-": 5,
    "*": 6,
    "/": 6,
    "^": 8,
}
NOT_LEVEL, UNARY_LEVEL, POWER_LEVEL = 3, 7, 8


class Prefix(NamedTuple):
    """A prefix operator in the flat list."""

    token: Token


Item = Expr | Token | Prefix
"""The flat list: prefixes, an operand, a binary operator, prefixes, an operand, …"""


def climb(items: list[Item]) -> Expr:
    """The tree of a flat list of operands and operators."""
    operands: list[Expr] = []
    pending: list[tuple[int, Token, bool]] = []  # level, operator, whether it is a prefix
    for item in items:
        if isinstance(item, Prefix):
            pending.append((NOT_LEVEL if item.token.kind == "NOT" else UNARY_LEVEL, item.token, True))
        elif isinstance(item, Token):
            level = LEVEL[PLAIN_OPERATOR.get(item.text, item.text)]
            # What binds as tightly waits: it is part of the same run, or of a power, which goes to the right.
            _reduce(operands, pending, level + 1)
            pending.append((level, item, False))
        else:
            operands.append(item)
    _reduce(operands, pending, 0)
    return operands[0]


def _reduce(operands: list[Expr], pending: list[tuple[int, Token, bool]], level: int) -> None:
    """Build what binds at least as tightly as `level`."""
    while pending and pending[-1][0] >= level:
        top, operator, prefix = pending[-1]
        if prefix:
            pending.pop()
            operands.append(_unary(operator, operands.pop()))
            continue
        if top == POWER_LEVEL:
            pending.pop()
            exponent, base = operands.pop(), operands.pop()
            operands.append(Power(base.span.cover(exponent.span), base, exponent))
            continue
        # A run of one level: the operators under this one in `pending` that stand at the same level.
        count = 0
        while count < len(pending) and pending[-1 - count][0] == top and not pending[-1 - count][2]:
            count += 1
        run = [operator for _, operator, _ in pending[-count:]]
        del pending[-count:]
        values = operands[-count - 1 :]
        del operands[-count - 1 :]
        operands.append(_flat(top, values, run))


def _unary(operator: Token, operand: Expr) -> Expr:
    op = PLAIN_OPERATOR.get(operator.text, operator.text)
    return Unary(Span(operator.start, operand.span.end), cast(Literal["-", "+", "not"], op), operand)


def _flat(level: int, values: list[Expr], run: list[Token]) -> Expr:
    span = Span(values[0].span.start, values[-1].span.end)
    if level <= 2:
        return Logic(span, "or" if level == 1 else "and", tuple(values))
    rest = tuple(
        Operand(PLAIN_OPERATOR.get(token.text, token.text), token.span, value) for token, value in zip(run, values[1:])
    )
    return Compare(span, values[0], rest) if level == 4 else Chain(span, values[0], rest)
