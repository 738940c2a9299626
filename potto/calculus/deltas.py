"""Dirac deltas, integrated out.

Owns `without_deltas`: the integral of f delta(psi) over v is the sum of f/|dpsi/dv| over the roots of psi in v that
lie between the bounds. A delta met twice on one surface has no meaning: that is an error, not a number.
"""

from __future__ import annotations

from potto.calculus.boundary import between, remaining, scaled, total, vanishes
from potto.calculus.derivative import NotSmooth, partial, zero_like
from potto.calculus.pivots import NoClosedForm, Root, chosen, pivots
from potto.calculus.radicals import quotient
from potto.calculus.ranges import range_of
from potto.calculus.sides import branches_of, flipping, forced, unguarded
from potto.core.printer import format_term
from potto.core.simplify import is_zero
from potto.core.terms import (
    ONE,
    ZERO,
    Delta,
    Integral,
    Term,
    children,
    fresh,
    integral,
    neg,
    postorder,
    prim,
    rebuild,
    substitute,
    sum_,
    var,
)
from potto.diagnostics import PottoError, declare
from potto.source import Span

PRODUCT_OF_DELTAS = declare("P0505", "a product of deltas on the same surface")

_MOST = 64  # deltas integrated out of one integral


def without_deltas(node: Integral) -> Term:
    """The integral with every delta over its variables integrated out. Raises PottoError (P0505)."""
    if not any(isinstance(n, Delta) for n in postorder(node.body)):
        return node
    body = _inner_first(node.body)
    node = integral(node.variables, node.bounds, body, node.hints)
    parts: list[Term] = []
    waiting: list[Term] = [node]
    for _ in range(_MOST):
        if not waiting:
            break
        term = waiting.pop()
        found = _first(term) if isinstance(term, Integral) else None
        if found is None:
            parts.append(term)
        else:
            assert isinstance(term, Integral)
            waiting.extend(_eliminated(term, found))
    return total(parts + waiting, zero_like(node.body))


def _inner_first(body: Term) -> Term:
    memo: dict[Term, Term] = {}
    for node in postorder(body):
        new = rebuild(node, tuple(memo[c] for c in children(node)))
        memo[node] = without_deltas(new) if isinstance(new, Integral) else new
    return memo[body]


def _first(node: Integral) -> Delta | None:
    for part in postorder(node.body):
        if isinstance(part, Delta) and part.coordinates[0].free & frozenset(node.variables):
            return part
    return None


def _eliminated(node: Integral, what: Delta) -> list[Term]:
    """f delta(psi) + rest: the rest as it was, and f at the roots of psi."""
    hidden = fresh("delta", {n for t in postorder(node.body) for n in t.free})
    opened = _replaced(node.body, what, var(hidden))
    try:
        factor = partial(opened, hidden)
    except NotSmooth as problem:
        raise NoClosedForm("a delta is given to a function that is not known") from problem
    if hidden in factor.free:
        raise _product(what)
    rest = substitute(opened, {hidden: ZERO})
    terms: list[Term] = []
    if not vanishes(rest):
        terms.append(integral(node.variables, node.bounds, rest, node.hints))
    found = [
        (pivot.condition, [_at_root(node, what, factor, root) for root in pivot.roots])
        for pivot in pivots(node, what.coordinates[0])
    ]
    if len(found) == 1:
        return [*terms, *found[0][1]]  # each of them may hold the next delta, so they stay apart
    zero = zero_like(node.body)
    return [*terms, chosen([(condition, total(gains, zero)) for condition, gains in found])]


def _check_single(factor: Term, what: Delta, root: Root) -> None:
    """No other delta, and no jump, on the same surface."""
    for part in postorder(factor):
        if isinstance(part, Delta):
            there = substitute(part.coordinates[0], {root.variable: unguarded(root.at)})
            if root.variable in part.free and is_zero(there):
                raise _product(what)
    flips = flipping(branches_of(factor, (root.variable,)), root.variable, root.at)
    if flips and forced(factor, flips, True) is not forced(factor, flips, False):
        raise PottoError(
            (
                PRODUCT_OF_DELTAS(
                    Span(0, 0),
                    f"`delta({format_term(what.coordinates[0])})` stands right where its factor jumps",
                    label="a jump and a delta on one surface",
                    help="a delta takes the value of its factor on its surface, and there it has two",
                ),
            )
        )


def _product(what: Delta) -> PottoError:
    shown = format_term(what.coordinates[0])
    return PottoError(
        (
            PRODUCT_OF_DELTAS(
                Span(0, 0),
                f"`delta({shown})` is multiplied by a delta on the same surface, which has no meaning",
                label="a product of deltas",
                help="differentiate the integral as a whole, or let the two surfaces cross",
            ),
        )
    )


def _magnitude(slope: Term) -> Term:
    bounds = range_of(slope)
    if bounds.lo >= 0:
        return slope
    return neg(slope) if bounds.hi <= 0 else prim("abs", slope)


def _replaced(term: Term, old: Term, new: Term) -> Term:
    memo: dict[Term, Term] = {old: new}
    for node in postorder(term):
        if node not in memo:
            memo[node] = rebuild(node, tuple(memo[c] for c in children(node)))
    return memo[term]


def _at_root(node: Integral, what: Delta, factor: Term, root: Root) -> Term:
    place = {root.variable: root.at}
    _check_single(factor, what, root)
    slope = substitute(partial(what.coordinates[0], root.variable), place)
    weight = quotient(ONE, _magnitude(slope))
    value = scaled(factor, weight)
    lo, hi = node.bounds[node.variables.index(root.variable)]
    value = between(root.at, lo, hi, substitute(value, place))
    if root.index is not None and root.counts is not None:
        value = sum_(root.index, *root.counts, value)
    return remaining(node, root.variable, root.at, value)
