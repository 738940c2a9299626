"""The walk over names, arithmetic, conditions, functions and local names."""

from __future__ import annotations

from collections.abc import Iterable

from potto.source import Span
from potto.syntax import nodes
from potto.syntax.as_written import without_parentheses
from potto.types.algebra import (
    flat,
    join,
    joined,
    merge,
    taint,
)
from potto.types.flow import Surfaces, Walk, walks
from potto.types.flow_arrays import parts_of
from potto.types.flow_calls import builtin_value
from potto.types.rules import nonlinear, product_of_deltas
from potto.types.scope import BuiltinName, InterfaceName, Local, Meaning, RecursiveName
from potto.types.types import UNKNOWN, Unknown
from potto.types.values import (
    HAZY,
    STILL,
    AbstractScalar,
    ListValue,
    Spike,
    Surface,
    TupleValue,
    Value,
)
from potto.types.vectors import is_vector


@walks(nodes.Number)
def _number(walk: Walk, node: nodes.Number) -> Value:
    return STILL


@walks(nodes.ErrorExpr)
def _error(walk: Walk, node: nodes.ErrorExpr) -> Value:
    return HAZY


@walks(nodes.Paren)
def _paren(walk: Walk, node: nodes.Paren) -> Value:
    return walk.value(without_parentheses(node))


@walks(nodes.Name, nodes.Member)
def _name(walk: Walk, node: nodes.Name | nodes.Member) -> Value:
    owner = walk.inference.owners.get(id(node))
    if owner is not None and isinstance(node, nodes.Member):
        return parts_of(walk, _meant(walk, node, owner), node)
    return _meant(walk, node, walk.inference.meanings.get(id(node)))


def _meant(walk: Walk, node: nodes.Name | nodes.Member, meaning: Meaning | None) -> Value:
    if isinstance(meaning, Local):
        value = walk.locals.get(meaning, HAZY)
        walk.places[id(node)] = value
        return value
    match meaning:
        case InterfaceName(target, interface):
            return HAZY if interface.broken else walk.known(target, interface.flow)
        case RecursiveName(target):
            return walk.known(target, walk.members[target])
        case BuiltinName(name):
            return builtin_value(name)
        case _:
            return HAZY


@walks(nodes.Unary)
def _unary(walk: Walk, node: nodes.Unary) -> Value:
    value = walk.value(node.operand)
    return value if is_vector(walk.inference.types.get(id(node), UNKNOWN)) else _scalar(value)


def _scalar(value: Value) -> AbstractScalar:
    return value if isinstance(value, AbstractScalar) else AbstractScalar(flat(value))


@walks(nodes.Chain)
def _chain(walk: Walk, node: nodes.Chain) -> Value:
    if is_vector(walk.inference.types.get(id(node), UNKNOWN)):
        return _vectors(walk, node)
    first = _scalar(walk.value(node.first))
    sources, jumps, spikes = first.sources, first.jumps, first.spikes
    for operand in node.rest:
        if isinstance(operand.value, nodes.Number):
            continue
        value = _scalar(walk.value(operand.value))
        sources = merge(sources, value.sources)
        jumps = jumps | value.jumps if value.jumps else jumps
        if value.spikes:
            if operand.op == "/":
                walk.report(nonlinear(operand.value, "divide by it"))
            elif operand.op == "*" and _same_delta(spikes, value.spikes):
                walk.report(product_of_deltas(operand.value))
            spikes = spikes | value.spikes
    return AbstractScalar(sources, jumps, spikes)


def _vectors(walk: Walk, node: nodes.Chain) -> Value:
    """Component by component: each varies with what it is made of."""
    found = walk.value(node.first)
    for operand in node.rest:
        found = _componentwise(found, walk.value(operand.value))
    return found


def _componentwise(a: Value, b: Value) -> Value:
    match a, b:
        case TupleValue(), TupleValue() if len(a.items) == len(b.items):
            return TupleValue(tuple(map(_componentwise, a.items, b.items)))
        case ListValue(), ListValue():
            return ListValue(_componentwise(a.item, b.item))
        case TupleValue(), _:
            return TupleValue(tuple(_componentwise(item, b) for item in a.items))
        case _, TupleValue():
            return TupleValue(tuple(_componentwise(a, item) for item in b.items))
        case ListValue(), _:
            return ListValue(_componentwise(a.item, b))
        case _, ListValue():
            return ListValue(_componentwise(a, b.item))
        case _:
            return join(_scalar(a), _scalar(b))


def _same_delta(a: frozenset[Spike], b: frozenset[Spike]) -> bool:
    keys = {spike.key for spike in a if spike.key}
    return any(spike.key in keys for spike in b)


