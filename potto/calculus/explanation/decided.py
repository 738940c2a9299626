"""What the ranges of variables decide in a formula.

Owns `decided` and `side_taken`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from potto.calculus.algebra.ranges import Box, ValueRange, range_of
from potto.calculus.explanation.alternatives import holds
from potto.calculus.explanation.bounds import bracket as bracket_of
from potto.calculus.explanation.bounds import is_shorter
from potto.calculus.explanation.brackets import conditions, fewer, plainer
from potto.calculus.surfaces.branch_assignment import box_of, with_index
from potto.core.terms import (
    ONE,
    ZERO,
    Array,
    Branch,
    Fold,
    If,
    Integral,
    Prim,
    Sum,
    Term,
    branch,
    children,
    neg,
    postorder,
    rebuild,
    sub,
)

Simpler = Callable[[Term], Term]
_Binder = Integral | Sum | Array | Fold


def decided(term: Term, box: Box, simpler: Simpler) -> Term:
    """Without the brackets, and sizes of what has one sign, that are told by the ranges of the variables and indices
    around them."""
    known: dict[Term, Term] = {}
    for node in postorder(term, below=lambda n: () if isinstance(n, _Binder) else children(n)):
        known[node] = (
            _inside(node, box, simpler) if isinstance(node, _Binder) else _undecided(node, known, box, simpler)
        )
    return known[term]


def _inside(node: _Binder, box: Box, simpler: Simpler) -> Term:
    match node:
        case Integral():
            inner: Box = {**box, **box_of(node)}
        case Array():
            inner = with_index(box, node.variable, ZERO, sub(node.size, ONE))
        case _:
            inner = with_index(box, node.variable, node.lo, node.hi)
    *parts, body = children(node)
    return simpler(rebuild(node, (*(decided(part, box, simpler) for part in parts), decided(body, inner, simpler))))


def _undecided(node: Term, known: Mapping[Term, Term], box: Box, simpler: Simpler) -> Term:
    parts = children(node)
    new = rebuild(node, tuple(known[part] for part in parts)) if parts else node
    if isinstance(new, Prim) and new.op == "abs":
        bounds = range_of(new.args[0], box)
        new = new.args[0] if bounds.lo >= 0 else neg(new.args[0]) if bounds.hi <= 0 else new
    if isinstance(new, If) and (known_side := holds(new.condition, box)) is not None:
        return new.then if known_side else new.orelse
    if isinstance(new, Branch) and new.then is new.orelse:
        return new.then
    if isinstance(new, Branch):
        taken = side_taken(new, range_of(new.surface, box))
        if taken is not None:
            return taken
        surface = plainer(new.surface, box) if len(new.coordinates) == 1 else None
        if surface is not None and (surface.free < new.surface.free or not is_shorter(new.surface, surface)):
            new = branch((surface,), new.strict, new.then, new.orelse)
        held = conditions(new) if box else None
        if held is not None and set(plain := fewer(held, box)) != set(held):
            new = bracket_of(plain)
    return new if new is node else simpler(new)


def side_taken(node: Branch, bounds: ValueRange) -> Term | None:
    """The side of a branch whose surface has these bounds, where they tell."""
    if bounds.positive or (not node.strict and bounds.lo >= 0):
        return node.then
    return node.orelse if bounds.negative or (node.strict and bounds.hi <= 0) else None
