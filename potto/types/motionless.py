"""Calls of derivatives in which nothing moves: no argument has a tangent, so the tangent of the answer is 0.

Owns the check and `is_derivative`. A plain number may be given for a dual and has tangent 0; where all are plain, a
pair was forgotten. Who cannot be sure is silent: functions and tuples may carry tangents, and so may whatever a
function that was called in part has been given before.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec.structs import replace

from potto.diagnostics import Diagnostic, Suggestion, shortened
from potto.source import NOWHERE
from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.syntax.printer import print_expression
from potto.types import kinds
from potto.types.context import ArgumentPlan, Inference
from potto.types.mismatches import around
from potto.types.scope import BuiltinName, InterfaceName, Local
from potto.types.types import REAL, Dist, Function, Parameter, Real, TupleOf, Type, groups_of, resolve

LONGEST = 60  # characters of a call that a help writes out
MOTIONLESS = "no argument of this derivative has a tangent, so its tangent is 0 everywhere"
_ONE, _ZERO = nodes.Number(NOWHERE, "1", 1.0), nodes.Number(NOWHERE, "0", 0.0)
GENERAL = "give the number that moves as a pair, `(value, tangent)`"


def takes_duals(parameters: Sequence[Parameter]) -> bool:
    """Whether a plain number may be given for one of the parameters where a dual is meant."""
    for parameter in parameters:
        found = parameter.type
        if isinstance(found, Real):
            continue  # most are
        found = resolve(found)
        if isinstance(found, TupleOf) and found.dual:
            return True
    return False


def check_tangents(inference: Inference, node: nodes.Apply) -> None:
    """Report a call of a derivative in which no argument has a tangent. To be asked when all types are known."""
    if isinstance(resolve(inference.types[id(node)]), Function):
        return  # the groups that are open may bring one
    calls, head = _calls(inference, node)
    if not is_derivative(inference, head):
        return
    first: nodes.Expr | None = None
    for call in reversed(calls):
        plan = inference.plans.get(id(call))
        if plan is None or _carries(inference, call, plan):
            return
        if first is None and call.arguments:
            first = call.arguments[0].value
    if first is not None:
        inference.report(_motionless(inference, calls, head, first))


def is_derivative(inference: Inference, expr: nodes.Expr) -> bool:
    """Whether an expression is `deriv(…)` or another name of one, so that all that moves in it are its arguments."""
    while True:
        match expr:
            case nodes.Paren(inner=inner):
                expr = inner
            case nodes.Let(body=body):
                expr = body
            case nodes.Apply():
                return _derives(inference, expr)
            case nodes.Name() | nodes.Member():
                meaning = inference.meanings.get(id(expr))
                if isinstance(meaning, Local) and meaning.kind == "local" and meaning.value is not None:
                    expr = meaning.value
                else:
                    return isinstance(meaning, InterfaceName) and meaning.interface.derivative
            case _:
                return False


def _derives(inference: Inference, node: nodes.Apply) -> bool:
    meaning = inference.meanings.get(id(without_parentheses(node.function)))
    return isinstance(meaning, BuiltinName) and meaning.name == "deriv"


def head_of(inference: Inference, call: nodes.Apply) -> nodes.Expr:
    """What a call, maybe one of several groups of arguments, is of."""
    return _calls(inference, call)[1]


def _calls(inference: Inference, node: nodes.Apply) -> tuple[list[nodes.Apply], nodes.Expr]:
    """The calls of a curried function, the last one first, and what is called."""
    calls: list[nodes.Apply] = []
    head: nodes.Expr = node
    while True:
        head = without_parentheses(head)
        if not isinstance(head, nodes.Apply) or _derives(inference, head):
            return calls, head
        calls.append(head)
        head = head.function


def _carries(inference: Inference, call: nodes.Apply, plan: ArgumentPlan) -> bool:
    """Whether one of the arguments has a tangent, or may have."""
    if any(slots is not None and any(len(slot) > 1 for slot in slots) for slots in plan.groups):
        return True  # several make up one parameter: the value and its tangent
    for argument in call.arguments:
        if id(argument.value) in inference.still:
            continue
        found = resolve(inference.types[id(argument.value)])
        if plan.spread and isinstance(found, TupleOf):
            if not all(_is_plain(item) for item in found.items):
                return True
        elif not _is_plain(found):
            return True
    return False


def _is_plain(type: Type) -> bool:
    return isinstance(resolve(type), Real | Dist)


def _motionless(inference: Inference, calls: Sequence[nodes.Apply], head: nodes.Expr, first: nodes.Expr) -> Diagnostic:
    innermost = calls[-1]
    plan = inference.plans[id(innermost)]
    first = without_parentheses(first)
    if plan.spread and isinstance(first, nodes.Tuple):
        first = first.items[0]
    several = sum(len(call.arguments) for call in calls) > 1 or plan.spread
    stand = any(id(argument.value) in inference.still for call in calls for argument in call.arguments)
    moved = None if stand else _moving(first, inference.types[id(head)])
    text = "" if moved is None else _written(calls, head, first, moved)
    if not text or len(text) > LONGEST or "\n" in text:
        help = GENERAL
    else:
        help = f"for the derivative by the first write `{text}`" if several else f"write `{text}`"
    label = "as all others, without a tangent" if several else "a plain number has the tangent 0"
    suggestions = () if moved is None else (_paired(first, moved, calls),)
    return kinds.NO_TANGENT(first.span, MOTIONLESS, label=label, help=help, suggestions=suggestions)


def _paired(first: nodes.Expr, moved: nodes.Expr, calls: Sequence[nodes.Apply]) -> Suggestion:
    """The number with its tangent; in parentheses of its own where it is an argument without any."""
    twice = isinstance(moved, nodes.Tuple) and isinstance(moved.items[0], nodes.Tuple)
    before, behind = ("((", ", 1), (1, 0))") if twice else ("(", ", 1)")
    bare = any(not c.parenthesized and any(a.value is first for a in c.arguments) for c in calls)
    if bare:
        before, behind = f"({before}", f"{behind})"
    return around(first.span, before, behind, f"Write `{shortened(print_expression(moved))}`")


def _moving(first: nodes.Expr, derivative: Type) -> nodes.Expr | None:
    """A number with the tangent 1; in a second derivative with both. None where there are more."""
    groups = groups_of(derivative)
    type = resolve(groups[0][0].type) if groups and groups[0] else REAL
    depth = 0
    while isinstance(type, TupleOf):
        type, depth = resolve(type.items[0]), depth + 1
    pair = nodes.Tuple(first.span, (first, _ONE))
    if depth == 1:
        return pair
    return nodes.Tuple(first.span, (pair, nodes.Tuple(NOWHERE, (_ONE, _ZERO)))) if depth == 2 else None


def _written(calls: Sequence[nodes.Apply], head: nodes.Expr, first: nodes.Expr, moved: nodes.Expr) -> str:
    """The call with its first argument moving."""

    def changed(value: nodes.Expr) -> nodes.Expr:
        inner = without_parentheses(value)
        if inner is first:
            return moved
        if isinstance(inner, nodes.Tuple) and any(item is first for item in inner.items):
            return replace(inner, items=tuple(moved if item is first else item for item in inner.items))
        return value

    made = head
    for call in reversed(calls):
        arguments = tuple(replace(argument, value=changed(argument.value)) for argument in call.arguments)
        made = nodes.Apply(call.span, made, arguments, True)
    return print_expression(made)
