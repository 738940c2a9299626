"""Branches and the sides of them that an integrand takes.

Owns `branches_of`, `flipping` and `forced`: which branches of an integrand flip at a root, and what the integrand is
just left and just right of it, every other branch as it falls.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from potto.calculus.derivative import partial
from potto.calculus.isolate import NAN
from potto.calculus.normal import as_term, normal
from potto.calculus.ranges import range_of
from potto.core.simplify import is_zero
from potto.core.terms import (
    Branch,
    Integral,
    Lam,
    Sum,
    Term,
    branch,
    children,
    mul,
    neg,
    postorder,
    rebuild,
    substitute,
)

Flips = Sequence[tuple[Branch, Term]]
Box = Mapping[str, tuple[float, float]]
NOWHERE: Box = {}


def branches_of(body: Term, variables: Iterable[str]) -> list[Branch]:
    """The branches of an integrand that vary with the variables and with nothing bound further in."""
    names = frozenset(variables)
    inside: set[str] = set()
    for node in postorder(body):
        if isinstance(node, Integral):
            inside.update(node.variables)
        elif isinstance(node, Lam):
            inside.update(node.params)
    return [
        node
        for node in postorder(body)
        if isinstance(node, Branch) and node.surface.free & names and not node.surface.free & inside
    ]


def summed_over(body: Term, branch_: Branch) -> list[Sum]:
    """The sums whose index a branch's surface uses: it is one surface for each value."""
    return [node for node in postorder(body) if isinstance(node, Sum) and node.variable in branch_.surface.free]


def forced(body: Term, flips: Flips, right: bool, box: Box = NOWHERE) -> Term:
    """The integrand just right (or left) of where the branches flip; each with the slope of its surface there."""
    if not flips:
        return body
    slopes = dict(flips)
    memo: dict[Term, Term] = {}
    for node in postorder(body):
        new = rebuild(node, tuple(memo[c] for c in children(node)))
        if isinstance(node, Branch) and node in slopes and isinstance(new, Branch):
            new = side_of(slopes[node] if right else neg(slopes[node]), new.then, new.orelse, box)
        memo[node] = new
    return memo[body]


def side_of(slope: Term, then: Term, orelse: Term, box: Box = NOWHERE) -> Term:
    """`then` where the slope is positive. One that is 0 only here and there may count as either."""
    bounds = range_of(slope, box)
    if then is orelse or bounds.hi <= 0:
        return orelse
    return then if bounds.lo >= 0 else branch((slope,), True, then, orelse)


def box_of(node: Integral) -> dict[str, tuple[float, float]]:
    """The bounds of the variables of integration, as far as the form of the bounds shows them."""
    box: dict[str, tuple[float, float]] = {}
    for name, (lo, hi) in zip(node.variables, node.bounds, strict=True):
        a, b = range_of(lo, box), range_of(hi, box)
        box[name] = min(a.lo, b.lo), max(a.hi, b.hi)
    return box


def flipping(
    branches: Iterable[Branch], variable: str, at: Term, known: Sequence[Branch] = ()
) -> list[tuple[Branch, Term]]:
    """The branches whose surface is 0 where `variable = at` (`known` ones surely are), each with its slope there."""
    bare = unguarded(at)
    found: list[tuple[Branch, Term]] = []
    for item in branches:
        if variable in item.surface.free:
            surface = without_poles(item.surface)
            if item in known or is_zero(substitute(surface, {variable: bare})):
                found.append((item, substitute(partial(surface, variable), {variable: at})))
    return found


def unguarded(root: Term) -> Term:
    """A root as it is where it exists."""
    memo: dict[Term, Term] = {}
    for node in postorder(root):
        new = rebuild(node, tuple(memo[c] for c in children(node)))
        memo[node] = new.then if isinstance(new, Branch) and new.orelse is NAN else new
    return memo[root]


def without_poles(surface: Term) -> Term:
    """A surface with the same sign and no divisors: a/b as a*b."""
    if not any(getattr(n, "op", "") == "div" and n.free for n in postorder(surface)):
        return surface
    found = normal(surface)
    if found is None or found.whole:
        return surface
    top, below = as_term(found.top), as_term(found.below)
    return surface if top is None or below is None else mul(top, below)
