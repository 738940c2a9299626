"""Dirac deltas, integrated out.

Owns `without_deltas`: the integral of f delta(psi) over v is the sum of f/|dpsi/dv| over the roots of psi in v that
lie between the bounds. Where the roots have no closed form, that of a monotone psi is the length on which psi has not
changed its sign yet, an integral like others; and if psi is not known to be monotone, the delta is the tangent of
[psi + s >= 0] by s. A delta met twice on one surface has no meaning: that is an error, not a number.
"""

from __future__ import annotations

from potto.calculus.algebra.radicals import quotient
from potto.calculus.algebra.ranges import range_of
from potto.calculus.differentiation.boundary_terms import above, between, finite, remaining, scaled, total, vanishes
from potto.calculus.differentiation.derivative import NotSmooth, partial, zero_like
from potto.calculus.solving.pivots import NoClosedForm, Root, chosen, pivots
from potto.calculus.surfaces.branch_assignment import box_of, branches_of, flipping, forced, unguarded
from potto.core.printer import format_term
from potto.core.simplify import is_zero, normalized_surface
from potto.core.terms import (
    ONE,
    ZERO,
    Branch,
    Delta,
    Integral,
    Term,
    add,
    app,
    branch,
    children,
    deriv,
    fresh,
    integral,
    lam,
    neg,
    postorder,
    prim,
    proj,
    rebuild,
    sub,
    substitute,
    sum_,
    tuple_,
    var,
)
from potto.diagnostics import PottoError, declare
from potto.source import Span

PRODUCT_OF_DELTAS = declare("P0505", "a product of deltas on the same surface")

STEP = "step@"  # what the names of steps begin with, as no other does
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
    try:
        found = [
            (pivot.condition, [_at_root(node, what, factor, root) for root in pivot.roots])
            for pivot in pivots(node, what.coordinates[0])
        ]
    except NoClosedForm:
        return [*terms, _by_numbers(node, what, factor)]
    if len(found) == 1:
        return [*terms, *found[0][1]]  # each of them may hold the next delta, so they stay apart
    zero = zero_like(node.body)
    return [*terms, chosen([(condition, total(gains, zero)) for condition, gains in found])]


def _by_numbers(node: Integral, what: Delta, factor: Term) -> Term:
    """f delta(psi) without a formula for the roots of psi."""
    surface = what.coordinates[0]
    key = normalized_surface(surface)[0]
    for part in postorder(factor):
        if isinstance(part, Delta) and normalized_surface(part.coordinates[0])[0] is key:
            raise _product(what)
        if isinstance(part, Branch) and normalized_surface(part.surface)[0] is key:
            raise _jump(what)
    for name in reversed(node.variables):
        if name in surface.free:
            slope = range_of(partial(surface, name), box_of(node))
            if slope.positive or slope.negative:
                return _at_searched_root(node, what, factor, name, surface if slope.positive else neg(surface))
    step = fresh(STEP, {n for t in postorder(node) for n in t.free})
    jump = branch((add(surface, var(step)),), False, ONE, ZERO)
    moved = integral(node.variables, node.bounds, scaled(factor, jump), node.hints)
    return proj(app(deriv(lam((step,), moved)), (tuple_((ZERO, ONE)),)), 1)


def _at_searched_root(node: Integral, what: Delta, factor: Term, name: str, rising: Term) -> Term:
    """Where the rising surface has different signs at the ends the root lies between them."""
    lo, hi = node.bounds[node.variables.index(name)]
    ordered = range_of(sub(hi, lo)).lo >= 0
    low, high = (lo, hi) if ordered else (prim("min", lo, hi), prim("max", lo, hi))
    place = _turn(name, low, high, rising)
    weight = quotient(ONE, _magnitude(partial(what.coordinates[0], name)))
    value = substitute(scaled(factor, weight), {name: place})
    first, last = (substitute(rising, {name: end}) for end in (low, high))
    value = above(last, above(neg(first), value))
    if not ordered:
        value = branch((sub(hi, lo),), False, value, scaled(value, neg(ONE)))
    return remaining(node, name, place, value)


def _turn(name: str, low: Term, high: Term, rising: Term) -> Term:
    """Where a rising surface turns positive, by the lengths on which it is, or is not yet, from a finite place on."""
    start = low if finite(low) else high if finite(high) else ZERO
    place = start
    if start is not high:
        place = add(place, integral((name,), ((start, high),), branch((rising,), False, ZERO, ONE), ((),)))
    if start is not low:
        place = sub(place, integral((name,), ((low, start),), branch((rising,), False, ONE, ZERO), ((),)))
    return place


def _check_single(factor: Term, what: Delta, root: Root) -> None:
    """No other delta, and no jump, on the same surface."""
    for part in postorder(factor):
        if isinstance(part, Delta):
            there = substitute(part.coordinates[0], {root.variable: unguarded(root.at)})
            if root.variable in part.free and is_zero(there):
                raise _product(what)
    flips = flipping(branches_of(factor, (root.variable,)), root.variable, root.at)
    if flips and forced(factor, flips, True) is not forced(factor, flips, False):
        raise _jump(what)


def _jump(what: Delta) -> PottoError:
    return PottoError(
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
