"""`D(f)`, `D(f, c)` and `grad(f, a, b)`: derivatives that take plain numbers. Their types, and what is said of misuse.

What follows the name of the function are names of its parameters, not values. `D` is by one number and has the type of
the function; `grad` gives a derivative for each number of the parameters, in their shape.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.diagnostics import Diagnostic
from potto.reports.near import did_you_mean, instead, near_names
from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.types import kinds
from potto.types.context import Inference
from potto.types.infer import is_known
from potto.types.mismatches import describe
from potto.types.types import (
    REAL,
    UNKNOWN,
    ArrayOf,
    Diffeo,
    Function,
    Meta,
    Parameter,
    Real,
    TupleOf,
    Type,
    Unknown,
    function,
    groups_of,
    holds_functions,
    resolve,
    result_of,
)
from potto.types.unify import settle, unify


def slope(inference: Inference, node: nodes.Apply, form: str) -> Type:
    """The type of `D(f, …)` or `grad(f, …)`."""
    if not node.arguments or any(argument.name is not None for argument in node.arguments):
        message = f"`{form}` takes a function, and names of parameters without `=`"
        inference.report(kinds.MISSING(node.span, message, label="a function", help=f"write `{form}(f)`"))
        return UNKNOWN
    inner = node.arguments[0].value
    found = resolve(inference.infer(inner))
    if isinstance(found, Unknown):
        return UNKNOWN
    if isinstance(found, Meta):  # a parameter that is a function: of one number
        unify(found, Function((Parameter(None, REAL),), REAL))
        found = resolve(found)
    if not isinstance(found, Function):
        inference.report(_no_function(inner, form, found))
        return UNKNOWN
    if is_known(inference, inner):
        settle(found)
    groups = groups_of(found)
    chosen = _chosen(inference, node, form, [parameter for group in groups for parameter in group])
    if chosen is None:
        return UNKNOWN
    result = result_of(found)
    if form == "D":
        return found
    inference.later(lambda: _one_number(inference, inner, result))
    return function(groups, chosen[0] if len(chosen) == 1 else TupleOf(tuple(chosen)))


def _no_function(inner: nodes.Expr, form: str, found: Type) -> Diagnostic:
    help = f"write it as a function of what it depends on: `{form}(\\t . …)`"
    if isinstance(without_parentheses(inner), nodes.Apply):
        help = f"differentiate the function and apply the result: `{form}(f)(…)`"
    message = f"`{form}` takes a function, but this is {describe(found)}"
    return kinds.NOT_A_FUNCTION(inner.span, message, label=describe(found), help=help)


def _one_number(inference: Inference, inner: nodes.Expr, result: Type) -> None:
    found = resolve(result)
    if isinstance(found, TupleOf | ArrayOf):
        message = f"`grad` takes a function that gives one number, but this one gives {describe(found)}"
        help = "`D(f, c)` is the derivative of all of it by one parameter"
        inference.report(kinds.MISMATCH(inner.span, message, label=f"gives {describe(found)}", help=help))


def _chosen(inference: Inference, node: nodes.Apply, form: str, parameters: Sequence[Parameter]) -> list[Type] | None:
    """The types of the parameters that it is differentiated by; None if that was reported to be impossible."""
    named = node.arguments[1:]
    if form == "D" and len(named) > 1:
        span = named[1].span.cover(named[-1].span)
        help = "`grad(f, a, b)` gives the derivatives by several"
        inference.report(kinds.TOO_MANY(span, "`D` differentiates by one parameter", label="one too many", help=help))
        return None
    if not named:
        return _unnamed(inference, node, form, parameters)
    found = list[Type]()
    for argument in named:
        parameter = _named(inference, argument, form, parameters)
        if parameter is None or not _may_move(inference, argument.value, form, parameter):
            return None
        found.append(parameter.type)
    return found


def _unnamed(inference: Inference, node: nodes.Apply, form: str, parameters: Sequence[Parameter]) -> list[Type] | None:
    """The first parameter, or for a gradient all that are not functions."""
    if form == "D":
        first = parameters[:1]
        fine = first and _may_move(inference, node.arguments[0].value, form, first[0])
        return [first[0].type] if fine else None
    moving = [p.type for p in parameters if not holds_functions(p.type)]
    for type in moving:
        _number_unless_known(type)
    if not moving:
        message = "every parameter of this function is a function or holds one: there is no number to differentiate by"
        inference.report(kinds.MISMATCH(node.arguments[0].value.span, message, label="no parameter that is a number"))
    return moving or None


def _named(
    inference: Inference, argument: nodes.Argument, form: str, parameters: Sequence[Parameter]
) -> Parameter | None:
    names = [parameter.name for parameter in parameters if parameter.name]
    written = without_parentheses(argument.value)
    if not isinstance(written, nodes.Name):
        help = f"the numbers go to the function that it makes: `{form}(f, c)(0.3)`" if names else ""
        message = f"what follows the function in `{form}(…)` is the name of a parameter"
        inference.report(kinds.UNKNOWN_KEYWORD(written.span, message, label="not a name", help=help))
        return None
    for parameter in parameters:
        if parameter.name == written.id:
            return parameter
    near = near_names(written.id, names)
    has = "it has " + ", ".join(f"`{name}`" for name in names) if names else "its parameters have no names"
    message = f"the function has no parameter `{written.id}` to differentiate by"
    help, suggestions = did_you_mean(near) or has, instead(written.span, near)
    inference.report(
        kinds.UNKNOWN_KEYWORD(written.span, message, label="no such parameter", help=help, suggestions=suggestions)
    )
    return None


def _may_move(inference: Inference, at: nodes.Expr, form: str, parameter: Parameter) -> bool:
    """Whether it can be differentiated by the parameter; reported if not."""
    name = f"`{parameter.name}`" if parameter.name else "its first parameter"
    found = resolve(parameter.type)
    if isinstance(found, Meta):
        _number_unless_known(found)
        return True
    if holds_functions(found):
        is_one = "is a function" if isinstance(found, Function | Diffeo) else "holds a function"
        message, help = f"{name} {is_one}, and derivatives are taken by numbers", f"name a number: `{form}(f, c)`"
    elif form == "D" and not isinstance(found, Real | Unknown):
        message = f"`D` differentiates by one number, but {name} is {describe(found)}"
        shown = f"grad(f, {parameter.name})" if parameter.name else "grad(f)"
        help = f"`{shown}` gives a derivative for each number in it"
    else:
        return True
    inference.report(kinds.MISMATCH(at.span, message, label=describe(found), help=help))
    return False


def _number_unless_known(type: Type) -> None:
    """What nothing else has told by now is a number."""
    if isinstance(resolve(type), Meta):
        unify(type, REAL)
