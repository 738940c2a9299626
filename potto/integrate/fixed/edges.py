"""Where a rule with few nodes cannot follow builtins: at the edge of where they are analytic, as roots are at 0.

Owns `edges_of` and EDGE.
"""

from __future__ import annotations

from functools import lru_cache

from potto.core.terms import Prim, Term, postorder
from potto.primitives import PRIMITIVES

# How near to 0, of what it comes to elsewhere on the cell, the edge of a builtin's domain may be at a node.
EDGE = 0.1


@lru_cache(maxsize=1024)
def edges_of(term: Term) -> tuple[Term, ...]:
    """What is 0 where a builtin in a term is singular, and varies: where a divisor is small, all there is may be."""
    found = (
        edge
        for node in postorder(term)
        if isinstance(node, Prim)
        for edge in PRIMITIVES[node.op].edges(*node.args)
        if edge.free
    )
    return tuple(dict.fromkeys(found))
