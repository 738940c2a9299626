"""Reductions of arrays and what goes through them: indices, fields, sums, folds. See `build` for the conventions."""

from __future__ import annotations

from typing import Any

from potto.source import Span
from potto.syntax.groups import (
    Context,
    Parenthesized,
    Suffix,
    Suffixed,
    Values,
    as_arguments,
    as_expr,
    as_parameters,
    suffixed,
)
from potto.syntax.nodes import (
    Argument,
    Binder,
    Clause,
    Comprehension,
    ErrorExpr,
    Expr,
    Fold,
    Paren,
    Range,
    Reduction,
    Text,
    With,
)
from potto.syntax.tokens import PLAIN_OPERATOR, Token


def index(_: Context, v: Values) -> Any:
    return _behind(v[0], Suffix(v[3].end, tuple(v[2]), None))


def field(_: Context, v: Values) -> Any:
    return _behind(v[0], Suffix(v[1].end, (), v[1]))


def _behind(value: Any, suffix: Suffix) -> Any:
    if isinstance(value, Parenthesized):
        return Suffixed(value, (suffix,))
    if isinstance(value, Suffixed):
        return Suffixed(value.group, (*value.suffixes, suffix))
    return suffixed(value, (suffix,))


def text(_: Context, v: Values) -> Text:
    token: Token = v[0]
    return Text(token.span, token.text[1:-1])


def comprehension(_: Context, v: Values) -> Comprehension:
    return Comprehension(Span(v[0].start, v[4].end), v[1], tuple(v[3]))


def through(_: Context, v: Values) -> Clause:
    over: Expr = v[2]
    return Clause(Span(v[0].start, over.span.end), Binder(v[0].span, v[0].text), over)


def from_to(_: Context, v: Values) -> Clause:
    over = Range(v[2].span.cover(v[4].span), v[2], v[4])
    return Clause(Span(v[0].start, over.span.end), Binder(v[0].span, v[0].text), over)


def reduction(context: Context, v: Values) -> Reduction:
    word: Token = v[0]
    op = PLAIN_OPERATOR.get(word.text, word.text)
    return Reduction(Span(word.start, v[3].span.end), op, tuple(v[1]), _body(context, v[3]))  # type: ignore[arg-type]


def fold(context: Context, v: Values) -> Fold:
    targets = tuple(Binder(p.span, p.name) for p in as_parameters(context, v[1], "state"))
    body = _body(context, v[7])
    if not all(target.name for target in targets):  # told already; what the body calls the parts is not known
        body = ErrorExpr(body.span, context.text[body.span.start : body.span.end])
    return Fold(Span(v[0].start, v[7].span.end), targets, v[3], tuple(v[5]), body)


def _body(context: Context, group: Parenthesized) -> Expr:
    body = as_expr(context, group)
    return body.inner if isinstance(body, Paren) else body


def with_one(context: Context, v: Values) -> With:
    record, name, value = as_expr(context, v[0]), v[2], v[4]
    given = Argument(Span(name.start, value.span.end), name.text, name.span, value)
    return With(Span(record.span.start, value.span.end), record, (given,))


def with_several(context: Context, v: Values) -> With:
    record, group = as_expr(context, v[0]), v[2]
    return With(Span(record.span.start, group.span.end), record, as_arguments(context, group))
