"""Integrals and expectations.

The first variable of an integral is the outermost, and a bound sees the variables before its own. A measure gives the
bounds of its variable, its density as a factor, and hints where that is concentrated; where it is a sum of parts, so is
the integral.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby, product

from potto.core.normal_form import normal_form
from potto.core.terms import (
    ONE,
    ZERO,
    Array,
    Branch,
    If,
    ListOf,
    Prim,
    Term,
    Tuple,
    add,
    array,
    branch,
    hole,
    if_,
    index,
    length,
    mul,
    proj,
    sub,
    substitute,
    tuple_,
    var,
)
from potto.core.terms import integral as integral_term
from potto.elaborate.arrays import combined, shaped
from potto.elaborate.context import Elaboration, rule
from potto.elaborate.shapes import dims_of as size_of_tuple
from potto.elaborate.values import LocalNames, Value
from potto.measures.composed import Component, parts_of, problem
from potto.syntax import nodes
from potto.types.types import ArrayOf, TupleOf, Type, resolve


@rule(nodes.Integral)
def _integral(elaboration: Elaboration, node: nodes.Integral, scope: LocalNames) -> Value:
    if len(node.bounds) != len(node.variables) or not node.variables:
        return hole("this integral does not have as many bounds as variables of integration")
    names: list[str] = []
    choices: list[tuple[Component, ...]] = []  # of each variable, what its measure is the sum of
    for bound, variable in zip(node.bounds, node.variables):
        before = scope
        name, scope = elaboration.bind_number(variable.name, scope)
        if isinstance(bound, nodes.Interval):
            ends = elaboration.term(bound.lo, before), elaboration.term(bound.hi, before)
            choices.append((Component(ONE, ends, (), lambda _: ONE, ()),))
        else:
            if problem(bound.shape) is not None:
                return hole(f"`{bound.measure}` is not a measure of {len(bound.arguments)} parameters")
            choices.append(parts_of(bound.shape, elaboration.terms(bound.arguments, before)))
        names.append(name)
        if all(part.discrete for part in choices[-1]):
            elaboration.counted.add(name)

    def over(body: Term) -> Term:
        made = [_integral_over(elaboration, node, tuple(names), parts, body) for parts in product(*choices)]
        return _summed(elaboration, made)

    whole = _by_parts(elaboration, elaboration.term(node.body, scope), frozenset(names), over)
    every = [guard for parts in choices for part in parts for guard in part.valid]
    guards = dict.fromkeys(reversed(every))
    for valid, why in guards:
        if not valid.free & set(names) and not _holds(valid):  # a plain condition cannot vary inside the integral
            whole = if_(valid, whole, hole(why, measure=True))
    return whole


def _by_parts(elaboration: Elaboration, body: Term, names: frozenset[str], over: Callable[[Term], Term]) -> Term:
    """The integral of what may have parts within its parts: one integral of all numbers that are in no array, and one
    of each array, in the shape of the body. over: makes an integral of numbers side by side, or of an array."""
    shape = elaboration.shapes.of(body)
    if not _has_parts(shape) and (not isinstance(shape, ArrayOf) or isinstance(body, Array | ListOf)):
        return over(body)
    if isinstance(shape, ArrayOf):
        place = elaboration.fresh("i")
        elaboration.numbers.add(place)
        size = length(substitute(body, dict.fromkeys(names, ZERO)))  # which does not vary
        return array(place, size, _by_parts(elaboration, index(body, var(place)), names, over))
    numbers: list[Term] = []

    def gather(part: Term) -> None:
        kind = elaboration.shapes.of(part)
        if isinstance(kind, TupleOf):
            for at in range(len(kind.items)):
                gather(elaboration.part_of(part, at))
        elif not isinstance(kind, ArrayOf):
            numbers.append(part)

    gather(body)
    whole = over(numbers[0] if len(numbers) == 1 else tuple_(numbers)) if numbers else None
    places = iter(range(len(numbers)))

    def built(part: Term) -> Term:
        kind = elaboration.shapes.of(part)
        if isinstance(kind, TupleOf):
            return shaped(elaboration, kind, [built(elaboration.part_of(part, at)) for at in range(len(kind.items))])
        if isinstance(kind, ArrayOf) or whole is None:
            return _by_parts(elaboration, part, names, over)
        return proj(whole, next(places)) if len(numbers) > 1 else whole

    return built(body)


def _has_parts(shape: Type) -> bool:
    """Whether there is more than numbers in a tuple, or in what an array has."""
    if isinstance(shape, ArrayOf):
        return _has_parts(resolve(shape.item))
    return isinstance(shape, TupleOf) and any(isinstance(resolve(item), TupleOf | ArrayOf) for item in shape.items)


def _integral_over(
    elaboration: Elaboration, node: nodes.Integral, names: tuple[str, ...], parts: tuple[Component, ...], body: Term
) -> Term:
    """The body over one part of the measure of each variable: neighbours that are not whole numbers in one integral.

    Weights that vary with none of the variables of an integral stay outside of it.
    """
    for run in reversed([list(found) for _, found in groupby(zip(names, parts, strict=True), _together)]):
        own = {name for name, _ in run}
        inside = [part.density(var(name)) for name, part in run]
        inside += [part.weight for _, part in run if part.weight.free & own]
        outside = mul(*(part.weight for _, part in run if not part.weight.free & own))
        density = mul(*inside)
        body = body if density is ONE else scaled(elaboration, density, body)
        if run[0][1].discrete:
            ((name, part),) = run
            body = part.summed(name, body, dims_of(elaboration, body))
        else:
            bounds, hints = tuple(part.support for _, part in run), tuple(part.hints for _, part in run)
            body = elaboration.note(integral_term(tuple(name for name, _ in run), bounds, body, hints), node.span)
        if outside is not ONE:
            body = elaboration.note(scaled(elaboration, outside, body), node.span)
    return body


def _together(variable: tuple[str, Component]) -> str:
    """What neighbours in one integral have in common; each whole number has a sum of its own."""
    return variable[0] if variable[1].discrete else ""


def _summed(elaboration: Elaboration, terms: list[Term]) -> Term:
    """The sum, component by component where the terms are tuples."""
    if len(terms) == 1:
        return terms[0]
    dims = dims_of(elaboration, terms[0])
    if dims is None:
        return add(*terms)
    return tuple_(add(*(proj(term, place) for term in terms)) for place in range(dims))


def _holds(condition: Term) -> bool:
    """Whether a condition is seen to hold at once: it compares what differs by a number that is written down.

    As of x + 1 > x, which no longer holds in doubles far out in the range of x.
    """
    match condition:
        case Prim(op="and", args=args):
            return all(map(_holds, args))
        case Prim(op="lt" | "le" as op, args=(a, b)):
            gap = normal_form(sub(b, a))  # exact: no double is 0.05 + 0.1
            return (not gap and op == "le") or (gap.keys() == {()} and gap[()] > 0)
        case _:
            return False


def scaled(elaboration: Elaboration, factor: Term, term: Term) -> Term:
    """`factor * term`, component by component where the term is a tuple."""
    match term:
        case Tuple(items=items):
            return tuple_(scaled(elaboration, factor, item) for item in items)
        case If() if _gives_tuple(elaboration, term):
            return if_(term.condition, scaled(elaboration, factor, term.then), scaled(elaboration, factor, term.orelse))
        case Branch() if _gives_tuple(elaboration, term):
            then, orelse = scaled(elaboration, factor, term.then), scaled(elaboration, factor, term.orelse)
            made = branch(term.coordinates, term.strict, then, orelse)
            if term in elaboration.origins:
                elaboration.note(made, elaboration.origins[term])
            return made
        case _:
            return _components(elaboration, factor, term)


def _components(elaboration: Elaboration, factor: Term, term: Term) -> Term:
    shape = elaboration.shapes.of(term)
    if not isinstance(shape, TupleOf) or shape.record is None:
        return combined(elaboration, "*", factor, term)
    fields = [elaboration.field(term, name) for name in shape.record.fields]
    return shaped(elaboration, shape, [scaled(elaboration, factor, part) for part in fields])


def dims_of(elaboration: Elaboration, term: Term) -> int | None:
    """The size of the tuple that a term stands for; None for a number or what is not known."""
    return size_of_tuple(elaboration.shapes.of(term))


def _gives_tuple(elaboration: Elaboration, term: Term) -> bool:
    return dims_of(elaboration, term) is not None
