"""What each kind of expression elaborates to: numbers, names, arithmetic, conditions, tuples, functions, local names.

Calls are in `calls`, binders of numbers (integrals, sums) in `binders`.
"""

from __future__ import annotations

from potto.core.terms import (
    ONE,
    ZERO,
    Hole,
    If,
    Prim,
    Term,
    add,
    const,
    div,
    hole,
    list_of,
    mul,
    neg,
    pow_,
    prim,
    tuple_,
)
from potto.elaborate.arrays import combined, negated
from potto.elaborate.conditions import choose, compare, is_truth, logic
from potto.elaborate.context import Elaboration, rule
from potto.elaborate.shapes import is_vector
from potto.elaborate.values import LocalFunction, LocalNames, Value, annotated
from potto.syntax import nodes


@rule(nodes.Number)
def _number(elaboration: Elaboration, node: nodes.Number, scope: LocalNames) -> Value:
    return const(node.value)


@rule(nodes.ErrorExpr)
def _error(elaboration: Elaboration, node: nodes.ErrorExpr, scope: LocalNames) -> Value:
    return hole("this could not be read")


@rule(nodes.Paren)
def _paren(elaboration: Elaboration, node: nodes.Paren, scope: LocalNames) -> Value:
    return elaboration.value(node.inner, scope)


@rule(nodes.Name)
def _name(elaboration: Elaboration, node: nodes.Name, scope: LocalNames) -> Value:
    return elaboration.name(node.id, scope)


@rule(nodes.Member)
def _member(elaboration: Elaboration, node: nodes.Member, scope: LocalNames) -> Value:
    return elaboration.member(node.path, node.name, scope)


# Arithmetic


@rule(nodes.Unary)
def _unary(elaboration: Elaboration, node: nodes.Unary, scope: LocalNames) -> Value:
    operand = elaboration.term(node.operand, scope)
    match node.op:
        case "-":
            return negated(elaboration, operand)
        case "+":
            return operand
        case "not":
            return _placed(elaboration, prim("not", operand), node)


@rule(nodes.Chain)
def _chain(elaboration: Elaboration, node: nodes.Chain, scope: LocalNames) -> Value:
    first = elaboration.term(node.first, scope)
    rest = [(operand.op, elaboration.term(operand.value, scope)) for operand in node.rest]
    if any(is_vector(elaboration.shapes.of(term)) for term in (first, *(term for _, term in rest))):
        for op, term in rest:
            first = elaboration.note(combined(elaboration, op, first, term), node.span)
        return first
    if node.rest[0].op in "+-":
        if len(rest) == 1 and rest[0][0] == "-" and rest[0][1] is first:
            return prim("add", first, neg(first))  # not 0 where it is not finite
        return add(first, *(neg(term) if op == "-" else term for op, term in rest))
    factors = [first]
    for op, term in rest:
        if op == "*":
            factors.append(term)
        else:
            factors = [div(mul(*factors), term)]
    return mul(*factors)


@rule(nodes.Power)
def _power(elaboration: Elaboration, node: nodes.Power, scope: LocalNames) -> Value:
    return pow_(elaboration.term(node.base, scope), elaboration.term(node.exponent, scope))


# Conditions


@rule(nodes.Compare)
def _compare(elaboration: Elaboration, node: nodes.Compare, scope: LocalNames) -> Value:
    left = elaboration.term(node.first, scope)
    start, parts = node.first.span, []
    for operand in node.rest:
        right = elaboration.term(operand.value, scope)
        part = compare(operand.op, left, right)
        elaboration.places.setdefault(part, start.cover(operand.value.span))
        parts.append(part)
        left, start = right, operand.value.span
    return logic("and", parts)


@rule(nodes.Logic)
def _logic(elaboration: Elaboration, node: nodes.Logic, scope: LocalNames) -> Value:
    return logic(node.op, list(elaboration.terms(node.operands, scope)))


def _placed(elaboration: Elaboration, condition: Prim, node: nodes.Expr) -> Term:
    elaboration.places.setdefault(condition, node.span)
    return condition


@rule(nodes.Bracket)
def _bracket(elaboration: Elaboration, node: nodes.Bracket, scope: LocalNames) -> Value:
    return _iverson(elaboration, elaboration.term(node.condition, scope), node)


def _iverson(elaboration: Elaboration, condition: Term, node: nodes.Bracket | nodes.ListLiteral) -> Term:
    if isinstance(condition, Hole):
        return condition
    return choose(condition, ONE, ZERO, True, elaboration.noting(node.span), elaboration.counted)


@rule(nodes.If)
def _if(elaboration: Elaboration, node: nodes.If, scope: LocalNames) -> Value:
    condition = elaboration.term(node.condition, scope)
    then, orelse = elaboration.term(node.then, scope), elaboration.term(node.orelse, scope)
    made = choose(condition, then, orelse, False, elaboration.noting(node.condition.span))
    return elaboration.note(made, node.condition.span) if isinstance(made, If) else made


@rule(nodes.InlineDiffeo)
def _inline(elaboration: Elaboration, node: nodes.InlineDiffeo, scope: LocalNames) -> Value:
    return tuple_(elaboration.terms(node.components, scope))


# Composites


@rule(nodes.Tuple)
def _tuple(elaboration: Elaboration, node: nodes.Tuple, scope: LocalNames) -> Value:
    return tuple_(elaboration.terms(node.items, scope))


@rule(nodes.ListLiteral)
def _list(elaboration: Elaboration, node: nodes.ListLiteral, scope: LocalNames) -> Value:
    items = elaboration.terms(node.items, scope)
    if len(items) == 1 and is_truth(items[0]):  # `[p]` with a local name p for a comparison
        return _iverson(elaboration, items[0], node)
    return list_of(items)


# Functions and local names


@rule(nodes.Lambda)
def _lambda(elaboration: Elaboration, node: nodes.Lambda, scope: LocalNames) -> Value:
    groups = tuple(tuple(parameter.name for parameter in group) for group in node.groups)
    return LocalFunction(groups, (), node.body, scope, annotated(node.groups))


@rule(nodes.Let)
def _let(elaboration: Elaboration, node: nodes.Let, scope: LocalNames) -> Value:
    return elaboration.value(node.body, elaboration.block(node.bindings, scope))
