"""Reductions of written types. See `build` for the conventions."""

from __future__ import annotations

from typing import NamedTuple

from potto.source import Span
from potto.syntax import kinds
from potto.syntax.groups import Context, ListedItem, Values
from potto.syntax.habits import ARRAY_TYPE, ARRAYS
from potto.syntax.nodes import (
    ArrayType,
    DiffeoType,
    FunctionType,
    NamedType,
    Parameter,
    RealType,
    Size,
    TupleType,
    TypeExpr,
)
from potto.syntax.tokens import Token

_KNOWN = "types are `Real`, `Real*`, `Real[x]`, `Dist[x]`, `(T, U)`, `[n] T`, `T -> U`, `Diffeo[n]` and records"


class _Parens(NamedTuple):
    """Parentheses among types: the parameters of a function type if `->` follows, else a tuple or a grouping."""

    span: Span
    parameters: tuple[Parameter, ...]


def type_name(context: Context, v: Values) -> TypeExpr:
    if v[0].text and v[0].text not in ("Real", "Dist", "Diffeo"):
        return NamedType(v[0].span, v[0].text)
    return _real(context, v[0], False, (), v[0].end)


def type_member(_: Context, v: Values) -> NamedType:
    return NamedType(v[0].span, v[0].text)


def type_star(context: Context, v: Values) -> RealType:
    if v[1].text != "*" or v[0].text != "Real":
        span = Span(v[0].start, v[1].end)
        context.report(kinds.BAD_TYPE(span, f"`{v[0].text}{v[1].text}` is not a type", help=_KNOWN))
    return _real(context, v[0], True, (), v[1].end)


def type_indexed(context: Context, v: Values) -> TypeExpr:
    head: Token = v[0]
    indices: list[Token] = v[2]
    end = v[3].end
    span = Span(head.start, end)
    numbers = [token for token in indices if token.kind == "NUMBER"]
    if head.text == "Diffeo":
        if len(indices) == 1 and numbers and numbers[0].text.isdigit():
            # A hundred digits are not a number of dimensions; what is too large is reported by those who know why.
            return DiffeoType(span, int(numbers[0].text[:9]))
        context.report(kinds.BAD_TYPE(span, "`Diffeo` takes the number of its variables, as in `Diffeo[2]`"))
        return DiffeoType(span, max(1, len(indices)))
    for token in numbers:
        message = f"`{head.text}[…]` names variables of integration, not numbers"
        help = f"an array of {token.text} of them is `[{token.text}] {head.text}`"
        context.report(kinds.BAD_TYPE(token.span, message, help=help))
    return _real(context, head, False, tuple(token.text for token in indices if token.kind == "NAME"), end)


def _real(context: Context, head: Token, star: bool, variables: tuple[str, ...], end: int) -> RealType:
    span = Span(head.start, end)
    if head.text == "Dist":
        if not variables:
            context.report(kinds.BAD_TYPE(span, "a distribution names its variables, as in `Dist[x]`"))
        return RealType(span, "Dist", star, variables)
    if head.text == "Diffeo":
        context.report(kinds.BAD_TYPE(span, "`Diffeo` takes the number of its variables, as in `Diffeo[2]`"))
    elif head.text != "Real" and head.text:
        help = ARRAY_TYPE if head.text in ARRAYS else _KNOWN
        context.report(kinds.BAD_TYPE(head.span, f"there is no type `{head.text}`", help=help))
    return RealType(span, "Real", star, variables)


def parameter(context: Context, v: Values) -> ListedItem:
    """`name: T` between the commas of parentheses."""
    return ListedItem(v[0], None, as_type(context, v[2]), "")


def type_unit(_: Context, v: Values) -> _Parens:
    return _Parens(Span(v[0].start, v[1].end), ())


def type_parens(_: Context, v: Values) -> _Parens:
    return _Parens(Span(v[0].start, v[2].end), tuple(v[1]))


def type_parameter(context: Context, v: Values) -> Parameter:
    written = as_type(context, v[0])
    return Parameter(written.span, "", written)


def type_parameter_named(context: Context, v: Values) -> Parameter:
    written = as_type(context, v[2])
    return Parameter(Span(v[0].start, written.span.end), v[0].text, written)


def size(context: Context, v: Values) -> Size | TypeExpr:
    """What stands between the brackets of an array's type: a number, or a type that may be the name of a size."""
    if not isinstance(v[0], Token):
        return as_type(context, v[0])
    token: Token = v[0]
    if token.text.isdigit():
        return Size(token.span, None, int(token.text[:9]))
    context.report(kinds.BAD_TYPE(token.span, "a size is a whole number or a name, as in `[3] Real` and `[n] Real`"))
    return Size(token.span, None, 0)


def size_shifted(context: Context, v: Values) -> Size:
    name, sign, number = v
    if not number.text.isdigit():
        context.report(kinds.BAD_TYPE(number.span, "sizes differ by a whole number, as in `[n - 1] Real`"))
    offset = int(number.text[:9]) if number.text.isdigit() else 0
    return Size(Span(name.start, number.end), name.text, -offset if sign.text in "-−" else offset)


def list_type(context: Context, v: Values) -> ArrayType:
    """`[T]`: an array of any size."""
    span = Span(v[0].start, v[2].end)
    items: list[Size | TypeExpr] = v[1]
    last = items[-1]
    if len(items) > 1 or isinstance(last, Size):
        context.report(
            kinds.BAD_TYPE(span, "the type of the elements is missing", help="write it after the size: `[n] Real`")
        )
    item = RealType(span, "Real", False, ()) if isinstance(last, Size) else last
    return ArrayType(span, (Size(Span(v[0].end, v[0].end), "", 0),), item)


def array_type(context: Context, v: Values) -> ArrayType:
    """`[n, m] T`."""
    sizes: list[Size] = []
    for found in v[1]:
        if isinstance(found, NamedType):
            found = Size(found.span, found.name, 0)
        elif not isinstance(found, Size):
            context.report(kinds.BAD_TYPE(found.span, "a size is a whole number or a name, as in `[n] Real`"))
            found = Size(found.span, "_", 0)
        sizes.append(found)
    item = as_type(context, v[3])
    return ArrayType(Span(v[0].start, item.span.end), tuple(sizes), item)


def function_type(context: Context, v: Values) -> FunctionType:
    left, result = v[0], as_type(context, v[2])
    if isinstance(left, _Parens):
        return FunctionType(Span(left.span.start, result.span.end), left.parameters, result)
    return FunctionType(Span(left.span.start, result.span.end), (Parameter(left.span, "", left),), result)


def as_type(context: Context, value: TypeExpr | _Parens) -> TypeExpr:
    """A type that no `->` follows: parentheses become a tuple, or what is in them."""
    if not isinstance(value, _Parens):
        return value
    types: list[TypeExpr] = []
    for found in value.parameters:
        assert found.annotation is not None
        if found.name:
            context.report(kinds.BAD_TYPE(found.span, "only the parameters of a function type have names", help=_KNOWN))
        types.append(found.annotation)
    if len(types) == 1:
        return types[0]
    if not types:
        context.report(kinds.BAD_TYPE(value.span, "there is no empty type", help=_KNOWN))
        return RealType(value.span, "Real", False, ())
    return TupleType(value.span, tuple(types))
