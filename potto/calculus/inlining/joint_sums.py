"""Sums that go over the same numbers and read the same: one sum of tuples, so that what they share is evaluated once.

Owns `with_joint_sums`. The dual of a sum is two, one of values and one of tangents, and each calls all that both need.
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.calculus.inlining.lattices import middle
from potto.core.terms import (
    Array,
    Branch,
    Fold,
    If,
    Integral,
    Lam,
    Sum,
    Term,
    Var,
    children,
    outside,
    postorder,
    proj,
    transform,
    tuple_,
    with_summand,
)

# What is in these is evaluated in its own scope, or not at all.
APART = (Lam, Integral, Sum, Array, Fold, If, Branch)


def with_joint_sums(term: Term) -> Term:
    """The term with its sums joined, those of their terms as well."""
    ranges: dict[tuple[str, Term, Term, bool], list[Sum]] = {}
    for node in outside(term, APART):
        if isinstance(node, Sum) and middle(node) is None:
            ranges.setdefault((node.variable, node.lo, node.hi, node.endless), []).append(node)
    made: dict[Term, Term] = {}
    for (name, *_), sums in ranges.items():
        for group in _sharing(sums, name):
            if len(group) == 1:
                made[group[0]] = with_summand(group[0], with_joint_sums(group[0].body))
                continue
            whole = with_summand(group[0], with_joint_sums(tuple_(one.body for one in group)))
            made |= {one: proj(whole, place) for place, one in enumerate(group)}
    return transform(
        term, lambda node, new: made.get(node, new), lambda node: () if isinstance(node, APART) else children(node)
    )


def _sharing(sums: Sequence[Sum], name: str) -> list[list[Sum]]:
    """The sums in groups that have parts in common which vary from term to term."""
    groups: list[tuple[list[Sum], set[Term]]] = []
    for one in sums:
        own: list[Sum] = [one]
        parts: set[Term] = {n for n in postorder(one.body) if name in n.free and not isinstance(n, Var)}
        for group in [g for g in groups if not g[1].isdisjoint(parts)]:
            groups.remove(group)
            own, parts = [*group[0], *own], parts | group[1]
        groups.append((own, parts))
    return [group for group, _ in groups]
