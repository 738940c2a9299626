"""Reductions of what a chunk can be: definitions, imports, loops, statements. See `build` for the conventions."""

from __future__ import annotations

from typing import Any

from potto.diagnostics import suggest
from potto.source import Span
from potto.syntax import kinds
from potto.syntax.build_types import as_type
from potto.syntax.groups import Context, Parenthesized, Values, as_parameters, distinct
from potto.syntax.nodes import (
    Apply,
    Binder,
    Binding,
    BrokenItem,
    DeclaredInverse,
    Definition,
    DiffeoDefinition,
    ErrorExpr,
    Expr,
    ExpressionStatement,
    For,
    FromImport,
    Import,
    ImportedName,
    Item,
    Lambda,
    Let,
    Name,
    Parameter,
    Paren,
    Print,
    RecordDefinition,
    Statement,
    Tuple,
)
from potto.syntax.suggesting import take_out
from potto.syntax.tokens import Token

Groups = tuple[tuple[Parameter, ...], ...]

# Definitions


def definition(context: Context, v: Values) -> Item:
    _def, name, groups, result, separator, lines = v
    if isinstance(separator, Token) and separator.kind == "EQ":
        context.report(
            kinds.DEFINITION_HEAD(
                separator.span,
                "a `def` has no `=`: its body follows its head",
                help="take out the `=`",
                suggestions=take_out(context.text, separator.span),
            )
        )
    if not groups and name.text:
        context.report(
            kinds.DEFINITION_HEAD(
                name.span,
                f"`{name.text}` has no parameters",
                help=f"write `def {name.text}(x)`, or without `def`: `{name.text} = …`",
            )
        )
    parameters = _groups(context, groups)
    if not groups and len(lines) == 1 and isinstance(lines[0], Binding):  # `def f x = e`, which is said already
        lines = [ErrorExpr(lines[0].span, "")]
    bindings, body = _block(context, lines)
    span = Span(v[0].start, body.span.end)
    if not name.text:
        return BrokenItem(span, None)
    annotation = as_type(context, result) if result is not None else None
    return Definition(span, name.text, name.span, parameters, annotation, bindings, body, True)


def _groups(context: Context, groups: list[Parenthesized]) -> Groups:
    """The parameters of a def; a name is bound once over all its groups."""
    seen: dict[str, Span] = {}
    out: list[tuple[Parameter, ...]] = []
    for group in groups:
        for written in group.written:
            if written.separator == ";":
                context.report(
                    kinds.UNEXPECTED(group.span, "only a `diffeo` separates its parameters by `;`", help="write `)(`")
                )
        found = as_parameters(context, group)
        own = {parameter.name for parameter in found}
        for parameter in found:
            if parameter.name in seen and parameter.name in own:
                distinct(context, seen, parameter.name, parameter.span, "parameter")
        for parameter in found:
            seen.setdefault(parameter.name, parameter.span)
        out.append(found)
    return tuple(out)


def _block(context: Context, lines: list[Binding | Expr]) -> tuple[tuple[Binding, ...], Expr]:
    """The local names of a definition and its result, which must be the last line."""
    bindings: list[Binding] = []
    for line in lines[:-1]:
        if isinstance(line, Binding):
            bindings.append(line)
        elif not isinstance(line, ErrorExpr):
            context.report(
                kinds.LAST_LINE(
                    line.span,
                    "a definition's last line must be its result: the value of this line is lost",
                    help="name it, `name = …`, or take it out",
                    suggestions=take_out(context.text, line.span),
                )
            )
    last = lines[-1]
    if isinstance(last, Binding):
        bindings.append(last)
        context.report(
            kinds.LAST_LINE(
                last.span,
                "a definition's last line must be its result",
                label="this only names a value",
                help="end with a line that says what the definition gives",
            )
        )
        return tuple(bindings), ErrorExpr(Span(last.span.end, last.span.end), "")
    return tuple(bindings), last


def annotated(context: Context, v: Values) -> Item:
    name, body = v[0], v[4]
    span = Span(name.start, body.span.end)
    if not name.text:
        return BrokenItem(span, None)
    return Definition(span, name.text, name.span, (), as_type(context, v[2]), (), body, False)


