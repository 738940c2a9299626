"""What the parameters of measures must be for a formula to have a value, apart from the formula.

Owns `unguarded`, `is_guard` and `guarded_outside`. A measure is elaborated as `if 0 < s then ... else` a hole, so that
an evaluation that comes there says what is wrong; a person reads the formula and beside it, once, where it holds; and
what is integrated is seen to be a product.
"""

from __future__ import annotations

from potto.calculus.algebra.ranges import range_of
from potto.calculus.decomposition.factors import factors
from potto.core.terms import Hole, If, Integral, Prim, Term, if_, integral, mul, sub, transform


def unguarded(term: Term) -> tuple[Term, tuple[Term, ...]]:
    """The term without the guards of its measures, and their conditions, each once."""
    conditions: dict[Term, None] = {}

    def change(node: Term, new: Term) -> Term:
        if isinstance(node, If) and isinstance(new, If) and is_guard(node):
            if not _always(node.condition):
                conditions[node.condition] = None
            return new.then
        return new

    return transform(term, change), tuple(conditions)


def is_guard(term: Term) -> bool:
    return isinstance(term, If) and isinstance(term.orelse, Hole) and term.orelse.measure


def guarded_outside(term: Integral) -> Term:
    """An equal term, with the guards around the integral that no variable of it decides."""
    guards: list[If] = []
    kept: list[Term] = []
    waiting = [term.body]
    while waiting:
        for factor in factors(waiting.pop()):
            if isinstance(factor, If) and is_guard(factor) and factor.condition.free.isdisjoint(term.variables):
                guards.append(factor)
                waiting.append(factor.then)
            else:
                kept.append(factor)
    if not guards:
        return term
    found: Term = integral(term.variables, term.bounds, mul(*kept), term.hints)
    for guard in guards:
        found = if_(guard.condition, found, guard.orelse)
    return found


def _always(condition: Term) -> bool:
    """Whether it is a comparison of numbers that holds, as 0 < pi/2."""
    match condition:
        case Prim(op="lt", args=(left, right)):
            return not condition.free and range_of(sub(right, left)).positive
    return False
