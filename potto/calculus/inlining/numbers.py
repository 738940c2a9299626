"""Numbers that have a name, `k = 0.3`, where they are read: what decides a condition is to be enclosed.

Owns `with_numbers`.
"""

from __future__ import annotations

from potto.calculus.inlining.expand import Resolve
from potto.core.terms import Const, Global, Prim, Term, postorder
from potto.core.walking import transform

MOST_NODES = 64  # of a definition that is arithmetic: longer ones are evaluated once, and read


def with_numbers(term: Term, resolve: Resolve) -> Term:
    """The term with arithmetic in the place of names that stand for it; functions, integrals and data keep theirs."""

    def written(node: Term, new: Term) -> Term:
        return new if not isinstance(node, Global) else _arithmetic(node, resolve, ()) or new

    return transform(term, written) if any(isinstance(node, Global) for node in postorder(term)) else term


def _arithmetic(name: Global, resolve: Resolve, path: tuple[Global, ...]) -> Term | None:
    """What a name stands for, if that is arithmetic of numbers and of names for such."""
    found = None if name in path else resolve(name)
    if not isinstance(found, Const | Prim | Global):
        return None
    nodes = list(postorder(found))
    if len(nodes) > MOST_NODES or not all(isinstance(node, Const | Prim | Global) for node in nodes):
        return None
    known = {node: _arithmetic(node, resolve, (*path, name)) for node in nodes if isinstance(node, Global)}
    if None in known.values():
        return None
    return transform(found, lambda node, new: known[node] or new if isinstance(node, Global) else new)
