"""Trees to text, with as few parentheses as keep the meaning.

Owns `print_expression`, `print_item` and `print_type`, for messages, hovers and the law that reading what was printed
gives the tree again. What the author wrote is laid out by `formatter` instead.
"""

from __future__ import annotations

import re
from typing import assert_never

from potto.syntax.nodes import (
    Apply,
    Argument,
    ArrayType,
    Binder,
    Binding,
    Bracket,
    BrokenItem,
    Chain,
    Clause,
    Compare,
    Comprehension,
    Definition,
    DiffeoDefinition,
    DiffeoType,
    ErrorExpr,
    Expr,
    ExpressionStatement,
    Field,
    Fold,
    For,
    FromImport,
    FunctionType,
    If,
    Import,
    Index,
    InlineDiffeo,
    Integral,
    Interval,
    Item,
    Lambda,
    Let,
    ListLiteral,
    Logic,
    MeasureBound,
    Member,
    Name,
    NamedType,
    Number,
    Parameter,
    Paren,
    Power,
    Print,
    Range,
    RealType,
    RecordDefinition,
    Reduction,
    Size,
    Statement,
    Text,
    Tuple,
    TupleType,
    TypeExpr,
    Unary,
    With,
)

_OPEN, _OR, _AND, _NOT, _COMPARE, _SUM, _PRODUCT, _UNARY, _POWER, _APPLY, _ATOM = range(11)
"""How tightly a form binds; operands are wrapped in parentheses when they bind less than their place asks."""

_INDENT = "    "


def print_expression(expr: Expr) -> str:
    """An expression on one line."""
    return _text(expr, _OPEN)


def print_type(type: TypeExpr) -> str:
    """A written type on one line."""
    match type:
        case RealType(head=head, star=star, variables=variables):
            return head + ("*" if star else "") + (f"[{', '.join(variables)}]" if variables else "")
        case TupleType(items=items):
            return f"({', '.join(print_type(item) for item in items)})"
        case ArrayType(sizes=sizes, item=item):
            if sizes[0].name == "":
                return f"[{print_type(item)}]"
            inner = print_type(item)
            inner = f"({inner})" if isinstance(item, FunctionType) else inner
            return f"[{', '.join(map(_size, sizes))}] {inner}"
        case NamedType(name=name):
            return name
        case DiffeoType(dims=dims):
            return f"Diffeo[{dims}]"
        case FunctionType(parameters=parameters, result=result):
            first = parameters[0].annotation if len(parameters) == 1 and not parameters[0].name else None
            if first is not None and not isinstance(first, FunctionType | TupleType):
                return f"{print_type(first)} -> {print_type(result)}"
            return f"({', '.join(_parameter(p) for p in parameters)}) -> {print_type(result)}"
        case _:
            assert_never(type)


def print_item(item: Item) -> str:
    """A definition or a statement, over as many lines as it needs."""
    match item:
        case FromImport(module=module, names=names):
            listed = ", ".join(n.name if n.alias is None else f"{n.name} as {n.alias}" for n in names)
            return f"from {module} import {listed}"
        case Import(module=module, alias=alias):
            return f"import {module}" if alias is None else f"import {module} as {alias}"
        case Definition():
            return _definition(item)
        case DiffeoDefinition():
            return _diffeo(item)
        case RecordDefinition(name=name, fields=fields):
            return f"record {name}{_group(fields)}"
        case BrokenItem():
            return ""
        case Print() | For() | ExpressionStatement():
            return _statement(item, "")
        case _:
            assert_never(item)


def _definition(item: Definition) -> str:
    body = print_expression(item.body)
    if not item.keyword:
        annotation = "" if item.result is None else f": {print_type(item.result)}"
        return f"{item.name}{annotation} = {body}"
    head = f"def {item.name}{''.join(_group(group) for group in item.groups)}"
    if item.result is not None:
        head += f" -> {print_type(item.result)}"
    return "\n".join([head, *(f"{_INDENT}{_binding(b)}" for b in item.bindings), _INDENT + body])


def _diffeo(item: DiffeoDefinition) -> str:
    body = _components(item.components)
    clauses = []
    if item.inverse is not None:
        inverse = item.inverse
        clauses.append(f"{_INDENT}inverse {_group(inverse.parameters)} . {_components(inverse.components)}")
    if item.where:
        clauses.append(f"{_INDENT}where {', '.join(print_expression(p) for p in item.where)}")
    if item.keyword:
        groups = "".join(_group(group) for group in item.groups[1:])
        first = ", ".join(_parameter(p) for p in item.variables)
        if item.groups:
            first += "; " + ", ".join(_parameter(p) for p in item.groups[0])
        head = f"diffeo {item.name}({first}){groups} ="
        if item.bindings:
            return "\n".join([head, *(f"{_INDENT}{_binding(b)}" for b in item.bindings), _INDENT + body, *clauses])
        return "\n".join([f"{head} {body}", *clauses])
    if item.bindings:
        body = f"let {'; '.join(_binding(b) for b in item.bindings)} in {body}"
    heads = "".join(f"\\{_lambda_group(group)} . " for group in (item.variables, *item.groups))
    return "\n".join([f"{item.name} = {heads}{body}", *clauses])


