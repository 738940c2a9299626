"""Integrals over normal numbers of which only a combination matters: a number that is normal as well; and lognormal
numbers by their logarithms, which are normal.

Owns `combined`. Where x and y have independent normal densities and the rest knows a x + b y alone, that is normal with
mean a m_x + b m_y and variance a^2 s_x^2 + b^2 s_y^2: one variable less, and none at all for the sum of many. So a
distance between two points that are both uncertain takes two variables, not four. The density of a lognormal number
goes to 0 like no power, and falls off slowly: among other variables its logarithm takes a third of the nodes.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import lru_cache

from msgspec import Struct

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.ranges import range_of
from potto.calculus.algebra.rational_form import is_zero
from potto.calculus.decomposition.factors import factors
from potto.core.simplify import simplify
from potto.core.terms import (
    INF,
    ONE,
    PI,
    TWO,
    ZERO,
    App,
    Branch,
    Const,
    Delta,
    Global,
    If,
    Integral,
    Prim,
    Term,
    Var,
    add,
    children,
    const,
    div,
    integral,
    mul,
    neg,
    postorder,
    prim,
    rebuild,
    replaced,
    sub,
    substitute,
    var,
)

KINDS = (Const, Var, Prim, Branch, Delta, If, App, Global)
LOGARITHM = "@log"  # behind the name of a variable
TOGETHER = "@together"  # behind the name of the first variable of a combination
WIDE = (3.0, 8.0)  # where rules look at a normal density, in standard deviations: as the measure does


class _Normal(Struct, frozen=True):
    """exp(-(x - mean)^2/(2 spread^2)), the factor in this place of an integrand."""

    place: int
    mean: Term
    spread: Term


@lru_cache(maxsize=4096)
def combined(term: Integral) -> Integral:
    """An equal integral over fewer variables, and by logarithms; the same term where none are combined or lognormal."""
    if len(term.variables) > 1:
        for name in term.variables:
            term = _by_logarithm(term, name) or term
    while (found := _one_less(term)) is not None:
        term = found
    return term


def _one_less(term: Integral) -> Integral | None:
    every = list(factors(term.body))
    normals = {name: found for name in term.variables if (found := _normal(term, every, name)) is not None}
    if len(normals) < 2 or not all(isinstance(node, KINDS) for node in postorder(term.body)):
        return None
    for (x, first), (y, second) in itertools.combinations(normals.items(), 2):
        rest = [factor for place, factor in enumerate(every) if place not in (first.place, second.place)]
        combination = _Combination((x, y), x if x.endswith(TOGETHER) else x + TOGETHER)
        try:
            body = mul(*map(combination.put, rest))
        except _SeveralError:
            continue
        if combination.weights is not None:
            return _put(term, (first, second), combination, body)
    return None


def _put(term: Integral, normals: tuple[_Normal, _Normal], combination: _Combination, body: Term) -> Integral:
    """The integral over a combination in the place of the first of its two variables.

    The factor that this leaves stays under the integral: outside, what it changes by would have to cancel against what
    the densities change by.
    """
    assert combination.weights is not None
    (a, b), (first, second), (x, y), name = combination.weights, normals, combination.pair, combination.name
    mean = add(mul(a, first.mean), mul(b, second.mean))
    wide, high = mul(a, first.spread), mul(b, second.spread)
    spread = simplify(prim("sqrt", add(mul(wide, wide), mul(high, high))))
    off = div(sub(var(name), mean), spread)
    density = prim("exp", neg(div(mul(off, off), TWO)))
    hints = (*(sub(mean, mul(const(d), spread)) for d in reversed(WIDE)), mean,
             *(add(mean, mul(const(d), spread)) for d in WIDE))  # fmt: skip
    rows = zip(term.variables, term.bounds, term.hints, strict=True)
    kept = [(name, bounds, hints) if v == x else (v, bounds, own) for v, bounds, own in rows if v != y]
    variables, bounds, every = (tuple(column) for column in zip(*kept, strict=True))
    factor = div(mul(first.spread, second.spread, prim("sqrt", mul(TWO, PI))), spread)
    whole = integral(variables, bounds, mul(factor, density, body), every)
    assert isinstance(whole, Integral)
    return whole


def _normal(term: Integral, every: Sequence[Term], name: str) -> _Normal | None:
    """The normal density of a variable, where its range is the whole line and one factor is that and nothing else."""
    place = term.variables.index(name)
    if term.bounds[place] != (neg(INF), INF) or any(name in end.free for pair in term.bounds for end in pair):
        return None
    if any(name in hint.free for hints in term.hints for hint in hints):
        return None
    names = frozenset(term.variables)
    for at, factor in enumerate(every):
        if not (isinstance(factor, Prim) and factor.op == "exp" and factor.free & names == {name}):
            continue
        parts = [twice for part in factors(factor.args[0]) for twice in _squared(part)]
        varying = [part for part in parts if name in part.free]
        line = affine(varying[0], (name,)) if len(varying) == 2 and varying[0] is varying[1] else None
        steep = mul(*(part for part in parts if name not in part.free))
        falls = range_of(steep)
        if line is None or line.coefficients[0] is ZERO or falls.hi > 0 or falls.zero:
            continue
        slope = line.coefficients[0]
        width = prim("sqrt", div(ONE, neg(mul(TWO, steep, slope, slope))))
        return _Normal(at, neg(div(line.rest, slope)), simplify(width))
    return None


def _by_logarithm(term: Integral, name: str) -> Integral | None:
    """The integral over the logarithm of a variable, where that is normal, instead of the variable."""
    place = term.variables.index(name)
    others = [end for pair in term.bounds for end in pair] + [hint for hints in term.hints for hint in hints]
    log = prim("log", var(name))
    if (
        term.bounds[place] != (ZERO, INF)
        or any(name in part.free for part in others)
        or log not in postorder(term.body)
    ):
        return None
    u = name + LOGARITHM
    every = list(factors(term.body))
    inverse = div(ONE, var(name))
    whole = [factor for factor in every if factor is not inverse] if every.count(inverse) == 1 else [*every, var(name)]
    body = substitute(replaced(mul(*whole), {log: var(u)}), {name: prim("exp", var(u))})
    rows = zip(term.variables, term.bounds, term.hints, strict=True)
    turned = [
        (u, (neg(INF), INF), tuple(map(_log, hints))) if v == name else (v, pair, hints) for v, pair, hints in rows
    ]
    variables, bounds, hints = (tuple(column) for column in zip(*turned, strict=True))
    found = integral(variables, bounds, body, hints)
    assert isinstance(found, Integral)
    return found if _normal(found, list(factors(body)), u) is not None else None


def _log(term: Term) -> Term:
    return term.args[0] if isinstance(term, Prim) and term.op == "exp" else prim("log", term)


def _squared(term: Term) -> tuple[Term, ...]:
    """The two equal factors of a square; a term itself that is written as none."""
    match term:
        case Prim(op="pow", args=(base, Const(value=2.0))):
            return base, base
    return (term,)


class _SeveralError(Exception):
    """The rest depends on the two variables through more than one combination of them."""


class _Combination(Struct):
    """The one combination of two variables that terms depend on, as far as they have been put.

    name: what it is called; weights: how much of each.
    """

    pair: tuple[str, str]
    name: str
    weights: tuple[Term, Term] | None = None

    def put(self, term: Term) -> Term:
        """The term with the combination in place of the two. Raises _SeveralError."""
        memo: dict[Term, Term] = {}
        waiting = [term]
        while waiting:
            node = waiting[-1]
            if node in memo:
                waiting.pop()
            elif node.free.isdisjoint(self.pair):
                memo[node] = node
            elif (found := self._along(node)) is not None:
                memo[node] = found
            elif isinstance(node, Var):
                raise _SeveralError
            elif missing := [child for child in children(node) if child not in memo]:
                waiting += missing
            else:
                memo[node] = rebuild(node, tuple(memo[child] for child in children(node)))
        return memo[term]

    def _along(self, node: Term) -> Term | None:
        """A term that is affine in the two, by their combination; None where it is not along it as a whole."""
        if isinstance(node, Branch | If):
            return None
        line = affine(node, self.pair)
        if line is None:
            return None
        a, b = line.coefficients
        if self.weights is None and _counts(a) and _counts(b):
            self.weights = a, b
        if self.weights is None or not is_zero(sub(mul(a, self.weights[1]), mul(b, self.weights[0]))):
            return None
        return add(mul(simplify(div(a, self.weights[0])), var(self.name)), line.rest)


def _counts(term: Term) -> bool:
    """Whether a term is a number other than 0."""
    return isinstance(term, Const) and term.value != 0