@walks(nodes.Power)
def _power(walk: Walk, node: nodes.Power) -> Value:
    base, exponent = _scalar(walk.value(node.base)), _scalar(walk.value(node.exponent))
    if base.spikes:
        walk.report(product_of_deltas(node.base))
    elif exponent.spikes:
        walk.report(nonlinear(node.exponent, "raise to it"))
    return AbstractScalar(merge(base.sources, exponent.sources), base.jumps | exponent.jumps)


@walks(nodes.Compare)
def _compare(walk: Walk, node: nodes.Compare) -> Value:
    """A truth value: its surfaces are those of its comparisons one by one, its `spikes` the equalities."""
    left = _scalar(walk.value(node.first))
    sources, surfaces, equalities = left.sources, set[Surface](), set[Spike]()
    if left.spikes:
        walk.report(nonlinear(node.first, "compare it"))
    for operand in node.rest:
        right = _scalar(walk.value(operand.value))
        if right.spikes:
            walk.report(nonlinear(operand.value, "compare it"))
        both = merge(left.sources, right.sources)
        surface = frozenset(both)
        surfaces |= {surface} if surface else set()
        surfaces |= left.jumps | right.jumps
        if operand.op in ("==", "!="):
            equalities.add(Spike(surface, operand.op))
        sources, left = merge(sources, right.sources), right
    return AbstractScalar(sources, frozenset(surfaces), frozenset(equalities))


@walks(nodes.Logic)
def _logic(walk: Walk, node: nodes.Logic) -> Value:
    return joined(_scalar(walk.value(operand)) for operand in node.operands)


@walks(nodes.Bracket)
def _bracket(walk: Walk, node: nodes.Bracket) -> Value:
    return bracket(walk, node.span, _scalar(walk.value(node.condition)))


def bracket(walk: Walk, span: Span, truth: AbstractScalar) -> AbstractScalar:
    """The number that a truth value in brackets is."""
    for spike in truth.spikes:
        walk.sink("equality", span, AbstractScalar({s: truth.sources.get(s) for s in spike.over}), node=spike.key)
    _met(walk, span, truth.jumps)
    return AbstractScalar(truth.sources, truth.jumps)


def _met(walk: Walk, span: Span, surfaces: Iterable[Surface]) -> None:
    walk.surfaces.extend(Surfaces(span, surface) for surface in surfaces)


@walks(nodes.If)
def _if(walk: Walk, node: nodes.If) -> Value:
    if walk.inference.conditions.get(id(node)) == "plain":
        condition = plain_condition(walk, node.condition)
    else:
        condition = _jumping_condition(walk, node)
    both = join(walk.value(node.then), walk.value(node.orelse))
    return taint(both, condition.sources, condition.jumps)


def _jumping_condition(walk: Walk, node: nodes.If) -> AbstractScalar:
    value = walk.value(node.condition)
    if walk.inference.conditions.get(id(node)) == "bracket":
        return _scalar(value)
    first = _scalar(value.items[0] if isinstance(value, TupleValue) and value.items else value)
    surface = frozenset(first.sources)
    if surface:
        _met(walk, node.condition.span, (surface,))
    return AbstractScalar(flat(value), frozenset((surface,)) if surface else frozenset())


def plain_condition(walk: Walk, expr: nodes.Expr) -> AbstractScalar:
    """The value of a plain condition, each of whose parts must not vary."""
    expr = without_parentheses(expr)
    match expr:
        case nodes.Logic(operands=operands):
            return _scalar(joined(plain_condition(walk, operand) for operand in operands))
        case nodes.Unary(op="not", operand=operand):
            return plain_condition(walk, operand)
        case nodes.Bracket():
            return _scalar(walk.value(expr))
        case _:
            value = _scalar(walk.value(expr))
            walk.sink("condition", expr.span, value, node=expr)
            return AbstractScalar(value.sources)  # what is plain makes no surface


@walks(nodes.InlineDiffeo)
def _inline(walk: Walk, node: nodes.InlineDiffeo) -> Value:
    return TupleValue(tuple(_scalar(walk.value(component)) for component in node.components))


@walks(nodes.Tuple)
def _tuple(walk: Walk, node: nodes.Tuple) -> Value:
    items = tuple(walk.value(item) for item in node.items)
    return HAZY if isinstance(walk.inference.types.get(id(node)), Unknown) else TupleValue(items)  # too large


@walks(nodes.ListLiteral)
def _list(walk: Walk, node: nodes.ListLiteral) -> Value:
    if id(node) in walk.inference.brackets:
        return bracket(walk, node.span, _scalar(walk.value(node.items[0])))
    return ListValue(joined([walk.value(item) for item in node.items]))


@walks(nodes.Lambda)
def _lambda(walk: Walk, node: nodes.Lambda) -> Value:
    return walk.function(node.groups, lambda: walk.value(node.body))


@walks(nodes.Let)
def _let(walk: Walk, node: nodes.Let) -> Value:
    walk.bindings(node.bindings)
    return walk.value(node.body)