def _components(components: tuple[Expr, ...]) -> str:
    if len(components) == 1:
        return print_expression(components[0])
    return f"({_list(components)})"


def _statement(item: Statement, indent: str) -> str:
    match item:
        case Print(arguments=arguments):
            return f"{indent}print({_list(arguments)})"
        case ExpressionStatement(value=value):
            return indent + print_expression(value)
        case Binding():
            return indent + _binding(item)
        case For(variable=variable, iterable=iterable, body=body):
            head = f"{indent}for {variable.name} in {print_expression(iterable)}:"
            return "\n".join([head, *(_statement(inner, indent + _INDENT) for inner in body)])
        case _:
            assert_never(item)


def _binding(binding: Binding) -> str:
    return f"{_names(binding.targets)} = {print_expression(binding.value)}"


def _parameter(parameter: Parameter) -> str:
    if parameter.annotation is None:
        return parameter.name
    written = print_type(parameter.annotation)
    return f"{parameter.name}: {written}" if parameter.name else written


def _group(group: tuple[Parameter, ...]) -> str:
    return f"({', '.join(_parameter(parameter) for parameter in group)})"


def _lambda_group(group: tuple[Parameter, ...]) -> str:
    return group[0].name if len(group) == 1 and group[0].annotation is None else _group(group)


def _list(items: tuple[Expr, ...]) -> str:
    return ", ".join(print_expression(item) for item in items)


def _text(expr: Expr, least: int) -> str:
    """An expression where what binds less tightly than `least` must stand in parentheses."""
    own, text = _form(expr)
    return text if own >= least else f"({text})"


def _form(expr: Expr) -> tuple[int, str]:
    """How tightly an expression binds, and its text."""
    match expr:
        case Number(text=word) | Name(id=word):
            return _ATOM, word
        case Member(path=path, name=name):
            return _ATOM, f"{path}.{name}"
        case ErrorExpr(text=word):
            return _ATOM, word or "…"
        case Paren():
            return _ATOM, f"({_text(expr.inner, _OPEN)})"
        case Tuple(items=items):
            return _ATOM, f"({_list(items)})"
        case Bracket(condition=condition):
            return _ATOM, f"[{_text(condition, _OPEN)}]"
        case ListLiteral(items=items):
            comma = "," if len(items) == 1 else ""
            return _ATOM, f"[{_list(items)}{comma}]"
        case InlineDiffeo(components=components):
            return _ATOM, f"diffeo({_list(components)})"
        case Integral(bounds=bounds, body=body, variables=variables):
            names = ", ".join(variable.name for variable in variables)
            return _ATOM, f"integral {_bounds(bounds)} {_text(body, _OPEN)} d({names})"
        case Reduction(op=word, clauses=clauses, body=body):
            return _ATOM, f"{word} {_clauses(clauses)} {_wrapped(body)}"
        case Fold(targets=targets, start=start, clauses=clauses, body=body):
            return _ATOM, f"fold {_names(targets)} = {_text(start, _OPEN)} for {_clauses(clauses)} {_wrapped(body)}"
        case Comprehension(body=body, clauses=clauses):
            return _ATOM, f"[{_text(body, _OPEN)} for {_clauses(clauses)}]"
        case Index(array=array, indices=indices):
            return _ATOM, f"{_behind(array)}[{_list(indices)}]"
        case Field(value=value, name=name):
            return _ATOM, f"{_behind(value)}.{name}"
        case Text(text=text):
            return _ATOM, f'"{text}"'
        case Apply():
            return _APPLY, _apply(expr)
        case _:
            return _operator_form(expr)


