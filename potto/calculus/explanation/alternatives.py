"""A choice between two formulas, told in one.

Owns `in_one`, `sums_of_choices` and `holds`: the side that a known condition takes, what both sides share in front of
the choice, a function of abs(u) where the sign of u chooses between one of u and the same of -u, and what a sum comes
to on either side of a condition that chooses in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction

from potto.calculus.algebra.ranges import Box, range_of
from potto.calculus.algebra.rational_form import equal
from potto.calculus.explanation.brackets import constant, turned_round
from potto.calculus.explanation.factors import Factors, factored
from potto.calculus.explanation.products import is_negative, written
from potto.core.terms import (
    ONE,
    ZERO,
    Branch,
    Const,
    If,
    Prim,
    Term,
    Tuple,
    add,
    branch,
    children,
    mul,
    neg,
    postorder,
    prim,
    rebuild,
    sub,
    transform,
)

Cost = Callable[[Term], float]


def in_one(node: If | Branch, tangents: frozenset[str], inside: frozenset[str], cost: Cost) -> Term:
    """The shortest way to write a choice. inside: variables on which no sign may depend."""
    known = holds(node.condition) if isinstance(node, If) else None
    if known is not None:
        return node.then if known else node.orelse
    apart = _apart(node, tangents)
    if isinstance(node, Branch) and len(node.coordinates) == 1:
        if (whole := _of_size(node, tangents, inside)) is not None:
            return min(node, whole, key=cost)
        if (whole := _of_sign(node, tangents)) is not None:
            return min(whole, apart, node, key=cost)
    return min(node, apart, key=cost)


def holds(condition: Term, box: Box | None = None) -> bool | None:
    """Whether a comparison of numbers holds, or that two things are equal whose difference is never 0; None where it is
    one of something else: u == u asks whether u has a value. box: the ranges of variables."""
    match condition:
        case Prim(op="eq" | "lt" | "le" as op, args=(a, b)):
            value = None if condition.free else constant(sub(a, b))
            if value is not None:
                return value == 0 if op == "eq" else value < 0 or (op == "le" and value == 0)
            if op == "eq" and a is not b and not range_of(sub(a, b), box).zero:
                return False
    return None


def _apart(node: If | Branch, tangents: frozenset[str]) -> Term:
    """With the factors that both sides have in front of the choice."""
    if ZERO in (node.then, node.orelse):
        return node
    one, other = factored(node.then), factored(node.orelse)
    shared = one.shared_with(other)
    alike = abs(one.coefficient) == abs(other.coefficient)
    if not (shared.powers or shared.exponents or shared.conditions or (alike and abs(one.coefficient) != 1)):
        return node
    if alike:
        shared.coefficient = max(one.coefficient, other.coefficient)
    elif one.coefficient < 0 and other.coefficient < 0:
        shared.coefficient = Fraction(-1)
    sides = [written(side.without(shared), tangents) for side in (one, other)]
    choice = sides[0] if sides[0] == sides[1] else _choosing(node, *sides)
    shared.times(choice, 1)
    return written(shared, tangents)


def sums_of_choices(node: Prim, tangents: frozenset[str]) -> Iterator[tuple[If | Branch, Term, Term, Term]]:
    """A choice in a sum, with what summands come to on either side of it, and the others: first of those summands that
    choose by the same condition, then of all. What a bracket is taken from, 1 - [x < t], it chooses as well."""
    if (bracket := _taken_from_one(node)) is not None:
        yield bracket, ZERO, node.args[0] if isinstance(node.args[0], Const) else node.args[1], ZERO
        return
    parts = [(arg, *_chosen(arg, tangents)) for arg in node.args]
    first = next((choice for _, choice, _ in parts if choice is not None), None)
    if first is None:
        return
    alike = [part for part in parts if part[1] is not None and _asked(part[1]) == _asked(first)]
    others = [part[0] for part in parts if part not in alike]
    then, orelse = (
        add(*(mul(rest, choice.then if taken else choice.orelse) for _, choice, rest in alike if choice is not None))
        for taken in (True, False)
    )
    if len(alike) > 1:
        yield first, then, orelse, add(*others)
    if others and all(not isinstance(part, If | Branch) for arg in others for part in postorder(arg)):
        yield first, add(then, *others), add(orelse, *others), ZERO


def _taken_from_one(node: Prim) -> Branch | None:
    """The bracket b of a sum that is 1 - b or b - 1."""
    for one, other in (node.args, node.args[::-1]) if len(node.args) == 2 else ():
        bracket = neg(other) if one is ONE else other
        if one in (ONE, neg(ONE)) and isinstance(bracket, Branch) and bracket.then is ONE and bracket.orelse is ZERO:
            return bracket
    return None


def _chosen(term: Term, tangents: frozenset[str]) -> tuple[If | Branch | None, Term]:
    """The choice that is a factor of a term and what it is multiplied by; what is 0 on one side is none."""
    found = factored(term)
    for base, n in found.powers.items():
        if isinstance(base, If | Branch) and n == 1 and ZERO not in (base.then, base.orelse):
            rest = Factors(found.coefficient, dict(found.powers), found.exponents, found.conditions)
            rest.times(base, -1)
            return base, written(rest, tangents)
    return None, term


def _asked(choice: If | Branch) -> object:
    return choice.condition if isinstance(choice, If) else (choice.coordinates, choice.strict)


def _choosing(node: If | Branch, then: Term, orelse: Term) -> Term:
    """The same choice between two other sides."""
    sides = {node.then: then, node.orelse: orelse}
    return rebuild(node, tuple(sides.get(part, part) for part in children(node)))


def _of_size(node: Branch, tangents: frozenset[str], inside: frozenset[str]) -> Term | None:
    """f(abs(u)) for f(u) where u is positive and f(-u) elsewhere, sign(u)*f(abs(u)) for -f(-u) where f(0) is 0."""
    surface, size = node.surface, prim("abs", node.surface)
    then = _replaced(node.then, surface, size)
    orelse = _replaced(node.orelse, neg(surface), size)
    if then == node.then or orelse == node.orelse:
        return None
    if equal(then, orelse):
        return then
    vanishes = factored(then).powers.get(size, 0) > 0
    if vanishes and surface.free.isdisjoint(inside) and equal(then, neg(orelse)):
        return written(factored(mul(prim("sign", surface), then)), tangents)
    return None


def _of_sign(node: Branch, tangents: frozenset[str]) -> Term | None:
    """What is the other side's negative as a product with 1 and -1, the 1 first."""
    first, other = node.then, node.orelse
    tuples = any(isinstance(side, Tuple) for side in (first, other))
    if tuples or first.free != other.free or not equal(first, neg(other)):
        return None
    surface, strict = node.surface, node.strict
    if is_negative(first) or (isinstance(first, Const) and first.value < 0):
        first, surface, strict = other, turned_round(surface), not strict
    whole = factored(first)
    whole.times(branch((surface,), strict, ONE, neg(ONE)), 1)
    return written(whole, tangents)


def _replaced(term: Term, old: Term, new: Term) -> Term:
    """With `new` for what is `old`, however it is written."""

    def change(_: Term, now: Term) -> Term:
        return new if now.free == old.free and (now is old or equal(now, old)) else now

    return transform(term, change)
