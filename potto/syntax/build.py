"""Reductions of the grammar's expressions and lists to syntax nodes.

Owns `Context` and the functions named by the aliases of `grammar.lark` (with `build_types` and `build_items`). Each takes
the context and the values of its rule's symbols. What the grammar lets pass but the language does not mean (a named
argument outside of a call, a parameter that is no name) is reported here, and mended so that a tree remains.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from potto.diagnostics import Diagnostic, Related
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.nodes import (
    Apply,
    Argument,
    Binder,
    Binding,
    Bracket,
    Compare,
    ErrorExpr,
    Expr,
    If,
    InlineDiffeo,
    Integral,
    Interval,
    Lambda,
    Let,
    ListLiteral,
    Logic,
    MeasureBound,
    Member,
    Name,
    Number,
    Operand,
    Parameter,
    Paren,
    Sum,
    Tuple,
    TypeExpr,
    Unary,
)
from potto.syntax.operators import Item, Prefix, climb
from potto.syntax.tokens import RESERVED, Token

Values = list[Any]


@dataclass(slots=True)
class Context:
    """What the reductions share: the chunk's text and the messages so far."""

    text: str
    diffeo: bool
    diagnostics: list[Diagnostic] = field(default_factory=list)

    def report(self, diagnostic: Diagnostic) -> None:
        self.diagnostics.append(diagnostic)


class Written(NamedTuple):
    """One thing between the commas of parentheses, before it is known what the parentheses are."""

    name: Token | None
    value: Any
    annotation: TypeExpr | None
    separator: str
    """What stands before it: `,`, `;` or nothing."""


class Group(NamedTuple):
    """Parentheses: an expression, a tuple, arguments, parameters or variables."""

    span: Span
    written: tuple[Written, ...]
    trailing: bool
    virtual: bool


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


def is_condition(expr: Expr) -> bool:
    """Whether brackets around a single expression make it an Iverson bracket."""
    while isinstance(expr, Paren):
        expr = expr.inner
    return isinstance(expr, (Compare, Logic)) or (isinstance(expr, Unary) and expr.op == "not")


def bracket(_: Context, v: Values) -> Expr:
    span, items = Span(v[0].start, v[-1].end), v[1]
    if len(items) == 1 and is_condition(items[0]):
        return Bracket(span, items[0])
    return ListLiteral(span, tuple(items))


def bracket_comma(_: Context, v: Values) -> ListLiteral:
    return ListLiteral(Span(v[0].start, v[3].end), tuple(v[1]))


# Parentheses


def arguments(_: Context, v: Values) -> list[Written]:
    return [_written(v[0], "")]


def more_arguments(_: Context, v: Values) -> list[Written]:
    v[0].append(_written(v[2], v[1].text))
    return v[0]  # type: ignore[no-any-return]


def _written(value: Any, before: str) -> Written:
    if isinstance(value, Written):
        return value._replace(separator=before)
    return Written(None, value, None, before)


def keyword(_: Context, v: Values) -> Written:
    return Written(v[0], v[2], None, "")


def paren_empty(_: Context, v: Values) -> Group:
    return Group(Span(v[0].start, v[1].end), (), False, not v[0].text)


def paren(_: Context, v: Values) -> Group:
    return Group(Span(v[0].start, v[2].end), tuple(v[1]), False, not v[0].text)


def paren_comma(_: Context, v: Values) -> Group:
    return Group(Span(v[0].start, v[3].end), tuple(v[1]), True, not v[0].text)


def as_expr(context: Context, value: Any) -> Expr:
    """Parentheses that stand for a value: `(e)` or a tuple; anything but parentheses as it is."""
    if not isinstance(value, Group):
        return value  # type: ignore[no-any-return]
    items = [plain(context, written) for written in value.written]
    if not items and value.virtual:
        return ErrorExpr(value.span, "")
    if not items:
        context.report(kinds.MISSING_EXPRESSION(value.span, "there is nothing between these parentheses"))
        return ErrorExpr(value.span, context.text[value.span.start : value.span.end])
    if len(items) == 1:
        return Paren(value.span, items[0])
    return Tuple(value.span, tuple(items))


def plain(context: Context, written: Written) -> Expr:
    """A thing between commas where only an expression has a meaning."""
    if written.separator == ";":
        _semicolon(context, written)
    if written.name is None:
        return written.value  # type: ignore[no-any-return]
    target = Name(written.name.span, written.name.text)
    if written.annotation is not None:
        span = written.name.span.cover(written.annotation.span)
        context.report(
            kinds.NOT_A_NAME(span, "only a parameter can be given a type", help="a choice is written `p ? a : b`")
        )
        return target
    span = target.span.cover(written.value.span)
    context.report(
        kinds.EQUALS(
            span,
            f"`{target.id} = …` names an argument, but this is no call",
            help=f"to compare, write `{target.id} == …`",
        )
    )
    op = Operand("==", Span(target.span.end, target.span.end), written.value)
    return Compare(span, target, (op,))


def _semicolon(context: Context, written: Written) -> None:
    value = written.name if written.name is not None else written.value
    context.report(
        kinds.UNEXPECTED(
            value.span,
            "a `;` separates bindings of a `let`, or the variables of a `diffeo` from its parameters",
            help="write `,` here",
        )
    )


