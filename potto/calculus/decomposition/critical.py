"""Critical places: where what is left of integrals further in is not smooth, as the solution of a system of equations.

Owns `Critical`, and what one leaves in the variables further out. Two surfaces meet where both are 0; the sections of
one surface appear or merge where it and its slope are 0. Neither needs closed-form roots: numbers find the places
(`integrate/decomposition/critical_places`). Projecting such systems one variable further out, until none is left, is
the projection of a cylindrical decomposition (Collins 1975), done by numbers rather than by resultants.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache

from msgspec import Struct

from potto.calculus.algebra.affine import determinant
from potto.calculus.algebra.degree import quadric
from potto.calculus.algebra.point_values import not_zero, sample_value
from potto.calculus.algebra.radicals import squared
from potto.calculus.algebra.ranges import range_of, vanishing
from potto.calculus.differentiation.derivative import NotSmooth, partial
from potto.calculus.solving.enclosable import enclosable, slope_of
from potto.core.simplify import simplify
from potto.core.terms import Prim, Term, mul, sub, substitute

MOST_EQUATIONS = 3  # a search takes about 2^n times as long for n of them


class Within(Struct, frozen=True):
    """A variable further in, and its bounds, which may depend on those between."""

    variable: str
    lo: Term
    hi: Term


class Critical(Struct, frozen=True):
    """Where all equations are 0 for some values of the variables of `within`, innermost first: one fewer than those.

    turning: what is integrated further in changes there like a square root, or worse. steps: it jumps there, or is
        infinite, so that nodes move with the place.
    """

    equations: tuple[Term, ...]
    within: tuple[Within, ...]
    turning: bool = False
    steps: bool = False

    @property
    def free(self) -> frozenset[str]:
        """What the place depends on."""
        names = frozenset().union(*(e.free for e in self.equations), *(w.lo.free | w.hi.free for w in self.within))
        return names - {w.variable for w in self.within}

    def mapped(self, change: Callable[[Term], Term]) -> Critical:
        """The system with its equations changed."""
        return Critical(tuple(map(change, self.equations)), self.within, self.turning, self.steps)

    def at(self, variable: str, value: Term) -> Critical:
        """The system with a variable further out replaced."""
        put = {variable: value}
        within = tuple(Within(w.variable, substitute(w.lo, put), substitute(w.hi, put)) for w in self.within)
        return Critical(tuple(simplify(substitute(e, put)) for e in self.equations), within, self.turning)


@lru_cache(maxsize=1024)
def slopes_of(system: Critical, variable: str) -> tuple[Term, ...] | None:
    """The derivatives of the equations, row by row, by the variable further out, then by those of `within`; None if the
    solutions can't be searched for."""
    ends = (end for w in system.within for end in (w.lo, w.hi))
    if not all(enclosable(t, jumps=True) for t in (*system.equations, *ends)):
        return None
    names = (variable, *(w.variable for w in system.within))
    try:
        slopes = tuple(simplify(partial(e, name)) for e in system.equations for name in names)
    except NotSmooth:
        return None
    return slopes if all(enclosable(t, jumps=True) for t in slopes) else None


def folds(surface: Term, variable: str, lo: Term, hi: Term, steps: bool = False) -> Iterator[Critical]:
    """Where sections of a surface along a variable appear or merge; nothing where that can't be searched for."""
    slope = slope_of(surface, variable)
    if slope is None:
        return
    for factor in vanishing(slope):
        yield Critical((surface, factor), (Within(variable, lo, hi),), True, steps)


@lru_cache(maxsize=1024)
def scattered(surface: Term, variable: str, further: frozenset[str]) -> bool:
    """Whether a surface is 0 at single places only, by its form: a sum of squares that vary independently.

    Of what else is integrated no section crosses it, but where parameters are such that it happens to.
    """
    if not (isinstance(surface, Prim) and surface.op == "add" and all(range_of(a).lo >= 0 for a in surface.args)):
        return False
    bases = [base for a in surface.args if (base := squared(a)) is not None and variable in base.free]
    try:
        slopes = [[(partial(base, variable), partial(base, other)) for base in bases] for other in further]
    except NotSmooth:
        return False
    return any(not_zero(sub(mul(p, s), mul(q, r))) for rows in slopes for p, q in rows for r, s in rows)


def shadows(
    found: Sequence[Critical], here: Within, names: frozenset[str], roots: Sequence[Term], searched: Sequence[Term]
) -> Iterator[Critical]:
    """What the critical places along one variable leave in those further out: where they meet its bounds, turn, or meet
    a third surface at one place further in. What meets them elsewhere further in adds up with them, smoothly.

    roots, searched: places and surfaces that cut the variable as bounds do. names: the variables of integration. Where
    a silhouette touches an edge nothing happens, but where a surface has edges of its own it may.
    """
    variable, lo, hi = here.variable, here.lo, here.hi
    known = dict.fromkeys(found)
    for system in found:
        for place in (*(bound for bound in (lo, hi) if not infinite(bound)), *roots):
            at = system.at(variable, place)
            if all(e.free for e in at.equations):
                yield at
        del known[system]
        if len(system.equations) >= MOST_EQUATIONS:
            continue
        within = (*system.within, here)
        for turn in _turns(system, variable):
            yield Critical((*system.equations, turn), within, True)
        smooth = all(quadric(surface, names) for surface in system.equations)
        for slope in () if smooth else _slopes(system):
            yield Critical((*system.equations, slope), within)
        for surface in searched:
            if surface not in system.equations:
                yield Critical((*system.equations, surface), within, system.turning)
        for other in known:
            if smooth and (system.turning or other.turning):
                continue
            union = tuple(dict.fromkeys((*system.equations, *other.equations)))
            if other.within == system.within and len(union) == len(system.equations) + 1:
                yield Critical(union, within)


def _slopes(system: Critical) -> Iterator[Term]:
    """Where one of the surfaces of a system folds."""
    for surface in system.equations if not system.turning else ():
        slope = slope_of(surface, system.within[0].variable)
        if slope is not None:
            yield from vanishing(slope)


def infinite(bound: Term) -> bool:
    return not bound.free and math.isinf(sample_value(bound, {}))


def _turns(system: Critical, variable: str) -> Iterator[Term]:
    """Where the place of a system turns back along a variable: factors of the determinant by this and those within."""
    names = (*(w.variable for w in system.within), variable)
    surface, slope = system.equations[0], system.equations[-1]
    try:
        if len(system.equations) == 2 and slope == slope_of(surface, names[0]):
            whole = [partial(surface, variable), partial(slope, names[0])]  # on it the slope is 0
        else:
            whole = [determinant(tuple(tuple(partial(e, name) for name in names) for e in system.equations))]
    except NotSmooth:
        return
    for turn in whole:
        for factor in vanishing(simplify(turn)):
            if enclosable(factor, jumps=True):
                yield factor
