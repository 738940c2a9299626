"""Comparisons as simpler ones that say the same.

Owns `of_arguments`: a strictly monotone function of one thing against the same of another is the one against the other,
and one over something against one over another is these, with the sign that they have. Owns `by_brackets`: the least of
brackets is their product, the greatest their union, and so for whatever lies between what a bracket chooses from. Owns
`by_signs`: the sign of a product is told by those of its factors.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from potto.calculus.algebra.ranges import nonnegative, range_of
from potto.calculus.surfaces.domains import ends_of_domain
from potto.core.collecting import split
from potto.core.terms import ONE, Branch, Const, Prim, Term, branch, const, mul, neg, prim, sub
from potto.primitives import PRIMITIVES


def of_arguments(node: Branch) -> Term:
    """A condition on k*f(a) - k*f(b) as one on a - b, or b - a where k*f falls; the same one where that may say more,
    beyond where f is defined."""
    match node.coordinates:
        case (Prim(op="add", args=(first, second)),):
            surface = _of_arguments(split(first), split(second))
        case _:
            surface = None
    return node if surface is None else branch((surface,), node.strict, node.then, node.orelse)


def _of_arguments(first: tuple[Fraction, Term], second: tuple[Fraction, Term]) -> Term | None:
    """What has the sign of a sum of two, each a number times a term."""
    if first[0] != -second[0]:
        return None
    above, below = (first[1], second[1]) if first[0] > 0 else (second[1], first[1])
    match above, below:
        case Prim(op="div", args=(one, a)), Prim(op="div", args=(other, b)) if one is ONE and other is ONE:
            return mul(sub(b, a), b) if nonnegative(a) else mul(sub(b, a), a) if nonnegative(b) else None
        case Prim(op=op, args=(a,)), Prim(op=same, args=(b,)) if op == same:
            rises = PRIMITIVES[op].increasing
            defined = not (ends_of_domain(above) or ends_of_domain(below))
            return (sub(a, b) if rises > 0 else sub(b, a)) if rises and defined else None
    return None


def by_signs(node: Term, variables: frozenset[str]) -> Term:
    """A condition on a product as one on a factor, and on the rest on either side of it, where several factors vary
    with some variables: where these are 0 the product turns in no direction, and crosses itself."""
    if not isinstance(node, Branch) or len(node.coordinates) != 1:
        return node
    surface, sign = node.surface, False
    while isinstance(surface, Prim) and surface.op == "neg":
        surface, sign = surface.args[0], not sign
    if not isinstance(surface, Prim) or surface.op != "mul":
        return node
    varying = [arg for arg in surface.args if not arg.free.isdisjoint(variables)]
    still = mul(*(arg for arg in surface.args if arg.free.isdisjoint(variables)))
    if len(set(varying)) < max(2, len(varying)) or any(nonnegative(f) or nonnegative(neg(f)) for f in varying):
        return node
    none = node.orelse if node.strict else node.then  # where a factor is 0
    *others, last = varying
    rest = mul(still, last)
    up, down = (neg(rest), rest) if sign else (rest, neg(rest))
    found = {True: branch((up,), node.strict, node.then, node.orelse),
             False: branch((down,), node.strict, node.then, node.orelse)}  # fmt: skip
    for factor in others:
        found = {side: branch((factor,), True, found[side], branch((neg(factor),), True, found[not side], none))
                 for side in (True, False)}  # fmt: skip
    return found[True]


def by_brackets(term: Term) -> Term:
    """A least or a greatest in which a bracket that chooses between two numbers decides on one of its sides: all else
    is no greater than the greater of these in a greatest, no less than the less in a least. The brackets are asked in
    the order of these numbers, each once."""
    if not isinstance(term, Prim) or term.op not in ("min", "max"):
        return term
    args = [_scaled_in(arg) for arg in term.args]
    brackets = {place: found for place, arg in enumerate(args) if (found := _between_numbers(arg)) is not None}
    if not brackets:
        return term
    greatest = term.op == "max"
    most, least = (max, min) if greatest else (min, max)
    place = most(brackets, key=lambda at: most(brackets[at][1:]))
    bracket, then, orelse = brackets[place]
    decides, other = most(then, orelse), least(then, orelse)
    others = args[:place] + args[place + 1 :]
    ranges = [range_of(arg) for arg in others]
    least_of_others, most_of_others = most(each.lo for each in ranges), most(each.hi for each in ranges)
    if most_of_others > decides if greatest else least_of_others < decides:
        return term
    if other > least_of_others if greatest else other < most_of_others:
        others.append(const(other))
    rest = by_brackets(_extreme(term.op, others))
    sides = (const(decides), rest) if then == decides else (rest, const(decides))
    return branch(bracket.coordinates, bracket.strict, *sides)


def _extreme(op: str, args: Sequence[Term]) -> Term:
    return args[0] if len(args) == 1 else prim(op, *args)


def _scaled_in(term: Term) -> Term:
    """A bracket between numbers that a number scales as one between what these come to."""
    scale, inner = split(term)
    match _between_numbers(inner):
        case (bracket, then, orelse):
            sides = const(float(scale) * then), const(float(scale) * orelse)
            return branch(bracket.coordinates, bracket.strict, *sides)
    return term


def _between_numbers(term: Term) -> tuple[Branch, float, float] | None:
    """A bracket and the two numbers that it chooses between."""
    match term:
        case Branch(then=Const(value=then), orelse=Const(value=orelse)):
            return term, then, orelse
    return None