def _operator_form(expr: Power | Unary | Chain | Compare | Logic | If | Lambda | Let | With) -> tuple[int, str]:
    match expr:
        case Power(base=base, exponent=exponent):
            signed = isinstance(exponent, Unary) and exponent.op != "not"
            return _POWER, f"{_text(base, _APPLY)}^{_text(exponent, _UNARY if signed else _POWER)}"
        case Unary(op="not", operand=operand):
            return _NOT, f"not {_text(operand, _NOT)}"
        case Unary(op=op, operand=operand):
            return _UNARY, f"{op}{_text(operand, _UNARY)}"
        case Chain(first=first, rest=rest):
            own = _SUM if rest[0].op in "+-" else _PRODUCT
            return own, _text(first, own + 1) + "".join(f" {o.op} {_text(o.value, own + 1)}" for o in rest)
        case Compare(first=first, rest=rest):
            return _COMPARE, _text(first, _SUM) + "".join(f" {o.op} {_text(o.value, _SUM)}" for o in rest)
        case Logic(op=word, operands=operands):
            own = _OR if word == "or" else _AND
            return own, f" {word} ".join(_text(operand, own + 1) for operand in operands)
        case If(condition=condition, then=then, orelse=orelse, style="if"):
            return _OPEN, f"if {_text(condition, _OPEN)} then {_text(then, _OPEN)} else {_text(orelse, _OPEN)}"
        case If(condition=condition, then=then, orelse=orelse):
            return _OPEN, f"{_text(condition, _OR)} ? {_text(then, _OPEN)} : {_text(orelse, _OPEN)}"
        case Lambda(groups=groups, body=body):
            return _OPEN, f"\\{''.join(f'{_lambda_group(group)} . ' for group in groups)}{_text(body, _OPEN)}"
        case Let(bindings=bindings, body=body):
            return _OPEN, f"let {'; '.join(_binding(b) for b in bindings)} in {_text(body, _OPEN)}"
        case With(record=record, arguments=arguments):
            given = ", ".join(_argument(argument, " = ") for argument in arguments)
            return _OPEN, f"{_text(record, _APPLY)} with {given if len(arguments) == 1 else f'({given})'}"
        case _:
            assert_never(expr)


def _apply(expr: Apply) -> str:
    """A call. `d` is wrapped, since `d(` would end an integral around it."""
    function = _text(expr.function, _APPLY)
    if not expr.parenthesized:
        return f"{function} {_text(expr.arguments[0].value, _ATOM)}"
    if function == "d":
        function = "(d)"
    blank = " " if isinstance(expr.function, Apply) and not expr.function.parenthesized else ""
    return f"{function}{blank}({', '.join(_argument(argument) for argument in expr.arguments)})"


def _clauses(clauses: tuple[Clause, ...]) -> str:
    return ", ".join(f"{clause.variable.name} in {_over(clause.over)}" for clause in clauses)


def _over(over: Range | Expr) -> str:
    if not isinstance(over, Range):
        return _bound(over)
    lo = _bound(over.lo)
    return f"{lo}{' ' if lo.endswith('.') else ''}..{_bound(over.hi)}"


def _wrapped(body: Expr) -> str:
    text = _text(body, _OPEN)
    return text if isinstance(body, Tuple) else f"({text})"


def _names(targets: tuple[Binder, ...]) -> str:
    names = ", ".join(target.name for target in targets)
    return names if len(targets) == 1 else f"({names})"


def _behind(value: Expr) -> str:
    """What a bracket or a field stands directly behind."""
    if isinstance(value, Apply) and value.parenthesized and not isinstance(value.function, Apply):
        return _apply(value)
    plain = isinstance(value, (Name, Member, Paren, Tuple, Index, Field))
    return _text(value, _ATOM) if plain else f"({_text(value, _OPEN)})"


def _size(size: Size) -> str:
    if size.name is None:
        return str(size.offset)
    return size.name + (f" {'-' if size.offset < 0 else '+'} {abs(size.offset)}" if size.offset else "")


def _argument(argument: Argument, equals: str = "=") -> str:
    value = _text(argument.value, _OPEN)
    return value if argument.name is None else f"{argument.name}{equals}{value}"


def _bounds(bounds: tuple[Interval | MeasureBound, ...]) -> str:
    listed = []
    for bound in bounds:
        if isinstance(bound, Interval):
            listed.append(f"[{print_expression(bound.lo)}, {print_expression(bound.hi)}]")
        else:
            listed.append(f"{bound.variable} ~ {_measure(bound)}")
    if len(bounds) == 1 and isinstance(bounds[0], Interval):
        return listed[0]
    return f"({', '.join(listed)})"


_PLACE = re.compile(r"(?<!\w)_(?!\w)")


def _measure(bound: MeasureBound) -> str:
    """The shape with the arguments in their places."""
    first, *rest = _PLACE.split(bound.shape)
    return first + "".join(print_expression(a) + after for a, after in zip(bound.arguments, rest, strict=True))


def _bound(expr: Expr) -> str:
    """A bound of a sum: in parentheses where a `(` in it could be taken for the sum's body."""
    return _text(expr, _SUM) if _plain_bound(expr) else f"({_text(expr, _OPEN)})"


def _plain_bound(expr: Expr) -> bool:
    match expr:
        case Number() | Name() | Member() | Paren():
            return True
        case Field(value=value):
            return _plain_bound(value)
        case Index(array=array):
            return _plain_bound(array)
        case Apply(function=function, parenthesized=parenthesized):
            return parenthesized and isinstance(function, (Name, Member))
        case Chain(first=first, rest=rest):
            return _plain_bound(first) and all(_plain_bound(operand.value) for operand in rest)
        case _:
            return False
