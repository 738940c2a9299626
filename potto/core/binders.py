"""Binders that are told apart by their names.

Owns `apart`. Where a function's body has been put in the place of a call, two integrals inside of each other may be
over variables of the same name. Scopes keep them apart; passes that ask which branches vary with a variable by its name
do not.
"""

from __future__ import annotations

from potto.core.term_kinds import Array, Fold, Integral, Lam, Sum, Term
from potto.core.walking import Holding, bound_names, children, fresh, rebuild, rename_bound, transform, unknown

# Of a term the names that binders in it bind, and whether one of them is bound by a binder around it too.
Bound = dict[Term, tuple[frozenset[str], bool]]
NOTHING: tuple[frozenset[str], bool] = frozenset(), False
_holds_binder = Holding(Lam, Integral, Sum, Array, Fold)


def apart(root: Term, known: Bound | None = None) -> Term:
    """An equal term in which no binder binds a name that is free in the whole, or bound by a binder around it.

    known: what is known of terms already; it grows, and what is in it is not looked through again.
    """
    if not _holds_binder(root):
        return root
    known = {} if known is None else known
    for node in unknown(root, known):
        own, below = bound_names(node), [found for c in children(node) if (found := known[c]) is not NOTHING]
        if not own and len(below) < 2:  # nearly all terms
            known[node] = below[0] if below else NOTHING
            continue
        inside = frozenset[str]().union(*(names for names, _ in below))
        known[node] = inside.union(own), any(clash for _, clash in below) or not inside.isdisjoint(own)
    names, clash = known[root]
    return _Apart(names | root.free).run(root, root.free) if clash or not names.isdisjoint(root.free) else root


class _Apart:
    """taken: every name of the term."""

    def __init__(self, taken: frozenset[str]) -> None:
        self.taken = set(taken)
        self.made: dict[frozenset[str], dict[Term, Term]] = {}

    def run(self, root: Term, around: frozenset[str]) -> Term:
        """`around`: the names that binders in the term must not have. Recursion only at binders."""
        return transform(
            root,
            lambda node, new: self.binder(node, around) if bound_names(node) else new,
            lambda node: () if bound_names(node) else children(node),
            self.made.setdefault(around, {}),
        )

    def binder(self, node: Term, around: frozenset[str]) -> Term:
        clash = around.intersection(bound_names(node))
        if clash:
            names: dict[str, str] = {}
            for name in bound_names(node):
                if name in clash:
                    names[name] = fresh(name, self.taken | node.free)
                    self.taken.add(names[name])
            node = rename_bound(node, names)
        inner = around.union(bound_names(node))
        return rebuild(node, tuple([self.run(part, inner) for part in children(node)]))
