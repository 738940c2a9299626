"""Integrals that are products of integrals: of factors that no variable, and no bound of one, connects (Fubini).

Owns `in_factors`.
"""

from __future__ import annotations

import math
from functools import lru_cache

from potto.calculus.decomposition.elimination import factors
from potto.core.terms import ONE, Const, Delta, Integral, Term, integral, mul, postorder

Names = frozenset[str]
# About how many nodes a variable takes, with ends and without; up to which product of them one rule for all variables,
# which is made and called once, is no slower.
WITH_ENDS, ENDLESS, FEW = 20, 300, 1000


@lru_cache(maxsize=4096)
def in_factors(term: Integral) -> Term:
    """An equal product of integrals over fewer variables; the same term where every variable has to do with every other
    one, a factor would be infinite, or all variables together take few nodes."""
    names = frozenset(term.variables)
    nodes = math.prod(ENDLESS if any(map(_is_infinite, pair)) else WITH_ENDS for pair in term.bounds)
    if len(names) < 2 or nodes <= FEW or any(isinstance(node, Delta) for node in postorder(term.body)):
        return term
    found = list(factors(term.body))
    connections = [factor.free & names for factor in found]
    for variable, pair, hints in zip(term.variables, term.bounds, term.hints, strict=True):
        connections.append(frozenset((variable,)).union(*(place.free & names for place in (*pair, *hints))))
    groups: list[Names] = []
    for connected in filter(None, connections):
        met = [group for group in groups if group & connected]
        groups = [group for group in groups if not group & connected] + [connected.union(*met)]
    if len(groups) < 2 or any(not _stands(term, group, found) for group in groups):
        return term
    outside = [factor for factor in found if not factor.free & names]
    return mul(*outside, *(_part(term, group, found) for group in groups))


def _stands(term: Integral, group: Names, found: list[Term]) -> bool:
    """Whether there is something to integrate over some variables, or the ends of their ranges are no infinite ones."""
    if any(factor.free & group for factor in found):
        return True
    bounds = [bound for v, pair in zip(term.variables, term.bounds, strict=True) if v in group for bound in pair]
    return not any(map(_is_infinite, bounds))


def _part(term: Integral, group: Names, found: list[Term]) -> Integral:
    """The integral of the factors of a group of variables over these."""
    own = [i for i, variable in enumerate(term.variables) if variable in group]
    variables, bounds, hints = (
        tuple(term.variables[i] for i in own), tuple(term.bounds[i] for i in own), tuple(term.hints[i] for i in own)
    )  # fmt: skip
    return integral(variables, bounds, mul(ONE, *(factor for factor in found if factor.free & group)), hints)


def _is_infinite(bound: Term) -> bool:
    return isinstance(bound, Const) and math.isinf(bound.value)