def equation(context: Context, v: Values) -> Item:
    """`name = e`, a diffeomorphism of a `.diffeo` file, or something that was meant as a definition."""
    left, body, clauses = v[0], v[2], v[3]
    span = Span(left.span.start, clauses[-1][0].end if clauses else body.span.end)
    if isinstance(left, Name):
        if context.diffeo:
            return _diffeo_equation(context, left, body, clauses, span)
        return Definition(span, left.id, left.span, (), None, (), body, False)
    function, groups = _called(left)
    if isinstance(function, Name) and groups is not None:
        shown = function.id + "".join(f"({', '.join(p.name for p in group)})" for group in groups)
        context.report(
            kinds.DEFINITION_HEAD(
                left.span, "a function with parameters is defined with `def`", help=f"write `def {shown} …`",
                suggestions=(suggest(Span(left.span.start, body.span.start), f"def {shown} ", f"Write `def {shown}`"),),
            )
        )  # fmt: skip
        return Definition(span, function.id, function.span, groups, None, (), body, True)
    several = [item.id for item in left.items if isinstance(item, Name)] if isinstance(left, Tuple) else []
    if isinstance(left, Tuple) and len(several) == len(left.items):
        context.report(kinds.several_names(left.span, several))
    elif not isinstance(left, ErrorExpr):
        context.report(
            kinds.NOT_A_NAME(left.span, "only a name can be defined", help="write `name = e`; to compare, write `==`")
        )
    return BrokenItem(span, None)


def _called(left: Expr) -> tuple[Expr, Groups | None]:
    """`f(x, y)(c)` on the left of an `=`: the function, and its arguments as parameters if they are names."""
    groups: list[tuple[Parameter, ...]] = []
    while isinstance(left, Apply):
        found: list[Parameter] = []
        for argument in left.arguments:
            if not isinstance(argument.value, Name) or argument.name is not None:
                return left, None
            found.append(Parameter(argument.span, argument.value.id))
        groups.append(tuple(found))
        left = left.function
    return left, tuple(reversed(groups)) if groups else None


def record(context: Context, v: Values) -> Item:
    """`record Camera(eye: (Real, Real, Real), focal: Real)`."""
    name, group = v[1], v[2]
    fields = as_parameters(context, group, "field")
    if not fields and not group.virtual:
        message = "a record needs at least one field"
        context.report(kinds.RECORD_FORM(group.span, message, label="empty", help="write `x: Real`"))
    for found in fields:
        if found.annotation is None and found.name:
            help = f"write `{found.name}: Real`"
            typed = suggest(found.span, f"{found.name}: Real")
            message = f"the field `{found.name}` has no type"
            context.report(kinds.RECORD_FORM(found.span, message, label="no type", help=help, suggestions=(typed,)))
    span = Span(v[0].start, group.span.end)
    return RecordDefinition(span, name.text, name.span, fields) if name.text else BrokenItem(span, None)


# Diffeomorphisms


def diffeo_inline(context: Context, v: Values) -> Item:
    return _diffeo(context, v, (), v[4], v[5])


def diffeo_block(context: Context, v: Values) -> Item:
    bindings, body = _block(context, v[5])
    return _diffeo(context, v, bindings, body, v[6])


def _diffeo(context: Context, v: Values, bindings: tuple[Binding, ...], body: Expr, clauses: Values) -> Item:
    name: Token = v[1]
    span = Span(v[0].start, clauses[-1][0].end if clauses else body.span.end)
    groups = [part for group in v[2] for part in _split_semicolon(group)]
    if not groups or not groups[0].written:
        context.report(
            kinds.DIFFEO_FORM(
                name.span,
                f"the diffeomorphism `{name.text}` has no variables",
                help=f"write `diffeo {name.text or 'name'}(x, y; c) = (u, v)`",
            )
        )
    parameters = _groups(context, groups) if groups else ((),)
    inverse, where = _clauses(context, clauses)
    if not name.text:
        return BrokenItem(span, None)
    return DiffeoDefinition(
        span, name.text, name.span, parameters[0], parameters[1:], bindings, _components(body), inverse, where, True
    )


def _split_semicolon(group: Parenthesized) -> list[Parenthesized]:
    """`(x, y; c)` is two groups."""
    parts: list[list[Any]] = [[]]
    for written in group.written:
        if written.separator == ";":
            parts.append([])
        parts[-1].append(written._replace(separator=""))
    return [Parenthesized(group.span, tuple(part), group.virtual) for part in parts]


