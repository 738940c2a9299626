"""Conditions: comparisons and logic, brackets, diffeomorphisms, and which of them decides a conditional how."""

from __future__ import annotations

from potto.diagnostics import Diagnostic, Related
from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.types import kinds
from potto.types.context import Condition, Inference, rule
from potto.types.infer import value_only
from potto.types.mismatches import comparison, describe, mismatch
from potto.types.scope import Local
from potto.types.types import (
    REAL,
    TRUTH,
    UNKNOWN,
    Diffeo,
    Function,
    Meta,
    Truth,
    TupleOf,
    Type,
    Unknown,
    resolve,
)
from potto.types.unify import unify
from potto.types.vectors import is_vector


@rule(nodes.Unary)
def _unary(inference: Inference, node: nodes.Unary) -> Type:
    if node.op == "not":
        _operand(inference, node, node.operand, "`not`")
        return TRUTH
    found = inference.infer(node.operand)
    if is_vector(found):
        return found
    inference.need_number(found, node.operand, f"what follows `{node.op}`")
    return REAL


@rule(nodes.Compare)
def _compare(inference: Inference, node: nodes.Compare) -> Type:
    inference.comparisons.append(node)
    inference.number(node.first, f"the left of `{node.rest[0].op}`")
    for operand in node.rest:
        inference.number(operand.value, f"the right of `{operand.op}`")
    return TRUTH


@rule(nodes.Logic)
def _logic(inference: Inference, node: nodes.Logic) -> Type:
    for operand in node.operands:
        _operand(inference, node, operand, f"`{node.op}`")
    return TRUTH


@rule(nodes.Bracket)
def _bracket(inference: Inference, node: nodes.Bracket) -> Type:
    _truth(inference, node.condition, "the bracket")
    return REAL


def _operand(inference: Inference, node: nodes.Logic | nodes.Unary, operand: nodes.Expr, where: str) -> None:
    """An operand of `and`, `or`, `not`: in a condition it may be a bracket, elsewhere it is a comparison."""
    inner = without_parentheses(operand)
    if id(node) in inference.mixed:
        if isinstance(inner, nodes.Bracket):
            inference.infer(operand)
            return
        inference.mixed.add(id(inner))
    _truth(inference, operand, where)


def _truth(inference: Inference, expr: nodes.Expr, where: str) -> None:
    found = resolve(inference.infer(expr))
    if isinstance(found, Truth | Unknown):
        return
    bracket = isinstance(without_parentheses(expr), nodes.Bracket | nodes.ListLiteral)
    inference.report(
        kinds.NOT_A_CONDITION(
            expr.span,
            f"{where} needs a comparison, but this is {describe(found)}",
            label="1 or 0, a number" if bracket else "not a comparison",
            help="put the brackets around all of it: `[p and q]`" if bracket else "compare it: `… > 0`",
        )
    )


@rule(nodes.If)
def _if(inference: Inference, node: nodes.If) -> Type:
    _condition(inference, node)
    with inference.at_times():
        then, orelse = inference.infer(node.then), inference.infer(node.orelse)
    if not unify(then, orelse):
        inference.report(mismatch(
            orelse, then, node.orelse, "both branches must be of one type: the second one",
            (Related(node.then.span, "the first one"),),
        ))  # fmt: skip
    plain = inference.conditions.get(id(node)) == "plain"
    for branch, type in ((node.then, then), (node.orelse, orelse)):
        if not plain:
            value_only(inference, type, branch, "a condition that may vary chooses between numbers")
        elif isinstance(resolve(type), Truth):
            inference.report(comparison(branch, "a conditional chooses between numbers or functions"))
    unfit = Truth if plain else Function | Truth
    return UNKNOWN if isinstance(resolve(then), unfit) else then


def _condition(inference: Inference, node: nodes.If) -> None:
    """Infer a condition and find out of which kind it is."""
    expr = without_parentheses(node.condition)
    if isinstance(expr, nodes.Logic | nodes.Unary):
        inference.mixed.add(id(expr))
    found = resolve(inference.infer(node.condition))
    kind: Condition = "plain"
    if isinstance(found, Meta):
        unify(found, Diffeo(None))
    if is_bracket(inference, expr):
        kind = "bracket"
    elif isinstance(found, Diffeo | Meta) or _coordinates(found, expr):
        kind = "diffeo"
    elif not isinstance(found, Truth | Unknown):
        inference.report(_no_condition(found, node.condition))
        kind = "bracket"  # that it varies is not a second mistake
    inference.conditions[id(node)] = kind


def _coordinates(found: Type, expr: nodes.Expr) -> bool:
    """Whether a value can pass for a diffeomorphism's result: a tuple of numbers, but not one that is written out."""
    return isinstance(found, TupleOf) and not isinstance(expr, nodes.Tuple) and unify(found, Diffeo(len(found.items)))


def is_bracket(inference: Inference, expr: nodes.Expr) -> bool:
    """Whether an expression is an Iverson bracket, or a local name for one."""
    for _ in range(len(inference.locals) + 1):
        expr = without_parentheses(expr)
        if isinstance(expr, nodes.Bracket) or id(expr) in inference.brackets:
            return True
        meaning = inference.meanings.get(id(expr))
        if not isinstance(meaning, Local) or meaning.kind != "local" or meaning.value is None:
            return False
        value = without_parentheses(meaning.value)
        if isinstance(value, nodes.Bracket) and not _one_surface(value):
            return False
        expr = value
    return False


def _no_condition(found: Type, expr: nodes.Expr) -> Diagnostic:
    if isinstance(found, TupleOf):
        help = "write `diffeo(…)` for a diffeomorphism that is stated in place"
    elif isinstance(found, Function):
        help = "apply it: `if cond (x, y) c then …`"
    else:
        help = "compare it, `… > 0`, or in brackets where variables of integration take part, `[… > 0]`"
    return kinds.NOT_A_CONDITION(
        expr.span,
        f"a condition is a comparison or a diffeomorphism's result, but this is {describe(found)}",
        label="not a condition",
        help=help,
    )


def _one_surface(bracket: nodes.Bracket) -> bool:
    """Whether a bracket is a single inequality: only such a one can be given a name and still decide a condition."""
    inner = without_parentheses(bracket.condition)
    return isinstance(inner, nodes.Compare) and len(inner.rest) == 1 and inner.rest[0].op not in ("==", "!=")


@rule(nodes.InlineDiffeo)
def _inline(inference: Inference, node: nodes.InlineDiffeo) -> Type:
    for component in node.components:
        inference.number(component, "a coordinate of a diffeomorphism")
    return Diffeo(None if len(node.components) == 1 else len(node.components))
