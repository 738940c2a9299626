"""Calls: known functions get their arguments by name and place; local ones are evaluated on the spot.

A call of a definition stays a call, one `App` for each group, its arguments in the order of its parameters; so does a
call of what is not known, a parameter. Definitions are never looked into: a term depends on interfaces alone.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.core.terms import (
    ZERO,
    App,
    Branch,
    Const,
    Delta,
    Deriv,
    Global,
    Hole,
    If,
    Index,
    Integral,
    Lam,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    app,
    hole,
    if_,
    proj,
    tuple_,
)
from potto.elaborate import builtins
from potto.elaborate.arrays import as_long_as, loaded, of_vectors, standing
from potto.elaborate.context import Elaboration, rule
from potto.elaborate.filling import Filling, GivenArgument, Spread, TupleArgument, fill
from potto.elaborate.lookups import image, interp
from potto.elaborate.signatures import groups_of_term, unnamed
from potto.elaborate.slopes import slope
from potto.elaborate.values import BuiltinValue, Groups, LocalFunction, LocalNames, Value, counted
from potto.modules.builtins import DERIVATIVES, VECTORS
from potto.source import Span
from potto.syntax import nodes
from potto.types.still import is_dual, lacks_tangents
from potto.types.types import ArrayOf, SizeVar, Type, resolve

Arguments = Sequence[GivenArgument[Value]]


@rule(nodes.Apply)
def _apply(elaboration: Elaboration, node: nodes.Apply, scope: LocalNames) -> Value:
    only = node.arguments[0].value if len(node.arguments) == 1 else None
    if isinstance(only, nodes.Text) and elaboration.value(node.function, scope) == BuiltinValue("load"):
        return loaded(elaboration, only.text)
    function = elaboration.value(node.function, scope)
    if isinstance(function, BuiltinValue) and function.name in DERIVATIVES and node.arguments:
        return slope(elaboration, function.name, node, elaboration.value(node.arguments[0].value, scope))
    given: list[GivenArgument[Value]] = [
        GivenArgument(a.name, elaboration.value(a.value, scope)) for a in node.arguments
    ]
    return call(elaboration, function, given, node.span)


def call(elaboration: Elaboration, function: Value, given: Arguments, span: Span) -> Value:
    """A function applied to one group of arguments as it is written."""
    match function:
        case LocalFunction():
            return _call_closure(elaboration, function, given, span)
        case BuiltinValue(name=name):
            if any(argument.name is not None for argument in given):
                return hole(f"the parameters of `{name}` have no names")
            if name in VECTORS:
                args = [elaboration.as_term(argument.value) for argument in given]
                look_up = {"interp": interp, "image": image}.get(name)
                if look_up is None:
                    return elaboration.note(of_vectors(elaboration, name, args), span)
                if len(args) != 3:
                    return hole(f"`{name}` takes three arguments")
                return elaboration.note(look_up(elaboration, *args), span)
            found = builtins.applied(elaboration.db, name, [elaboration.as_term(a.value) for a in given])
            return elaboration.note(found, span) if isinstance(found, Delta) else found
        case Hole():
            return function
        case If(condition=condition, then=then, orelse=orelse):
            return if_(
                condition, elaboration.as_term(call(elaboration, then, given, span)),
                elaboration.as_term(call(elaboration, orelse, given, span)),
            )  # fmt: skip
        case Global() | App() | Deriv() | Var() | Proj() | Index() | Lam():
            groups = groups_of_term(elaboration.db, function, any(argument.name is not None for argument in given))
            if groups:
                return _call_known(elaboration, function, groups, given, span)
            return _call_unknown(elaboration, function, given, span)
        case _:
            return hole("this is not a function")


def _call_unknown(elaboration: Elaboration, function: Term, given: Arguments, span: Span) -> Value:
    if any(argument.name is not None for argument in given):
        return hole("the parameters of this function have no names")
    args = tuple(elaboration.as_term(argument.value) for argument in given)
    return elaboration.note(app(function, args), span)


# Terms whose parameters are known


def _call_known(elaboration: Elaboration, function: Term, groups: Groups, given: Arguments, span: Span) -> Value:
    filled = fill(groups, given, _may_be_tuple(elaboration, given))
    if isinstance(filled, str):
        return hole(filled)
    for group, filling in zip(groups, filled):
        args = tuple(map(elaboration.as_term, _values(elaboration, len(group), filling)))
        if not isinstance(filling, Spread | TupleArgument):
            args = _with_tangents(elaboration, function, _of_one_size(elaboration, function, args))
        elaboration.shapes.meets_records |= elaboration.shapes.makes_record(function)
        function = elaboration.note(app(function, args), span)
    return function


def _of_one_size(elaboration: Elaboration, function: Term, args: tuple[Term, ...]) -> tuple[Term, ...]:
    """The arguments; arrays that must be of one size are seen to be when they are met, where types leave it open."""
    expected = elaboration.shapes.parameters(function) if len(args) > 1 and isinstance(function, Global) else ()
    first: dict[Type, Term] = {}
    found = list(args)
    for place, (arg, type) in enumerate(zip(args, map(resolve, expected))):
        size = resolve(type.size) if isinstance(type, ArrayOf) else None
        if isinstance(size, SizeVar) and first.setdefault(size, arg) is not arg:
            found[place] = as_long_as(elaboration, arg, first[size])
    return tuple(found)


def _with_tangents(elaboration: Elaboration, function: Term, args: tuple[Term, ...]) -> tuple[Term, ...]:
    """The arguments of a derivative; numbers, tuples and records that are given without tangents with those that are
    0."""
    head = function
    while isinstance(head, App):
        head = head.function
    if isinstance(head, Global):
        known = unnamed(elaboration.db, head.module, head.name)
        if known is None or not known.derivative:
            return args
    elif not (isinstance(head, Deriv) and isinstance(head.function, Global)):
        return args
    expected = elaboration.shapes.parameters(function)
    if len(expected) != len(args):
        return args
    found = list(args)
    for place, (arg, wanted) in enumerate(zip(args, expected)):
        if lacks_tangents(given := elaboration.shapes.of(arg), wanted):
            found[place] = standing(elaboration, arg, given)
        elif is_dual(wanted) and _is_number(elaboration, arg):
            found[place] = tuple_((arg, ZERO))
    return tuple(found)


def _is_number(elaboration: Elaboration, arg: Term) -> bool:
    """Whether a term is a number by its form; others may be duals."""
    return isinstance(arg, Const | Prim | Sum | Integral) or (isinstance(arg, Var) and arg.name in elaboration.numbers)


def _values(elaboration: Elaboration, count: int, filling: Filling[Value]) -> tuple[Value, ...]:
    """What the parameters of one group get."""
    match filling:
        case Spread(value=value):
            whole = elaboration.as_term(value)
            if isinstance(whole, Tuple) and len(whole.items) != count:
                return (hole(f"{count} parameters for a tuple of {len(whole.items)}"),) * count
            return tuple(proj(whole, place) for place in range(count))
        case TupleArgument(values=values):
            return (tuple_(map(elaboration.as_term, values)),)
        case _:
            return filling


def _may_be_tuple(elaboration: Elaboration, given: Arguments) -> bool:
    """Whether an only argument is a tuple, or something of which that is not known."""
    if len(given) != 1:
        return False
    value = given[0].value
    if isinstance(value, Var):
        return value.name not in elaboration.numbers
    return isinstance(value, Tuple | App | Proj | Global) or _is_choice(value)


def _is_choice(value: Value) -> bool:
    while isinstance(value, If | Branch):
        value = value.then
    return isinstance(value, Tuple | App | Integral | Sum)


# Local functions


def _call_closure(elaboration: Elaboration, closure: LocalFunction, given: Arguments, span: Span) -> Value:
    own = len(closure.groups)
    groups = counted(closure.groups)
    if _reaches_further(closure, given):
        groups = groups_of_term(elaboration.db, elaboration.as_term(closure))
    filled = fill(groups, given, _may_be_tuple(elaboration, given))
    if isinstance(filled, str):
        return hole(filled)
    scope, arguments = closure.scope, list[Value]()
    for names, filling in zip(closure.groups, filled):
        values = _values(elaboration, len(names), filling)
        scope = scope.bind(dict(zip(names, values)))
        arguments += values
    if len(filled) < own:
        return LocalFunction(closure.groups[len(filled) :], closure.bindings, closure.body, scope, closure.annotated)
    key = (closure, tuple(arguments))
    result = elaboration.applied.get(key)  # once for the same arguments, so that sharing is kept
    if result is None:
        result = elaboration.applied[key] = elaboration.body(closure, scope)
    for group, filling in zip(groups[own:], filled[own:]):
        values = _values(elaboration, len(group), filling)
        result = call(elaboration, result, [GivenArgument(None, value) for value in values], span)
    return result


def _reaches_further(closure: LocalFunction, given: Arguments) -> bool:
    """Whether the parameters that a local function has itself may not be all that the arguments are for."""
    names = [name for group in closure.groups for name in group]
    keywords = [argument.name for argument in given if argument.name is not None]
    return len(given) > len(names) or any(keyword not in names for keyword in keywords)
