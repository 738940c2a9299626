"""What the parameters of measures must be for a formula to have a value, apart from the formula.

Owns `unguarded`. A measure is elaborated as `if 0 < s then ... else` a hole, so that an evaluation that comes there
says what is wrong; a person reads the formula and beside it, once, where it holds.
"""

from __future__ import annotations

from potto.calculus.algebra.ranges import range_of
from potto.core.terms import Hole, If, Prim, Term, sub, transform


def unguarded(term: Term) -> tuple[Term, tuple[Term, ...]]:
    """The term without the guards of its measures, and their conditions, each once."""
    conditions: dict[Term, None] = {}

    def change(node: Term, new: Term) -> Term:
        if isinstance(node, If) and isinstance(new, If) and isinstance(node.orelse, Hole) and node.orelse.measure:
            if not _always(node.condition):
                conditions[node.condition] = None
            return new.then
        return new

    return transform(term, change), tuple(conditions)


def _always(condition: Term) -> bool:
    """Whether it is a comparison of numbers that holds, as 0 < pi/2."""
    match condition:
        case Prim(op="lt", args=(left, right)):
            return not condition.free and range_of(sub(right, left)).positive
    return False
