"""The walk over integrals, and over the statements of scripts."""

from __future__ import annotations

from typing import Literal

from potto.measures.composed import bounding, discrete, problem
from potto.syntax import nodes
from potto.types.algebra import flat, merge, taint, without
from potto.types.flow import Walk, walks
from potto.types.rules import shown_delta
from potto.types.values import HAZY, NONE, AbstractScalar, ListValue, Source, Sources, TupleValue, Value


@walks(nodes.Integral)
def _integral(walk: Walk, node: nodes.Integral) -> Value:
    variables: list[Source] = []
    bounds: Sources = NONE
    for place, bound in enumerate(node.bounds):
        parts = (bound.lo, bound.hi) if isinstance(bound, nodes.Interval) else bound.arguments
        whole = isinstance(bound, nodes.MeasureBound) and problem(bound.shape) is None and discrete(bound.shape)
        ends = bounding(bound.shape) if whole and isinstance(bound, nodes.MeasureBound) else (False,) * len(parts)
        for part, decides in zip(parts, ends, strict=True):
            value = walk.value(part)
            bounds = merge(bounds, flat(value))
            if decides:
                walk.sink("count", part.span, value)
        if place < len(node.variables):
            variables.append(_variable(walk, node.variables[place], "other" if whole else "variable"))
    for binder in node.variables[len(node.bounds) :]:
        variables.append(_variable(walk, binder))
    body = walk.value(node.body)
    own = frozenset(variables)
    result = taint(without(body, own), flat(without(AbstractScalar(bounds), own)))
    walk.sink("integral", node.span, AbstractScalar(flat(result)))
    return result


def _variable(walk: Walk, binder: nodes.Binder, kind: Literal["variable", "other"] = "variable") -> Source:
    """What is integrated over; a measure of whole numbers is summed up, and moves nothing."""
    local = walk.inference.binders[id(binder)]
    source = Source(kind, binder.name, binder.span)
    value = AbstractScalar({source: None})
    walk.locals[local] = value
    walk.places[id(binder)] = value
    return source


def walk_statement(walk: Walk, statement: nodes.Statement) -> None:
    """Walk a statement of a script."""
    match statement:
        case nodes.Print(arguments=arguments):
            for argument in arguments:
                _shown(walk, argument)
        case nodes.ExpressionStatement(value=value):
            _shown(walk, value)
        case nodes.Binding():
            walk.bindings((statement,))
        case nodes.For(variable=variable, iterable=iterable, body=body):
            items = walk.value(iterable)
            local = walk.inference.binders[id(variable)]
            walk.locals[local] = items.item if isinstance(items, ListValue) else HAZY
            for inner in body:
                walk_statement(walk, inner)


def _shown(walk: Walk, expr: nodes.Expr) -> None:
    value = walk.value(expr)
    parts = value.items if isinstance(value, TupleValue) else (value,)
    if any(isinstance(part, AbstractScalar) and part.spikes for part in parts):
        walk.report(shown_delta(expr))
