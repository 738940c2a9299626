"""Dirac deltas, integrated out.

Owns `without_deltas` and `without_leftovers`: the integral of f delta(psi) over v is the sum of f/|dpsi/dv| over the
roots of psi in v that lie between the bounds. Where the roots have no closed form the integral is one over a level
set, and stays (`level_sets`). A delta met twice on one surface has no meaning: that is an error, not a number.
"""

from __future__ import annotations

from potto.calculus.algebra.radicals import quotient
from potto.calculus.algebra.ranges import range_of
from potto.calculus.algebra.rational_form import is_zero
from potto.calculus.differentiation import level_sets
from potto.calculus.differentiation.between import between, scaled
from potto.calculus.differentiation.boundary_terms import remaining
from potto.calculus.differentiation.derivative import partial, total, vanishes, zero_like
from potto.calculus.solving.pivots import NoClosedForm, Roots, SurfaceRoot, chosen, pivots
from potto.calculus.surfaces.branch_assignment import branches_of, flipping, forced, unguarded
from potto.calculus.surfaces.case_split import by_choices
from potto.core.printer import format_term
from potto.core.simplify import normalized_surface
from potto.core.terms import (
    ONE,
    ZERO,
    Branch,
    Delta,
    Integral,
    Sum,
    Term,
    Tuple,
    children,
    delta,
    neg,
    postorder,
    prim,
    substitute,
    sum_,
    transform,
    tuple_,
    with_integrand,
    with_summand,
)
from potto.diagnostics import PottoError, declare
from potto.source import Span

PRODUCT_OF_DELTAS = declare("P0505", "a product of deltas on the same surface")

_MOST = 64  # deltas integrated out of one integral


def without_deltas(node: Integral, wanted: Roots = Roots.STEADY) -> Term:
    """The integral with every delta over its variables integrated out that can be, those of level sets left. Raises
    PottoError (P0505). wanted: at which roots."""
    if not any(isinstance(n, Delta) for n in postorder(node.body)):
        return node
    body = by_choices(_inner_first(node.body, wanted))
    if body is not node.body:
        node = with_integrand(node, body)
    parts: list[Term] = []
    waiting: list[Term] = [node]
    for _ in range(_MOST):
        if not waiting:
            break
        term = waiting.pop()
        found = _next(term, wanted) if isinstance(term, Integral) else None
        if found is None:
            parts.append(term)
        else:
            waiting.extend(found)
    return total(parts + waiting, zero_like(node.body))


def without_leftovers(term: Term) -> Term:
    """Deltas that are left outside of level sets vary with no variable of integration: they stand for a jump that
    nothing sweeps."""

    def below(node: Term) -> tuple[Term, ...]:
        return () if isinstance(node, Integral) and level_sets.level_set(node) is not None else children(node)

    return transform(term, lambda _, new: ZERO if isinstance(new, Delta) else new, below)


def _inner_first(body: Term, wanted: Roots) -> Term:
    return transform(body, lambda _, new: without_deltas(new, wanted) if isinstance(new, Integral) else new)


def _next(node: Integral, wanted: Roots) -> list[Term] | None:
    """What an integral comes to with one delta integrated out, or in a summand of its own; None if nothing is left."""
    if level_sets.placed_along(node) is not None:
        return None
    reason: NoClosedForm | None = None
    deltas = level_sets.deltas_over(node)
    for item in postorder(node.body):
        if isinstance(item, Sum) and any(item.variable in what.coordinates[0].free for what in deltas):
            return _summed(node, item, wanted)
    for what in deltas:
        parts = level_sets.coefficient(node.body, what)
        if parts is None:
            raise _product(what)
        factor, rest = parts
        alone = [] if vanishes(rest) else [with_integrand(node, rest)]
        if level_sets.is_steep(what):
            return [*alone, *level_sets.by_parts(node, what, factor)]
        try:
            return [*alone, *_eliminated(node, what, factor, wanted)]
        except NoClosedForm as problem:
            reason = problem
            _check_apart(factor, what)
        if alone:
            body = scaled(factor, delta(what.coordinates[:1]))
            return [*alone, with_integrand(node, body)]
    if reason is None or level_sets.level_set(node) is not None:
        return None
    if wanted is Roots.STEADY and len(deltas) == len(node.variables):  # they leave points, hardly where one turns back
        return _next(node, Roots.ALL)
    raise NoClosedForm(f"two surfaces meet, neither of which can be solved for a variable: {reason}")


def _summed(node: Integral, item: Sum, wanted: Roots) -> list[Term]:
    """A sum of deltas as a sum of integrals. Raises NoClosedForm, PottoError (P0505)."""
    parts = level_sets.coefficient(node.body, item)
    if parts is None:
        raise _product(next(n for n in postorder(item.body) if isinstance(n, Delta)))
    if (item.lo.free | item.hi.free) & frozenset(node.variables):
        raise NoClosedForm("how many deltas there are varies with a variable of integration")
    factor, rest = parts
    each = with_integrand(node, _times(factor, item.body))
    whole = with_summand(item, without_deltas(each, wanted))
    return [whole] if vanishes(rest) else [whole, with_integrand(node, rest)]


def _times(factor: Term, value: Term) -> Term:
    """The product of a number and a number, or a tuple."""
    if isinstance(factor, Tuple) and isinstance(value, Tuple):
        return tuple_(_times(a, b) for a, b in zip(factor.items, value.items, strict=True))
    return scaled(factor, value) if isinstance(factor, Tuple) else scaled(value, factor)


def _eliminated(node: Integral, what: Delta, factor: Term, wanted: Roots) -> list[Term]:
    """f delta(psi): f at the roots of psi. Raises NoClosedForm."""
    found = [
        (pivot.condition, [_at_root(node, what, factor, root) for root in pivot.roots])
        for pivot in pivots(node, what.coordinates[0], wanted)
    ]
    if len(found) == 1:
        return found[0][1]  # each of them may hold the next delta, so they stay apart
    zero = zero_like(node.body)
    return [chosen([(condition, total(gains, zero)) for condition, gains in found])]


def _check_apart(factor: Term, what: Delta) -> None:
    """No other delta, and no jump, on the same surface, which is not known along any variable."""
    key = normalized_surface(what.coordinates[0])[0]
    for part in postorder(factor):
        if isinstance(part, Delta) and normalized_surface(part.coordinates[0])[0] is key:
            raise _product(what)
        if isinstance(part, Branch) and normalized_surface(part.surface)[0] is key:
            raise _jump(what)


def _check_single(factor: Term, what: Delta, root: SurfaceRoot) -> None:
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
    return _product_of_deltas(
        what,
        "stands right where its factor jumps",
        label="a jump and a delta on one surface",
        help="a delta takes the value of its factor on its surface, and there it has two",
    )


def _product(what: Delta) -> PottoError:
    return _product_of_deltas(
        what,
        "is multiplied by a delta on the same surface, which has no meaning",
        label="a product of deltas",
        help="differentiate the integral as a whole, or let the two surfaces cross",
    )


def _product_of_deltas(what: Delta, wrong: str, label: str, help: str) -> PottoError:
    message = f"`delta({format_term(what.coordinates[0])})` {wrong}"
    return PottoError((PRODUCT_OF_DELTAS(Span(0, 0), message, label=label, help=help),))


def _magnitude(slope: Term) -> Term:
    bounds = range_of(slope)
    if bounds.lo >= 0:
        return slope
    return neg(slope) if bounds.hi <= 0 else prim("abs", slope)


def _at_root(node: Integral, what: Delta, factor: Term, root: SurfaceRoot) -> Term:
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
