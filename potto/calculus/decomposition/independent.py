"""Integrals that are products of integrals: of factors that no variable, and no bound of one, connects (Fubini); and
sums of such products, where one factor is a sum whose summands have to do with different variables.

Owns `in_factors`.
"""

from __future__ import annotations

import math
from functools import lru_cache

from potto.calculus.decomposition.factors import Names, factors, summands
from potto.core.terms import ONE, Const, Delta, Integral, Prim, Term, add, integral, mul, postorder, prim

# About how many nodes a variable takes, with ends and without; up to which product of them one rule for all variables,
# which is made and called once, is no slower.
WITH_ENDS, ENDLESS, FEW = 20, 300, 1000


@lru_cache(maxsize=4096)
def in_factors(term: Integral) -> Term:
    """An equal product of integrals over fewer variables, or a sum of products; the same term where every variable has
    to do with every other one, a factor would be infinite, or all variables together take few nodes."""
    names = frozenset(term.variables)
    nodes = math.prod(ENDLESS if any(map(_is_infinite, pair)) else WITH_ENDS for pair in term.bounds)
    if len(names) < 2 or nodes <= FEW or any(isinstance(node, Delta) for node in postorder(term.body)):
        return term
    every = list(factors(term.body))
    found = [_summed(factor, names) for factor in every]
    groups = _connected(term, found)
    if len(groups) < 2:
        return _in_summands(term, every, found)
    bodies = [mul(*(_of_group(factor, group, groups) for factor in found)) for group in (*groups, frozenset())]
    if any(body is ONE and not _ends(term, group) for body, group in zip(bodies, groups, strict=False)):
        return term
    return mul(bodies[-1], *(_part(term, group, body) for group, body in zip(groups, bodies, strict=False)))


def _connected(term: Integral, found: list[tuple[Term, ...]]) -> list[Names]:
    """The variables of an integral in groups that nothing connects, of these factors or of the bounds."""
    names = frozenset(term.variables)
    connections = [piece.free & names for factor in found for piece in factor]
    for variable, pair, hints in zip(term.variables, term.bounds, term.hints, strict=True):
        connections.append(frozenset((variable,)).union(*(place.free & names for place in (*pair, *hints))))
    groups: list[Names] = []
    for connected in filter(None, connections):
        met = [group for group in groups if group & connected]
        groups = [group for group in groups if not group & connected] + [connected.union(*met)]
    return groups


def _in_summands(term: Integral, every: list[Term], found: list[tuple[Term, ...]]) -> Term:
    """An equal sum, by the factor whose summands have to do with groups of variables that nothing else connects: what
    is integrable as a whole is so summand by summand then."""
    for place, factor in enumerate(every):
        parts = summands(factor, frozenset(term.variables))
        if len(parts) < 2:
            continue
        groups = _connected(term, [*found[:place], *found[place + 1 :], tuple(parts)])
        each = [[part for part in parts if part.free & group] for group in groups]
        each[0] += [part for part in parts if not any(part.free & group for group in groups)]
        own = [mul(*every[:place], *every[place + 1 :], add(*mine)) for mine in each if mine]
        if len(own) < 2:
            continue
        split = [integral(term.variables, term.bounds, body, term.hints) for body in own]
        apart = [in_factors(part) for part in split]
        if all(new is not old for new, old in zip(apart, split, strict=True)):
            return add(*apart)
    return term


def _summed(factor: Term, names: Names) -> tuple[Term, ...]:
    """A factor; of an exponential of a sum what is added up."""
    if isinstance(factor, Prim) and factor.op == "exp":
        return tuple(prim("exp", part) for part in summands(factor.args[0], names))
    return (factor,)


def _of_group(factor: tuple[Term, ...], group: Names, groups: list[Names]) -> Term:
    """What of a factor varies with a group of variables; what varies with none is left outside, or, of an exponential,
    to the first group that it varies with, which it may keep from an overflow."""
    own = [piece for piece in factor if piece.free & group]
    still = [piece for piece in factor if not any(piece.free & each for each in groups)]
    first = next((each for each in groups if any(piece.free & each for piece in factor)), frozenset())
    pieces = [*own, *still] if group == first else own
    if len(pieces) < 2:
        return pieces[0] if pieces else ONE
    return prim("exp", add(*(piece.args[0] for piece in pieces if isinstance(piece, Prim))))


def _ends(term: Integral, group: Names) -> bool:
    """Whether the ranges of a group of variables are bounded."""
    bounds = (bound for v, pair in zip(term.variables, term.bounds, strict=True) if v in group for bound in pair)
    return not any(map(_is_infinite, bounds))


def _part(term: Integral, group: Names, body: Term) -> Integral:
    """The integral of the factors of a group of variables over these."""
    own = [i for i, variable in enumerate(term.variables) if variable in group]
    variables, bounds, hints = (
        tuple(term.variables[i] for i in own), tuple(term.bounds[i] for i in own), tuple(term.hints[i] for i in own)
    )  # fmt: skip
    return integral(variables, bounds, body, hints)


def _is_infinite(bound: Term) -> bool:
    inside = bound.args[0] if isinstance(bound, Prim) and bound.op == "neg" else bound
    return isinstance(inside, Const) and math.isinf(inside.value)
