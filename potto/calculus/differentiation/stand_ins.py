"""Functions of which only the dual is at hand, where their value is wanted: that of the dual's answer stands in for it.

Owns `as_values`.
"""

from __future__ import annotations

from collections.abc import Mapping

from potto.calculus.surfaces.trace import spine
from potto.core.terms import (
    ZERO,
    App,
    Deriv,
    Global,
    Lam,
    Term,
    Var,
    app,
    children,
    deriv,
    postorder,
    proj,
    rebuild,
    tuple_,
)


def as_values(term: Term, functions: Mapping[str, Term]) -> Term:
    """The term, in which these functions are called, or handed on, by their duals."""
    if not functions or not term.free & functions.keys():
        return term
    inner = {n.function for n in postorder(term) if isinstance(n, App)}
    memo: dict[Term, Term] = {}

    def over(arg: Term) -> Term:
        if isinstance(arg, Var) and arg.name in functions:
            return functions[arg.name]
        return deriv(arg) if isinstance(arg, Global | Deriv | Lam) else tuple_((memo[arg], ZERO))

    for node in postorder(term):
        if isinstance(node, App) and node not in inner:
            head, groups = spine(node)
            if any(isinstance(a, Var) and a.name in functions for group in ((head,), *groups) for a in group):
                result = over(head)
                for group in groups:
                    result = app(result, tuple(over(a) for a in group))
                memo[node] = proj(result, 0)
                continue
        memo[node] = rebuild(node, tuple(memo[c] for c in children(node)))
    return memo[term]