def _diffeo_equation(context: Context, left: Name, body: Expr, clauses: Values, span: Span) -> Item:
    """A definition of a `.diffeo` file: lambdas for the variables and the parameters around the components."""
    inverse, where = _clauses(context, clauses)
    inner = body
    groups: list[tuple[Parameter, ...]] = []
    while isinstance(inner, (Lambda, Paren)):
        if isinstance(inner, Paren):
            inner = inner.inner
            continue
        groups.extend(inner.groups)
        inner = inner.body
    if not groups:
        if not isinstance(inner, ErrorExpr):
            context.report(
                kinds.DIFFEO_FORM(
                    body.span,
                    "a diffeomorphism is a function of its variables",
                    help=f"write `{left.id} = \\(x, y) . \\c . (u, v)`",
                )
            )
        groups.append(())
    seen: dict[str, Span] = {}
    for group in groups:
        for parameter in group:
            if parameter.name not in {other.name for other in group if other is not parameter}:
                distinct(context, seen, parameter.name, parameter.span, "parameter")
    bindings: tuple[Binding, ...] = ()
    if isinstance(inner, Let):
        bindings, inner = inner.bindings, inner.body
    return DiffeoDefinition(
        span, left.id, left.span, groups[0], tuple(groups[1:]), bindings, _components(inner), inverse, where, False
    )


def _components(body: Expr) -> tuple[Expr, ...]:
    if isinstance(body, Tuple):
        return body.items
    return (body.inner,) if isinstance(body, Paren) else (body,)


def inverse(context: Context, v: Values) -> tuple[Span, DeclaredInverse]:
    return _inverse(context, v[0], v[1], v[3])


def inverse_lambda(context: Context, v: Values) -> tuple[Span, DeclaredInverse]:
    return _inverse(context, v[0], v[2], v[4])


def _inverse(context: Context, word: Token, group: Parenthesized, body: Expr) -> tuple[Span, DeclaredInverse]:
    span = Span(word.start, body.span.end)
    return span, DeclaredInverse(span, as_parameters(context, group), _components(body))


def where(_: Context, v: Values) -> tuple[Span, list[Expr]]:
    return Span(v[0].start, v[1][-1].span.end), v[1]


def _clauses(context: Context, clauses: Values) -> tuple[DeclaredInverse | None, tuple[Expr, ...]]:
    found: DeclaredInverse | None = None
    conditions: list[Expr] = []
    for span, clause in clauses:
        if not isinstance(clause, DeclaredInverse):
            conditions.extend(clause)
        elif found is None:
            found = clause
        else:
            context.report(kinds.DUPLICATE(span, "a second `inverse`", help="take one of them out"))
    return found, tuple(conditions)


# Imports


def from_import(_: Context, v: Values) -> Item:
    return _from(v, v[3], v[3][-1].span.end)


def from_import_parens(_: Context, v: Values) -> Item:
    return _from(v, v[4], v[5].end)


def _from(v: Values, names: list[ImportedName], end: int) -> Item:
    module: Token = v[1]
    return FromImport(Span(v[0].start, end), module.text, module.span, tuple(names))


def imported(_: Context, v: Values) -> ImportedName:
    token: Token = v[0]
    return ImportedName(token.span, token.text, token.span, None, None)


def imported_as(_: Context, v: Values) -> ImportedName:
    token, alias = v[0], v[2]
    return ImportedName(Span(token.start, alias.end), token.text, token.span, alias.text, alias.span)


def import_module(_: Context, v: Values) -> Item:
    return Import(Span(v[0].start, v[1].end), v[1].text, v[1].span, None, None)


def import_as(_: Context, v: Values) -> Item:
    return Import(Span(v[0].start, v[3].end), v[1].text, v[1].span, v[3].text, v[3].span)


# Statements


def top_expression(context: Context, v: Values) -> Item:
    found = statement(context, v)
    assert not isinstance(found, Binding)
    return found


def statement(context: Context, v: Values) -> Statement:
    """An expression as a statement: `print(…)` prints its arguments."""
    value = v[0]
    if isinstance(value, Binding):
        return value
    if isinstance(value, Apply) and isinstance(value.function, Name) and value.function.id == "print":
        for argument in value.arguments:
            if argument.name_span is not None:
                context.report(kinds.NAMED_ARGUMENT(argument.name_span, "`print` takes no named arguments"))
        return Print(value.span, tuple(argument.value for argument in value.arguments))
    return ExpressionStatement(value.span, value)


def for_block(_: Context, v: Values) -> For:
    return _for(v, v[4])


def for_colon_block(_: Context, v: Values) -> For:
    return _for(v, v[5])


def for_inline(_: Context, v: Values) -> For:
    return _for(v, [v[5]])


def _for(v: Values, body: list[Statement]) -> For:
    return For(Span(v[0].start, body[-1].span.end), Binder(v[1].span, v[1].text), v[3], tuple(body))
