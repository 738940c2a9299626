"""Integrals, and the statements of scripts.

Owns the scoping of bounds: the first variable is the outermost, a bound sees the variables before its own, a measure
names its variable itself.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.diagnostics import Diagnostic
from potto.measures import COMPOSITIONS, MEASURES
from potto.measures.composed import problem
from potto.modules.free import free_references
from potto.reports.near import did_you_mean, instead, near_names
from potto.syntax import nodes
from potto.types import kinds
from potto.types.context import Inference, rule
from potto.types.infer import bindings, escape
from potto.types.mismatches import comparison, describe
from potto.types.scope import Local
from potto.types.types import (
    ANY_SIZE,
    REAL,
    ArrayOf,
    Dist,
    Function,
    Meta,
    Real,
    Truth,
    TupleOf,
    Type,
    Unknown,
    resolve,
)
from potto.types.unify import unify


@rule(nodes.Integral)
def _integral(inference: Inference, node: nodes.Integral) -> Type:
    with inference.scope.inside():
        for place, bounds in enumerate(node.bounds):
            _bounds(inference, node, place, bounds)
        for variable in node.variables[len(node.bounds) :]:
            inference.local(variable, variable.name, variable.span, "variable", REAL)
        inference.integrals += 1
        body = inference.infer(node.body)
        inference.integrals -= 1
    return summed(inference, body, node.body, "the integrand")


Bounds = nodes.Interval | nodes.MeasureBound


def _bounds(inference: Inference, node: nodes.Integral, place: int, bounds: Bounds) -> None:
    later = [variable.name for variable in node.variables[place:]]
    inside = [name for name in later if not (inference.scope.find(name) or inference.outside.find(None, name))]
    parts = (bounds.lo, bounds.hi) if isinstance(bounds, nodes.Interval) else bounds.arguments
    for part in parts:
        if isinstance(part, nodes.Number):
            inference.types[id(part)] = REAL
            continue
        inner = _inner_name(part, inside)
        with inference.scope.inside():
            if inner is not None:
                inference.report(_inner_bound(inner, node))
                for name in inside:
                    inference.scope.bind(Local(name, inner.span, "variable", Unknown()))
            what = "a bound of an integral"
            inference.number(part, what if isinstance(bounds, nodes.Interval) else f"a parameter of `{bounds.measure}`")
    if isinstance(bounds, nodes.MeasureBound):
        _measure(inference, bounds)
    if place < len(node.variables):
        variable = node.variables[place]
        inference.local(variable, variable.name, variable.span, "variable", REAL)


def _inner_name(part: nodes.Expr, inside: Sequence[str]) -> nodes.Name | None:
    """The first use of a variable that is bound only further in."""
    for reference in free_references(part):
        if isinstance(reference, nodes.Name) and reference.id in inside:
            return reference
    return None


def _inner_bound(name: nodes.Name, node: nodes.Integral) -> Diagnostic:
    order = ", ".join(variable.name for variable in node.variables)
    return kinds.INNER_BOUND(
        name.span,
        f"this bound depends on `{name.id}`, which is bound further in",
        label="not known here",
        notes=(f"in `d({order})` the first variable is the outermost; a bound sees only the variables before its own",),
        help="change the order of the bounds and variables, or give the outer name another name",
    )


def _measure(inference: Inference, bounds: nodes.MeasureBound) -> None:
    """Check that a measure exists and has all its parameters."""
    found = problem(bounds.shape)
    if found is None:
        return
    span = (bounds.measure_span, *(span for _, span in bounds.inner))[found.place]
    every = (*MEASURES, *COMPOSITIONS)
    if found.wanted is None:
        near = near_names(found.name, every)
        message = f"there is no measure `{found.name}`"
        known = f"the measures are {', '.join(f'`{name}`' for name in every)}"
        help, suggestions = did_you_mean(near) or known, instead(span, near)
        inference.report(kinds.MEASURE(span, message, label="not a measure", help=help, suggestions=suggestions))
        return
    call = f"{found.name}({', '.join(found.wanted)})"
    if found.name in COMPOSITIONS:
        message, label = f"`{found.name}` is not given the measures that it is made of", "made of measures"
    else:
        wanted = len(found.wanted)
        plural = "s" if wanted != 1 else ""
        message = f"`{found.name}` takes {wanted} parameter{plural}, but is given {found.given}"
        label = f"{found.given} given"
    inference.report(kinds.MEASURE(span, message, label=label, help=f"write `{bounds.variable} ~ {call}`"))


def summed(inference: Inference, type: Type, expr: nodes.Expr, what: str) -> Type:
    """What is integrated or summed is a number, a tuple or an array of such; the type of the whole."""
    found = resolve(type)
    if isinstance(found, Truth):
        inference.report(comparison(expr, f"{what} must be a number"))
        return REAL
    elif isinstance(found, Meta):
        inference.later(lambda: _summed_late(inference, found, expr, what))
    else:
        _summed_late(inference, found, expr, what)
    return type


def _summed_late(inference: Inference, type: Type, expr: nodes.Expr, what: str) -> None:
    found = resolve(type)
    if isinstance(found, Meta):
        unify(found, REAL)
    elif isinstance(found, Function):
        inference.report(escape(expr, f"{what} must be a number, but this is a function"))
    elif isinstance(found, TupleOf):
        for item in found.items:
            _summed_late(inference, item, expr, what)
    elif isinstance(found, ArrayOf):
        _summed_late(inference, found.item, expr, what)
    elif not isinstance(found, Real | Dist | Unknown):
        message = f"{what} must be a number, but this is {describe(found)}"
        inference.report(kinds.LIST_INSIDE(expr.span, message, label=describe(found), help="take it apart first"))


# Scripts


def statement(inference: Inference, node: nodes.Statement) -> None:
    """Infer a statement of a script."""
    match node:
        case nodes.Print(arguments=arguments):
            for argument in arguments:
                _shown(inference, inference.infer(argument), argument)
        case nodes.ExpressionStatement(value=value):
            _shown(inference, inference.infer(value), value)
        case nodes.Binding():
            bindings(inference, (node,))
        case nodes.For():
            _for(inference, node)


def _shown(inference: Inference, type: Type, expr: nodes.Expr) -> None:
    if isinstance(resolve(type), Truth):
        inference.report(comparison(expr, "what is shown is a number, a tuple, an array or a function"))


def _for(inference: Inference, node: nodes.For) -> None:
    item: Type = inference.fresh()
    iterable = inference.infer(node.iterable)
    if not unify(iterable, ArrayOf(ANY_SIZE, item)):
        found = resolve(iterable)
        message = f"`for` goes through an array, but this is {describe(found)}"
        help = "put the items in an array: `for v in [a, b]:`"
        inference.report(kinds.MISMATCH(node.iterable.span, message, label=describe(found), help=help))
        item = Unknown()
    with inference.scope.inside():
        variable = node.variable
        inference.bind(variable, Local(variable.name, variable.span, "loop", item))
        for inner in node.body:
            statement(inference, inner)
