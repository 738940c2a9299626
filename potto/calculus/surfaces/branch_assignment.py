"""Branches and the sides of them that an integrand takes.

Owns `branches_of`, `flipping` and `forced`: which branches of an integrand flip at a root, and what the integrand is
just left and just right of it, every other branch as it falls.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from msgspec import Struct

from potto.calculus.algebra.ranges import Box, range_of
from potto.calculus.algebra.rational_form import as_term, is_zero, normal
from potto.calculus.differentiation.derivative import NotSmooth, partial
from potto.core.terms import (
    NAN,
    ONE,
    ZERO,
    Array,
    Branch,
    Fold,
    Integral,
    Lam,
    Sum,
    Term,
    branch,
    mul,
    neg,
    postorder,
    sub,
    substitute,
    transform,
)

NOWHERE: Box = {}


def branches_of(body: Term, variables: Iterable[str]) -> list[Branch]:
    """The branches of an integrand that vary with the variables and with nothing bound further in.

    Raises NotSmooth where the state of a fold decides one: it is another surface at each step.
    """
    names = frozenset(variables)
    inside, states = set[str](), set[str]()
    for node in postorder(body):
        if isinstance(node, Integral):
            inside.update(node.variables)
        elif isinstance(node, Lam):
            inside.update(node.params)
        elif isinstance(node, Fold) and not names.isdisjoint(node.free):
            states.add(node.state)
    found = [
        node
        for node in postorder(body)
        if isinstance(node, Branch) and node.surface.free & (names | states) and not node.surface.free & inside
    ]
    if any(not states.isdisjoint(item.surface.free) for item in found):
        raise NotSmooth("the state of a fold decides a condition in it")
    return found


class Loop(Struct, frozen=True):
    """The index of a sum, a fold or an array, from where to where."""

    variable: str
    lo: Term
    hi: Term


def loops_over(body: Term, branch_: Branch) -> list[Loop]:
    """The loops whose index a branch's surface uses, or the bounds of one of them, innermost first: it is one surface
    for each value. Loops beside each other that name and count alike move what is in both at once: they are one."""
    found, names = dict[Loop, None](), branch_.surface.free
    for node in postorder(body):
        if isinstance(node, Sum | Fold | Array) and node.variable in names:
            ends = (ZERO, sub(node.size, ONE)) if isinstance(node, Array) else (node.lo, node.hi)
            found[Loop(node.variable, *ends)] = None
            names = names.union(*(end.free for end in ends))
    return list(found)


class Flip(Struct, frozen=True):
    """A branch whose surface is 0 at a root, and terms with the signs of that surface just left and right of it."""

    branch: Branch
    left: Term
    right: Term


Flips = Sequence[Flip]


def forced(body: Term, flips: Flips, right: bool, box: Box = NOWHERE) -> Term:
    """The integrand just right (or left) of where the branches flip."""
    if not flips:
        return body
    signs = {f.branch: f.right if right else f.left for f in flips}

    def change(node: Term, new: Term) -> Term:
        if isinstance(node, Branch) and node in signs and isinstance(new, Branch):
            return side_of(signs[node], new.then, new.orelse, box)
        return new

    return transform(body, change)


def side_of(slope: Term, then: Term, orelse: Term, box: Box = NOWHERE) -> Term:
    """`then` where the slope is positive. One that is 0 only here and there may count as either."""
    bounds = range_of(slope, box)
    if then is orelse or bounds.hi <= 0:
        return orelse
    return then if bounds.lo >= 0 else branch((slope,), True, then, orelse)


def box_of(node: Integral, outer: Box = NOWHERE) -> dict[str, tuple[float, float]]:
    """The bounds of the variables of integration, as far as the form of the bounds shows them, and what is known around
    it."""
    box = dict(outer)
    for name, (lo, hi) in zip(node.variables, node.bounds, strict=True):
        a, b = range_of(lo, box), range_of(hi, box)
        box[name] = min(a.lo, b.lo), max(a.hi, b.hi)
    return box


def with_index(box: Box, name: str, low: Term, high: Term) -> dict[str, tuple[float, float]]:
    """A box with the range of an index as well; where that is empty, nothing is asked of it."""
    return {**box, name: (range_of(low, box).lo, range_of(high, box).hi)}


def flipping(
    branches: Iterable[Branch], variable: str, at: Term, known: Sequence[Branch] = (), bends: int = 3
) -> list[Flip]:
    """The branches whose surface is 0 where `variable = at` (`known` ones surely are), with their sides there.

    `bends`: how many kinks inside kinks are looked into.
    """
    found: list[Flip] = []
    for item in branches:
        if variable in item.surface.free:
            surface = without_poles(item.surface)
            if item in known or is_zero(substitute(surface, {variable: unguarded(at)})):
                signs = _signs(surface, variable, at, bends)
                if signs is not None:
                    found.append(Flip(item, *signs))
    return found


_HIGHEST = 4  # derivatives that are asked for a sign


def _signs(surface: Term, variable: str, at: Term, bends: int) -> tuple[Term, Term] | None:
    """Terms with the sign of a surface just left and right of its root; None if it is 0 around it."""
    bounds = range_of(surface)
    if bounds.lo >= 0 or bounds.hi <= 0:
        side = ONE if bounds.lo >= 0 else neg(ONE)
        return None if is_zero(surface) else (side, side)
    slope, parity = surface, 1
    for _ in range(_HIGHEST):
        slope, parity = partial(slope, variable), -parity
        left, right = _both(slope, variable, at, bends)
        if not (is_zero(unguarded(left)) and is_zero(unguarded(right))):
            return (neg(left) if parity < 0 else left), right
    return None


def _both(slope: Term, variable: str, at: Term, bends: int) -> tuple[Term, Term]:
    """A slope just left and right of a root, where the surface may have a kink."""
    inner = [n for n in postorder(slope) if isinstance(n, Branch) and variable in n.surface.free]
    flips = flipping(inner, variable, at, (), bends - 1) if inner and bends else []
    place = {variable: at}
    return substitute(forced(slope, flips, False), place), substitute(forced(slope, flips, True), place)


def unguarded(root: Term) -> Term:
    """A root as it is where it exists."""
    return transform(root, lambda _, new: new.then if isinstance(new, Branch) and new.orelse is NAN else new)


def without_poles(surface: Term) -> Term:
    """A surface with the same sign and no divisors: a/b as a*b."""
    if not any(getattr(n, "op", "") == "div" and n.free for n in postorder(surface)):
        return surface
    found = normal(surface)
    if found is None or found.whole:
        return surface
    top, below = as_term(found.top), as_term(found.below)
    return surface if top is None or below is None else mul(top, below)
