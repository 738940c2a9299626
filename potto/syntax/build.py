"""Reductions of the grammar's expressions and lists to syntax nodes.

Owns the functions named by the aliases of `grammar.lark`, with `build_integrals`, `build_types` and `build_items`. Each
takes the context and the values of its rule's symbols. What the grammar lets pass but the language does not mean is
reported, and mended so that a tree remains.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from potto.source import Span
from potto.syntax import kinds
from potto.syntax.groups import (
    Context,
    ListedItem,
    Parenthesized,
    Suffixed,
    Values,
    as_arguments,
    as_expr,
    as_parameters,
    distinct,
    is_condition,
    plain,
    suffixed,
)
from potto.syntax.nodes import (
    Apply,
    Argument,
    Binder,
    Binding,
    Bracket,
    ErrorExpr,
    Expr,
    If,
    InlineDiffeo,
    Integral,
    Lambda,
    Let,
    ListLiteral,
    Member,
    Name,
    Number,
    Parameter,
    Paren,
    Tuple,
)
from potto.syntax.operators import Item, Prefix, climb
from potto.syntax.tokens import RESERVED

# Lists


def empty(_: Context, v: Values) -> list[Any]:
    return []


def nothing(_: Context, v: Values) -> None:
    return None


def single(_: Context, v: Values) -> list[Any]:
    return [v[0]]


def first(_: Context, v: Values) -> Any:
    return v[0]


def second(_: Context, v: Values) -> Any:
    return v[1]


def append(_: Context, v: Values) -> Any:
    v[0].append(v[1])
    return v[0]


def append_third(_: Context, v: Values) -> Any:
    v[0].append(v[2])
    return v[0]


def separator(_: Context, v: Values) -> None:
    return None


# Atoms


def name(_: Context, v: Values) -> Expr:
    _kind, text, start, end = v[0]
    if not text or text in RESERVED:
        return ErrorExpr(Span(start, end), text)
    return Name(Span(start, end), text)


def number(_: Context, v: Values) -> Number:
    _kind, text, start, end = v[0]
    return Number(Span(start, end), text, float(text))


def member(_: Context, v: Values) -> Member:
    _kind, text, start, end = v[0]
    path, _dot, last = text.rpartition(".")
    split = start + len(path)
    return Member(Span(start, end), path, Span(start, split), last, Span(split + 1, end))


def empty_list(_: Context, v: Values) -> ListLiteral:
    return ListLiteral(Span(v[0].start, v[1].end), ())


def bracket(_: Context, v: Values) -> Expr:
    span, items = Span(v[0].start, v[-1].end), v[1]
    if len(items) == 1 and is_condition(items[0]):
        return Bracket(span, items[0])
    return ListLiteral(span, tuple(items))


def bracket_comma(_: Context, v: Values) -> ListLiteral:
    return ListLiteral(Span(v[0].start, v[3].end), tuple(v[1]))


# Parentheses


def arguments(_: Context, v: Values) -> list[ListedItem]:
    return [_written(v[0], "")]


def more_arguments(_: Context, v: Values) -> list[ListedItem]:
    v[0].append(_written(v[2], v[1].text))
    return v[0]  # type: ignore[no-any-return]


def _written(value: Any, before: str) -> ListedItem:
    if isinstance(value, ListedItem):
        return value._replace(separator=before)
    return ListedItem(None, value, None, before)


def keyword(_: Context, v: Values) -> ListedItem:
    return ListedItem(v[0], v[2], None, "")


def paren_empty(_: Context, v: Values) -> Parenthesized:
    return Parenthesized(Span(v[0].start, v[1].end), (), not v[0].text)


def paren(_: Context, v: Values) -> Parenthesized:
    return Parenthesized(Span(v[0].start, v[2].end), tuple(v[1]), not v[0].text)


def paren_comma(_: Context, v: Values) -> Parenthesized:
    return Parenthesized(Span(v[0].start, v[3].end), tuple(v[1]), not v[0].text)


# Expressions


def application(context: Context, v: Values) -> Expr:
    function, value = as_expr(context, v[0]), v[1]
    if isinstance(v[0], Integral) and isinstance(value, Name) and value.id == "d":
        message = "an integral ends with one `d(...)`, which names all of its variables"
        context.report(kinds.OTHER_LANGUAGE(value.span, message, help="write `d(x, y)` for `d(x) d(y)`"))
    if isinstance(value, Suffixed):
        return suffixed(application(context, [function, value.group]), value.suffixes)
    if isinstance(value, Parenthesized):
        span = Span(function.span.start, value.span.end)
        return Apply(span, function, as_arguments(context, value), True)
    return Apply(Span(function.span.start, value.span.end), function, (Argument(value.span, None, None, value),), False)


class Prefixed(list[Any]):
    """Prefix operators and their operand, in reverse: so that a row of them is gathered in linear time."""


def prefixed(context: Context, v: Values) -> Prefixed:
    out = v[1] if isinstance(v[1], Prefixed) else Prefixed([as_expr(context, v[1])])
    out.append(Prefix(v[0]))
    return out


def operand(context: Context, v: Values) -> Expr:
    """An expression without binary operators."""
    value = v[0]
    return climb(value[::-1]) if isinstance(value, Prefixed) else as_expr(context, value)


def operators(context: Context, v: Values) -> list[Item]:
    items: list[Item] = []
    _add_operand(context, items, v[0])
    return more_operators(context, [items, v[1], v[2]])


def more_operators(context: Context, v: Values) -> list[Item]:
    items: list[Item] = v[0]
    items.append(v[1])
    _add_operand(context, items, v[2])
    return items


def _add_operand(context: Context, items: list[Item], value: Any) -> None:
    if isinstance(value, Prefixed):
        items.extend(reversed(value))
    else:
        items.append(as_expr(context, value))


def climbed(_: Context, v: Values) -> Expr:
    return climb(v[0])


def ternary(context: Context, v: Values) -> If:
    flat = type(v[0]) is list
    condition = climb(v[0]) if flat else operand(context, v)
    return If(Span(condition.span.start, v[4].span.end), condition, v[2], v[4], "?:")


def conditional(_: Context, v: Values) -> If:
    return If(Span(v[0].start, v[5].span.end), v[1], v[3], v[5], "if")


def let(_: Context, v: Values) -> Let:
    return Let(Span(v[0].start, v[3].span.end), tuple(v[1]), v[3])


def binding(context: Context, v: Values) -> Binding:
    targets = _targets(context, v[0])
    return Binding(v[0].span.cover(v[2].span), targets, v[2])


def _targets(context: Context, target: Expr) -> tuple[Binder, ...]:
    items: Iterable[Expr] = (target,)
    if isinstance(target, Tuple):
        items = target.items
    elif isinstance(target, Paren):
        items = (target.inner,)
    out: list[Binder] = []
    seen: dict[str, Span] = {}
    for item in items:
        if isinstance(item, Name):
            distinct(context, seen, item.id, item.span, "name")
            out.append(Binder(item.span, item.id))
            continue
        out.append(Binder(item.span, ""))
        if isinstance(item, ErrorExpr):
            continue
        if isinstance(item, Apply):
            help = "a local function is written `name = \\(x) . e`"
        else:
            help = "write `name = e` or `(a, b) = e`; to compare, write `==`"
        context.report(
            kinds.NOT_A_NAME(item.span, "only a name, or names in parentheses, can stand before `=`", help=help)
        )
    return tuple(out)


def lambda_(context: Context, v: Values) -> Lambda:
    groups, body = v[3]
    all_groups = (as_parameters(context, v[1]), *reversed(groups))
    return Lambda(Span(v[0].start, body.span.end), all_groups, body)


def lambda_end(_: Context, v: Values) -> tuple[list[tuple[Parameter, ...]], Expr]:
    return [], v[0]


def lambda_group(context: Context, v: Values) -> tuple[list[tuple[Parameter, ...]], Expr]:
    groups, body = v[2]
    groups.append(as_parameters(context, v[0]))
    return groups, body


def inline_diffeo(context: Context, v: Values) -> InlineDiffeo:
    group: Parenthesized = v[1]
    if not group.written:
        context.report(kinds.MISSING_EXPRESSION(group.span, "a `diffeo` needs at least one coordinate"))
    components = tuple(plain(context, written) for written in group.written)
    return InlineDiffeo(Span(v[0].start, group.span.end), components)
