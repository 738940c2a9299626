"""Binders of numbers: integrals, expectations and sums.

The first variable of an integral is the outermost, and a bound sees the variables before its own. A measure gives the
bounds of its variable, its density as a factor, and hints where that is concentrated.
"""

from __future__ import annotations

from potto.core.terms import (
    App,
    Branch,
    Const,
    If,
    Integral,
    Prim,
    Sum,
    Term,
    Tuple,
    branch,
    hole,
    if_,
    mul,
    proj,
    sum_,
    tuple_,
    var,
)
from potto.core.terms import integral as integral_term
from potto.elaborate.context import Elaboration, rule
from potto.elaborate.signatures import dims_of_term
from potto.elaborate.values import Scope, Value
from potto.measures import MEASURES
from potto.syntax import nodes


@rule(nodes.Integral)
def _integral(elaboration: Elaboration, node: nodes.Integral, scope: Scope) -> Value:
    if len(node.bounds) != len(node.variables) or not node.variables:
        return hole("this integral has not as many bounds as variables of integration")
    names: list[str] = []
    bounds: list[tuple[Term, Term]] = []
    hints: list[tuple[Term, ...]] = []
    densities: list[Term] = []
    guards: list[tuple[Term, str]] = []
    for bound, variable in zip(node.bounds, node.variables):
        before = scope
        name, scope = elaboration.bind_number(variable.name, scope)
        if isinstance(bound, nodes.Interval):
            bounds.append((elaboration.term(bound.lo, before), elaboration.term(bound.hi, before)))
            hints.append(())
        else:
            measure, parameters = MEASURES.get(bound.measure), elaboration.terms(bound.arguments, before)
            if measure is None or len(parameters) != len(measure.parameters):
                return hole(f"`{bound.measure}` is not a measure of {len(parameters)} parameters")
            bounds.append(measure.support(*parameters))
            hints.append(measure.hints(*parameters))
            densities.append(measure.density(var(name), *parameters))
            guards += [(valid, f"{bound.measure}: {why}") for valid, why in measure.valid(*parameters)]
        names.append(name)
    body = elaboration.term(node.body, scope)
    if densities:
        body = scaled(elaboration, mul(*densities), body)
    made = elaboration.note(integral_term(tuple(names), tuple(bounds), body, tuple(hints)), node.span)
    for valid, why in reversed(guards):
        if not valid.free & set(names) and not _holds(valid):  # a plain condition cannot vary inside the integral
            made = if_(valid, made, hole(why, measure=True))
    return made


def _holds(condition: Term) -> bool:
    """Whether a condition is seen to hold at once: it compares numbers that are written down."""
    match condition:
        case Prim(op="and", args=args):
            return all(map(_holds, args))
        case Prim(op="lt", args=(Const(value=a), Const(value=b))):
            return a < b
        case Prim(op="le", args=(Const(value=a), Const(value=b))):
            return a <= b
        case _:
            return False


def scaled(elaboration: Elaboration, factor: Term, term: Term) -> Term:
    """`factor * term`, component by component where the term is a tuple."""
    match term:
        case Tuple(items=items):
            return tuple_(scaled(elaboration, factor, item) for item in items)
        case If() if _gives_tuple(elaboration, term):
            return if_(
                term.condition, scaled(elaboration, factor, term.then), scaled(elaboration, factor, term.orelse)
            )
        case Branch() if _gives_tuple(elaboration, term):
            then, orelse = scaled(elaboration, factor, term.then), scaled(elaboration, factor, term.orelse)
            made = branch(term.coordinates, term.strict, then, orelse)
            if term in elaboration.origins:
                elaboration.note(made, elaboration.origins[term])
            return made
        case _:
            dims = dims_of(elaboration, term)
            if dims is None:
                return mul(factor, term)
            return tuple_(scaled(elaboration, factor, proj(term, place)) for place in range(dims))


def dims_of(elaboration: Elaboration, term: Term) -> int | None:
    """The size of the tuple that a term stands for; None for a number or what is not known."""
    while True:
        match term:
            case Tuple(items=items):
                return len(items)
            case If() | Branch():
                term = term.then
            case Integral(body=body) | Sum(body=body):
                term = body
            case App():
                return dims_of_term(elaboration.db, term)
            case _:
                return None


def _gives_tuple(elaboration: Elaboration, term: Term) -> bool:
    return dims_of(elaboration, term) is not None


@rule(nodes.Sum)
def _sum(elaboration: Elaboration, node: nodes.Sum, scope: Scope) -> Value:
    lo, hi = elaboration.term(node.lo, scope), elaboration.term(node.hi, scope)
    name, inner = elaboration.bind_number(node.variable.name, scope)
    return sum_(name, lo, hi, elaboration.term(node.body, inner))
