"""Builtins that jump by themselves: `atan2` turns from pi to -pi where y passes 0 left of the origin.

Owns `opened`: the same term with that jump as a branch, so that whoever moves the cut gets its boundary term.
"""

from __future__ import annotations

from functools import lru_cache

from potto.calculus.algebra.ranges import positive
from potto.core.terms import Branch, Delta, Prim, Term, branch, children, neg, postorder, prim, rebuild


@lru_cache(maxsize=4096)
def opened(term: Term) -> Term:
    """An equal term in which an angle is chosen by the side of the cut; the same one where there is no cut.

    Conditions stay as they are: where a condition jumps, the search for its roots looks by itself.
    """
    nodes = postorder(term)
    if not any(isinstance(node, Prim) and node.op == "atan2" for node in nodes):
        return term
    memo: dict[Term, Term] = {}
    for node in nodes:
        if isinstance(node, Delta):
            memo[node] = node
        elif isinstance(node, Branch):
            memo[node] = branch(node.coordinates, node.strict, memo[node.then], memo[node.orelse])
        else:
            new = rebuild(node, tuple(memo[child] for child in children(node)))
            memo[node] = _angle(new) if isinstance(new, Prim) and new.op == "atan2" else new
    return memo[term]


def _angle(term: Prim) -> Term:
    y, x = term.args
    if not y.free or positive(x) or positive(y):
        return term
    # Of |y|, so that what is just on the cut falls on the side that it is taken for.
    half = prim("atan2", prim("abs", y), x)
    return branch((y,), False, half, neg(half))
