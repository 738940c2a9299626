"""Comparisons as simpler ones that say the same.

Owns `of_arguments`: a strictly monotone function of one thing against the same of another is the one against the other,
and one over something against one over another is these, with the sign that they have. Owns `by_brackets`: the least of
brackets is their product, the greatest their union, and so for whatever lies between what a bracket chooses from. Owns
`by_signs`: the sign of a product is told by those of its factors.
"""

from __future__ import annotations

from potto.calculus.algebra.ranges import nonnegative, range_of
from potto.calculus.surfaces.domains import ends_of_domain
from potto.core.terms import ONE, Branch, Const, Prim, Term, branch, mul, neg, prim, sub
from potto.primitives import PRIMITIVES


def of_arguments(node: Branch) -> Term:
    """A condition on f(a) - f(b) as one on a - b, or b - a where f falls; the same one where that may say more, beyond
    where f is defined."""
    match node.coordinates:
        case (Prim(op="add", args=(first, Prim(op="neg", args=(second,)))),):
            surface = _of_arguments(first, second)
        case (Prim(op="add", args=(Prim(op="neg", args=(second,)), first)),):
            surface = _of_arguments(first, second)
        case _:
            surface = None
    return node if surface is None else branch((surface,), node.strict, node.then, node.orelse)


def _of_arguments(first: Term, second: Term) -> Term | None:
    """What has the sign of a difference."""
    match first, second:
        case Prim(op="div", args=(one, a)), Prim(op="div", args=(other, b)) if one is ONE and other is ONE:
            return mul(sub(b, a), b) if nonnegative(a) else mul(sub(b, a), a) if nonnegative(b) else None
        case Prim(op=op, args=(a,)), Prim(op=same, args=(b,)) if op == same:
            rises = PRIMITIVES[op].increasing
            defined = not (ends_of_domain(first) or ends_of_domain(second))
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
    """A least or a greatest with a bracket between two numbers in it, where all else lies between these."""
    if not isinstance(term, Prim) or term.op not in ("min", "max"):
        return term
    for place, bracket in enumerate(term.args):
        match bracket:
            case Branch(then=Const(value=then), orelse=Const(value=orelse)):
                others = term.args[:place] + term.args[place + 1 :]
                rest = by_brackets(others[0] if len(others) == 1 else prim(term.op, *others))
                between = range_of(rest)
                lo, hi = sorted((then, orelse))
                if lo <= between.lo and between.hi <= hi:
                    wide = (then > orelse) == (term.op == "min")  # where the bracket holds, the rest decides
                    sides = (rest, bracket.orelse) if wide else (bracket.then, rest)
                    return branch(bracket.coordinates, bracket.strict, *sides)
    return term
