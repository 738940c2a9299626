"""Conditions that name a variable with which they do not vary, as `x - x < t` does, without it.

Owns `without_cancelled`. Such a surface has no place along the variable: where the parameters reach it, all of the
domain is on one of its sides at once, as with `[0 < t]`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from potto.calculus.algebra.rational_form import as_term, is_zero, normal
from potto.calculus.surfaces.domains import ends_of_domain
from potto.core.terms import Branch, Term, Var, branch, children, const, div, postorder, sub, substitute

_ELSEWHERE = const(0.4375)  # a value that no program would choose


def without_cancelled(node: Branch, variables: Iterable[str]) -> Branch:
    """The branch with a surface that names those of the variables with which it varies; the same one where it is
    defined for some of their values only, or where what is left of it has no plain form."""
    surface = node.surface
    named = surface.free.intersection(variables)
    if len(node.coordinates) != 1 or not named:
        return node
    times = _occurrences(surface, named)
    lost = [x for x in named if times[x] > 1 and is_zero(sub(surface, substitute(surface, {x: _ELSEWHERE})))]
    found = normal(surface) if lost and not ends_of_domain(surface) else None
    top, below = (None, None) if found is None else (as_term(found.top), as_term(found.below))
    if top is None or below is None or not (top.free | below.free).isdisjoint(lost):
        return node
    plain = branch((div(top, below),), node.strict, node.then, node.orelse)
    return plain if isinstance(plain, Branch) else node


def _occurrences(term: Term, names: frozenset[str]) -> Counter[str]:
    """How often variables stand in a term that is written out."""
    found: dict[Term, Counter[str]] = {}
    for node in postorder(term, below=lambda n: () if n.free.isdisjoint(names) else children(n)):
        own = Counter([node.name] if isinstance(node, Var) and node.name in names else ())
        for part in children(node):
            own.update(found.get(part, ()))
        found[node] = own
    return found[term]
