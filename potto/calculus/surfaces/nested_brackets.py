"""Brackets inside of conditions: whether there are any, and what a surface is on either side of them.

Owns `nested`, `has_nested` and `pieces`. Every condition is asked; what takes the brackets out (`lifted`) is large, and
only loaded for those that have some.
"""

from __future__ import annotations

from itertools import islice

from potto.core.terms import (
    Array,
    Branch,
    Delta,
    Fold,
    If,
    Integral,
    Lam,
    Sum,
    Term,
    outside,
    postorder,
    replaced,
)

BINDERS = (Integral, Sum, Lam, Fold, Array)
_OTHERS = (Integral, Lam)  # whose brackets are no business of the condition
_MOST_PIECES = 16


def nested(surface: Term) -> bool:
    """Whether a condition has a bracket inside that is its own, not one of an integral in it."""
    return any(isinstance(node, Branch) for node in outside(surface, BINDERS))


def in_loops(surface: Term) -> bool:
    """Whether a condition has a bracket inside, those of the steps of its loops counted: it is its own once these are
    written out."""
    return any(isinstance(node, Branch) for node in outside(surface, _OTHERS))


def has_nested(term: Term) -> bool:
    """Whether some condition of a term, also one of an integral inside, has a bracket in it."""
    return any(nested(c) for node in postorder(term) for c in coordinates_of(node))


def coordinates_of(node: Term) -> tuple[Term, ...]:
    """What a condition is on; nothing of what is none."""
    return node.coordinates if isinstance(node, Branch | Delta) else ()


def pieces(surface: Term) -> tuple[Term, ...]:
    """What a surface is on either side of the conditions inside of it: where it is 0, one of these is.

    Of too many it has some, with conditions inside still; the surface itself, if none would be without. Of the
    brackets in loops one side is taken at all steps: what is asked of each is of which kind it is.
    """
    done: dict[Term, None] = {}
    apart = (part for part in outside(surface, (*BINDERS, Branch, If)) if isinstance(part, Branch | If))
    if len(tuple(islice(apart, _MOST_PIECES + 1))) > _MOST_PIECES:
        return (surface,)
    waiting = [surface]
    while waiting:
        term = waiting.pop()
        inner = next((node for node in outside(term, BINDERS) if isinstance(node, Branch | If)), None)
        if inner is None:
            inner = next((node for node in outside(term, _OTHERS) if isinstance(node, Branch)), None)
        if inner is None or len(done) + len(waiting) >= _MOST_PIECES:
            done[term] = None
        else:
            waiting.extend(replaced(term, {inner: case}) for case in (inner.orelse, inner.then))
    return tuple(done)
