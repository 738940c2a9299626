"""Parentheses, which may turn out to be an expression, a tuple, arguments, parameters or variables.

Owns `Context`, `Parenthesized` and the functions that turn a group into what its place asks for. What has no meaning
there is reported and mended, so that there is always a tree.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from potto.diagnostics import Diagnostic, Related, suggest
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.nodes import (
    Apply,
    Argument,
    Binder,
    Bracket,
    Compare,
    ErrorExpr,
    Expr,
    Field,
    Index,
    Logic,
    Name,
    Operand,
    Parameter,
    Paren,
    Tuple,
    TypeExpr,
    Unary,
    With,
)
from potto.syntax.suggesting import write
from potto.syntax.tokens import Token

Values = list[Any]


@dataclass(eq=False, repr=False, slots=True)
class Context:
    """What the reductions share: the chunk's text and the messages so far."""

    text: str
    diffeo: bool
    diagnostics: list[Diagnostic] = field(default_factory=list)

    def report(self, diagnostic: Diagnostic) -> None:
        self.diagnostics.append(diagnostic)


class ListedItem(NamedTuple):
    """One thing between the commas of parentheses, before it is known what the parentheses are."""

    name: Token | None
    value: Any
    annotation: TypeExpr | None
    separator: str
    """What stands before it: `,`, `;` or nothing."""


class Parenthesized(NamedTuple):
    """Parentheses: an expression, a tuple, arguments, parameters or variables."""

    span: Span
    written: tuple[ListedItem, ...]
    virtual: bool


class Suffixed(NamedTuple):
    """Parentheses with what stands directly behind: `(x)[i]` by itself is an index, `f(x)[i]` one of the call."""

    group: Parenthesized
    suffixes: tuple[Suffix, ...]


class Suffix(NamedTuple):
    """`[i, j]` or `.name` behind a value: the items between the brackets, or the token."""

    end: int
    items: tuple[Expr, ...]
    name: Token | None


def suffixed(value: Expr, suffixes: tuple[Suffix, ...]) -> Expr:
    """A value with its suffixes; brackets with a condition in them are an argument."""
    for end, items, name in suffixes:
        span = Span(value.span.start, end)
        if name is not None:
            value = Field(span, value, name.text[1:], Span(name.start + 1, name.end))
        elif len(items) == 1 and is_condition(items[0]):
            inner = items[0].span
            bracket = Bracket(Span(min(value.span.end, inner.start), end), items[0])
            value = Apply(span, value, (Argument(bracket.span, None, None, bracket),), False)
        else:
            value = Index(span, value, items)
    return value


def is_condition(expr: Expr) -> bool:
    """Whether brackets around a single expression make it an Iverson bracket."""
    while isinstance(expr, Paren):
        expr = expr.inner
    return isinstance(expr, (Compare, Logic)) or (isinstance(expr, Unary) and expr.op == "not")


def as_expr(context: Context, value: Any) -> Expr:
    """Parentheses as a value: `(e)` or a tuple. Anything else is returned unchanged."""
    kind = type(value)
    if kind is Suffixed:
        return suffixed(as_expr(context, value.group), value.suffixes)
    if kind is not Parenthesized:
        return value  # type: ignore[no-any-return]
    items = list[Expr]()
    for written in value.written:
        items.append(plain(context, written, items[-1] if items else None))
    if not items and value.virtual:
        return ErrorExpr(value.span, "")
    if not items:
        context.report(kinds.MISSING_EXPRESSION(value.span, "there is nothing between these parentheses"))
        return ErrorExpr(value.span, context.text[value.span.start : value.span.end])
    if len(items) == 1:
        return Paren(value.span, items[0])
    return Tuple(value.span, tuple(items))


def plain(context: Context, written: ListedItem, before: Expr | None = None) -> Expr:
    """An item between commas where only an expression makes sense. before: the item before it, if that matters."""
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
    message = f"`{target.id} = …` names an argument, but this is not a call"
    help = f"to compare, write `{target.id} == …`"
    suggestions = [suggest(Span(target.span.end, written.value.span.start), " == ", "Write `==`")]
    if isinstance(before, With):
        message, suggestions = f"`{target.id} = …` stands behind a `with` of one field", []
        help = f"several fields stand in parentheses: `c with (…, {target.id} = …)`"
    context.report(kinds.EQUALS(span, message, help=help, suggestions=tuple(suggestions)))
    op = Operand("==", Span(target.span.end, target.span.end), written.value)
    return Compare(span, target, (op,))


def _semicolon(context: Context, written: ListedItem) -> None:
    value = written.name if written.name is not None else written.value
    at = context.text.rfind(";", 0, value.span.start)
    near = not context.text[at + 1 : value.span.start].strip()  # else a comment lies between
    context.report(
        kinds.UNEXPECTED(
            Span(at, at + 1) if near else value.span,
            "a `;` separates bindings of a `let`, or the variables of a `diffeo` from its parameters",
            help="write `,` here",
            suggestions=write(context.text, Span(at, at + 1), ","),
        )
    )


def as_arguments(context: Context, group: Parenthesized) -> tuple[Argument, ...]:
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


def _not_a_name(context: Context, written: ListedItem, what: str) -> None:
    if written.name is not None:
        span = written.name.span.cover(written.value.span)
        context.report(
            kinds.NOT_A_NAME(span, f"a {what} can't have a default value", help="pass it where it is called")
        )
        return
    span = written.value.span
    shown = context.text[span.start : span.end]
    message = f"`{shown}` is not a name: a {what} must be one" if len(shown) < 40 else f"a {what} must be a name"
    apart = isinstance(written.value, Apply) and all(isinstance(a.value, Name) for a in written.value.arguments)
    help = "write `,` between the two" if apart else ""
    if isinstance(written.value, Tuple):
        help = "give it one name, such as `p`: its parts are `p.0`, `p.1`"
    context.report(kinds.NOT_A_NAME(span, message, help=help))


def as_binders(context: Context, group: Parenthesized, what: str) -> tuple[Binder, ...]:
    """The variables in parentheses, without types."""
    out: list[Binder] = []
    for found in as_parameters(context, group, what):
        if found.annotation is not None:
            context.report(kinds.NOT_A_NAME(found.annotation.span, f"a {what} takes no type"))
        out.append(Binder(found.span, found.name))
    return tuple(out)