def as_arguments(context: Context, group: Group) -> tuple[Argument, ...]:
    """Parentheses that hold the arguments of a call."""
    out: list[Argument] = []
    seen: dict[str, Span] = {}
    for written in group.written:
        if written.name is None or written.annotation is not None:
            value = plain(context, written)
            out.append(Argument(value.span, None, None, value))
            continue
        if written.separator == ";":
            _semicolon(context, written)
        key = written.name
        distinct(context, seen, key.text, key.span, "argument")
        out.append(Argument(key.span.cover(written.value.span), key.text, key.span, written.value))
    return tuple(out)


def distinct(context: Context, seen: dict[str, Span], id: str, span: Span, what: str) -> None:
    """Report a name that `seen` has already; note it."""
    if id in seen and id:
        place = Related(seen[id], "first here")
        context.report(kinds.DUPLICATE(span, f"the {what} `{id}` is here twice", related=(place,), help="rename one"))
    seen.setdefault(id, span)


def as_parameters(context: Context, value: Any, what: str = "parameter") -> tuple[Parameter, ...]:
    """A name or parentheses that bind names: parameters of a function, of an inverse, of a diffeomorphism."""
    if isinstance(value, Token):
        return (Parameter(value.span, value.text),)
    out: list[Parameter] = []
    seen: dict[str, Span] = {}
    for written in value.written:
        if written.annotation is not None:
            span = written.name.span.cover(written.annotation.span)
            found = Parameter(span, written.name.text, written.annotation)
        elif written.name is None and isinstance(written.value, Name):
            found = Parameter(written.value.span, written.value.id)
        else:
            bad = written.value if written.name is None else written.name
            if not isinstance(bad, ErrorExpr):
                _not_a_name(context, written, what)
            found = Parameter(bad.span, written.name.text if written.name is not None else "")
        distinct(context, seen, found.name, found.span, what)
        out.append(found)
    return tuple(out)


def _not_a_name(context: Context, written: Written, what: str) -> None:
    if written.name is not None:
        span = written.name.span.cover(written.value.span)
        context.report(
            kinds.NOT_A_NAME(span, f"a {what} can't have a default value", help="pass it where it is called")
        )
        return
    span = written.value.span
    shown = context.text[span.start : span.end]
    message = f"`{shown}` is no name: a {what} must be one" if len(shown) < 40 else f"a {what} must be a name"
    context.report(kinds.NOT_A_NAME(span, message))


def as_binders(context: Context, group: Group, what: str) -> tuple[Binder, ...]:
    """The variables in parentheses, without types."""
    out: list[Binder] = []
    for found in as_parameters(context, group, what):
        if found.annotation is not None:
            context.report(kinds.NOT_A_NAME(found.annotation.span, f"a {what} takes no type"))
        out.append(Binder(found.span, found.name))
    return tuple(out)


# Expressions


def application(context: Context, v: Values) -> Expr:
    function, value = as_expr(context, v[0]), v[1]
    if isinstance(value, Group):
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
    group: Group = v[1]
    if not group.written:
        context.report(kinds.MISSING_EXPRESSION(group.span, "a `diffeo` needs at least one coordinate"))
    components = tuple(plain(context, written) for written in group.written)
    return InlineDiffeo(Span(v[0].start, group.span.end), components)


def sum(context: Context, v: Values) -> Sum:
    variable = Binder(v[1].span, v[1].text)
    body = as_expr(context, v[7])
    if isinstance(body, Paren):
        body = body.inner
    return Sum(Span(v[0].start, v[7].span.end), variable, v[3], v[5], body)


# Integrals


def interval(_: Context, v: Values) -> Interval:
    return Interval(Span(v[0].start, v[4].end), v[1], v[3])


def measure(context: Context, v: Values) -> MeasureBound:
    group: Group = v[3]
    values = tuple(plain(context, written) for written in group.written)
    span = Span(v[0].start, group.span.end)
    return MeasureBound(span, v[0].text, v[0].span, v[2].text, v[2].span, values)


def integral(context: Context, v: Values) -> Integral:
    _word, bounds, body, d, group = v
    span = Span(v[0].start, group.span.end)
    if group.virtual:
        end = Span(group.span.end, group.span.end)
        named = [b.variable if isinstance(b, MeasureBound) else "" for b in bounds]
        return Integral(span, tuple(bounds), body, tuple(Binder(end, id) for id in named))
    variables = as_binders(context, group, "variable of integration")
    _match_bounds(context, bounds, variables, Span(d.start, group.span.end))
    return Integral(span, tuple(bounds), body, variables)


def integral_unbounded(context: Context, v: Values) -> Integral:
    """An integral whose bounds are missing, as the lexer has said."""
    variables = as_binders(context, v[4], "variable of integration")
    return Integral(Span(v[0].start, v[4].span.end), (), v[2], variables)


def _match_bounds(context: Context, bounds: Values, variables: tuple[Binder, ...], place: Span) -> None:
    if len(bounds) != len(variables):
        over = Span(bounds[0].span.start, bounds[-1].span.end)
        context.report(
            kinds.BOUNDS(
                place,
                f"{_count(len(variables), 'variable')} of integration, but bounds for {len(bounds)}",
                related=(Related(over, f"bounds for {len(bounds)}"),),
                help="give one `[lo, hi]` (or `x ~ …`) for each variable, in the order of `d(...)`",
            )
        )
        return
    for bound, variable in zip(bounds, variables):
        if isinstance(bound, MeasureBound) and bound.variable != variable.name and variable.name:
            context.report(
                kinds.BOUNDS(
                    variable.span,
                    f"this variable is `{variable.name}`, but its bound is for `{bound.variable}`",
                    related=(Related(bound.variable_span, f"the bound for `{bound.variable}`"),),
                    help="write the variables of `d(...)` in the order of the bounds",
                )
            )


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
