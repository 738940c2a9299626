"""The types of `deriv(f)` and of `delta(…)`, which no function has."""

from __future__ import annotations

from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.types import kinds
from potto.types.context import Inference
from potto.types.infer import is_known
from potto.types.mismatches import describe
from potto.types.types import REAL, UNKNOWN, Diffeo, Function, Meta, TupleOf, Type, Unknown, resolve
from potto.types.unify import settle, unify


def deriv(inference: Inference, node: nodes.Apply) -> Type:
    if len(node.arguments) != 1 or node.arguments[0].name is not None:
        types = [inference.infer(argument.value) for argument in node.arguments]
        wrong = kinds.TOO_MANY if len(types) > 1 else kinds.MISSING
        message = "`deriv` takes one function"
        inference.report(wrong(node.span, message, label="one function", help="write `deriv(f)`, then apply it"))
        return UNKNOWN
    inner = node.arguments[0].value
    found = resolve(inference.infer(inner))
    if isinstance(found, Unknown):
        return UNKNOWN
    if not isinstance(found, Function | Meta):
        help = "write it as a function of what it depends on: `deriv(\\t . …)`"
        if isinstance(without_parentheses(inner), nodes.Apply):
            help = "differentiate the function and apply the result: `deriv(f)(…)`"
        message = f"`deriv` takes a function, but this is {describe(found)}"
        inference.report(kinds.NOT_A_FUNCTION(inner.span, message, label=describe(found), help=help))
        return UNKNOWN
    if is_known(inference, inner):
        settle(found)
    return inference.dual(found, inner)


def delta(inference: Inference, node: nodes.Apply) -> Type:
    if not node.arguments:
        inference.report(
            kinds.MISSING(node.span, "`delta` needs a surface", label="nothing given", help="write `delta(x - t)`")
        )
    for argument in node.arguments:
        type = resolve(inference.infer(argument.value))
        if len(node.arguments) == 1 and isinstance(type, Diffeo):
            continue
        if len(node.arguments) == 1 and isinstance(type, TupleOf) and unify(type, Diffeo(len(type.items))):
            continue
        inference.need_number(type, argument.value, "what `delta` is of")
    return REAL
