"""Binders that are told apart by their names.

Owns `apart`. Where a function's body has been put in the place of a call, two integrals inside of each other may be
over variables of the same name. Scopes keep them apart; passes that ask which branches vary with a variable by its name
do not.
"""

from __future__ import annotations

from potto.core.kinds import Term
from potto.core.walking import bound_names, children, fresh, postorder, postorder_by, rebuild, rename_bound


def apart(root: Term) -> Term:
    """An equal term in which no binder binds a name that is free in the whole, or bound by a binder around it."""
    inside: dict[Term, frozenset[str]] = {}
    clash = False
    for node in postorder(root):
        own = frozenset(bound_names(node))
        below = frozenset[str]().union(*(inside[c] for c in children(node)))
        clash = clash or not own.isdisjoint(below) or not own.isdisjoint(root.free)
        inside[node] = own | below
    return _Apart(inside[root] | root.free).run(root, root.free) if clash else root


class _Apart:
    """taken: every name of the term."""

    def __init__(self, taken: frozenset[str]) -> None:
        self.taken = set(taken)
        self.memo: dict[tuple[Term, frozenset[str]], Term] = {}

    def run(self, root: Term, around: frozenset[str]) -> Term:
        """`around`: the names that binders in the term must not have. Recursion only at binders."""
        for node in postorder_by(root, lambda node: () if bound_names(node) else children(node)):
            if (node, around) not in self.memo:
                parts = children(node)
                bound = bool(bound_names(node))
                self.memo[node, around] = (
                    self.binder(node, around) if bound else rebuild(node, tuple(self.memo[c, around] for c in parts))
                )
        return self.memo[root, around]

    def binder(self, node: Term, around: frozenset[str]) -> Term:
        names: dict[str, str] = {}
        for name in bound_names(node):
            if name in around:
                names[name] = fresh(name, self.taken | node.free)
                self.taken.add(names[name])
        if names:
            node = rename_bound(node, names)
        inner = around.union(bound_names(node))
        return rebuild(node, tuple(self.run(part, inner) for part in children(node)))
