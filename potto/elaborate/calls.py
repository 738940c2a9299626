"""Calls: known functions get their arguments by name and place; local ones are evaluated on the spot.

A call of a definition stays a call, one `App` for each group, its arguments in the order of its parameters; so does a
call of what is not known, a parameter. Definitions are never looked into: a term depends on interfaces alone.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.core.terms import (
    App,
    Branch,
    Delta,
    Deriv,
    Global,
    Hole,
    If,
    Integral,
    Lam,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    app,
    hole,
    proj,
    tuple_,
    var,
)
from potto.elaborate import builtins
from potto.elaborate.context import Elaboration, lambdas, rule
from potto.elaborate.filling import Filled, Given, Packed, Spread, fill
from potto.elaborate.signatures import groups_of_term
from potto.elaborate.values import Builtin, Closure, Groups, Partial, Scope, Value, counted
from potto.source import Span
from potto.syntax import nodes

Arguments = Sequence[Given[Value]]


@rule(nodes.Apply)
def _apply(elaboration: Elaboration, node: nodes.Apply, scope: Scope) -> Value:
    function = elaboration.value(node.function, scope)
    given = [Given(argument.name, elaboration.value(argument.value, scope)) for argument in node.arguments]
    return call(elaboration, function, given, node.span)


def call(elaboration: Elaboration, function: Value, given: Arguments, span: Span) -> Value:
    """A function applied to one group of arguments as it is written."""
    match function:
        case Closure():
            return _call_closure(elaboration, function, given, span)
        case Builtin(name):
            if any(argument.name is not None for argument in given):
                return hole(f"the parameters of `{name}` have no names")
            found = builtins.applied(elaboration.db, name, [elaboration.as_term(a.value) for a in given])
            return elaboration.note(found, span) if isinstance(found, Delta) else found
        case Partial(target, groups, before):
            left = tuple(group for group, values in zip(groups, before) if values is None)
            return _call_known(elaboration, target, groups, before, left, given, span)
        case Hole():
            return function
        case Global() | App() | Deriv() | Var() | Proj() | Lam():
            groups = groups_of_term(elaboration.db, function)
            if groups:
                return _call_known(elaboration, function, groups, (None,) * len(groups), groups, given, span)
            return _call_unknown(elaboration, function, given, span)
        case _:
            return hole("this is not a function")


def _call_unknown(elaboration: Elaboration, function: Term, given: Arguments, span: Span) -> Value:
    if any(argument.name is not None for argument in given):
        return hole("the parameters of this function have no names")
    args = tuple(elaboration.as_term(argument.value) for argument in given)
    return elaboration.note(app(function, args), span)


# Terms whose parameters are known


def _call_known(
    elaboration: Elaboration,
    function: Term,
    groups: Groups,
    before: tuple[tuple[Term, ...] | None, ...],
    left: Groups,
    given: Arguments,
    span: Span,
) -> Value:
    """Fill the groups in `left`, which are those without arguments in `before`."""
    filled = fill(left, given, _may_be_tuple(elaboration, given))
    if isinstance(filled, str):
        return hole(filled)
    fillings = iter(_args(elaboration, left, filled))
    now = [values if values is not None else next(fillings) for values in before]
    while now and now[-1] is None:
        now.pop()
    if any(values is None for values in now):
        rest = [*now, *[None] * (len(groups) - len(now))]
        last = max(place for place, values in enumerate(rest) if values is not None)
        return Partial(function, groups[: last + 1], tuple(rest[: last + 1]))
    for values in now:
        assert values is not None
        function = elaboration.note(app(function, values), span)
    return function


def _args(elaboration: Elaboration, groups: Groups, filled: Filled[Value]) -> list[tuple[Term, ...] | None]:
    """The arguments of each group as terms."""
    found: list[tuple[Term, ...] | None] = []
    for group, filling in zip(groups, filled):
        values = None if filling is None else _values(elaboration, len(group), filling)
        found.append(None if values is None else tuple(map(elaboration.as_term, values)))
    return found


def _values(
    elaboration: Elaboration, count: int, filling: tuple[Value, ...] | Spread[Value] | Packed[Value]
) -> tuple[Value, ...]:
    match filling:
        case Spread(value):
            whole = elaboration.as_term(value)
            return tuple(proj(whole, place) for place in range(count))
        case Packed(values):
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


def _call_closure(elaboration: Elaboration, closure: Closure, given: Arguments, span: Span) -> Value:
    own = counted(closure.groups)
    groups = own
    if _reaches_further(closure, given):
        groups = groups_of_term(elaboration.db, elaboration.as_term(closure))
    filled = fill(groups, given, _may_be_tuple(elaboration, given))
    if isinstance(filled, str):
        return hole(filled)
    mine, further = filled[: len(own)], filled[len(own) :]
    values = [
        None if filling is None else _values(elaboration, len(names), filling)
        for names, filling in zip(closure.groups, mine)
    ]
    scope = closure.scope
    for names, given_here in zip(closure.groups, values):
        if given_here is not None:
            scope = scope.bind(dict(zip(names, given_here)))
    left = tuple(names for names, given_here in zip(closure.groups, values) if given_here is None)
    if any(filling is not None for filling in further):
        return _call_further(elaboration, closure, left, scope, (groups[len(own) :], further), span)
    if left:
        return Closure(left, closure.bindings, closure.body, scope)
    key = (closure, tuple(value for group in values for value in group or ()))
    found = elaboration.applied.get(key)  # once for the same arguments, so that sharing is kept
    if found is None:
        found = elaboration.applied[key] = elaboration.body(closure, scope)
    return found


def _call_further(
    elaboration: Elaboration,
    closure: Closure,
    left: tuple[tuple[str, ...], ...],
    scope: Scope,
    further: tuple[Groups, Filled[Value]],
    span: Span,
) -> Value:
    """Go on with the arguments for what the body gives; groups that are left open stand around it."""
    opened = []
    for parameters in left:
        names, scope = elaboration.bind(parameters, scope)
        opened.append(names)
    result = elaboration.body(closure, scope)
    groups, filled = further
    open_groups: list[tuple[str, ...]] = []
    for group, filling in zip(groups, filled):
        if filling is None:
            names = tuple(elaboration.fresh(slot.name or "x") for slot in group)
            open_groups.append(names)
            values: Sequence[Value] = tuple(map(var, names))
        else:
            values = _values(elaboration, len(group), filling)
        result = call(elaboration, result, [Given(None, value) for value in values], span)
    opened += open_groups
    return lambdas(opened, elaboration.as_term(result)) if opened else result


def _reaches_further(closure: Closure, given: Arguments) -> bool:
    """Whether the parameters that a local function has itself may not be all that the arguments are for."""
    names = [name for group in closure.groups for name in group]
    keywords = [argument.name for argument in given if argument.name is not None]
    return len(given) > len(names) or any(keyword not in names for keyword in keywords)
