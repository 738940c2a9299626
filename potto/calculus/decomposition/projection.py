"""What the cuts of one variable leave in those further out: the projection of a cylindrical decomposition.

Owns `shadows_of_cuts`, `shadows_of_roots`, and which cuts meet.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

from msgspec import Struct

from potto.calculus.algebra.rational_form import settled
from potto.calculus.decomposition.conic_regions import Edges
from potto.calculus.decomposition.critical import (
    MOST_EQUATIONS,
    Critical,
    Within,
    folds,
    infinite,
    scattered,
    shadows,
)
from potto.calculus.decomposition.lifts import Lift, crossed, turned
from potto.calculus.decomposition.strata import Stratum, known, met
from potto.calculus.decomposition.surface_cuts import RATIONAL, Cut, along, sections_in
from potto.calculus.solving.enclosable import slope_of
from potto.calculus.solving.solve import Sections
from potto.core.simplify import simplify
from potto.core.terms import Branch, Prim, Term, postorder, sub, substitute, var

# Surfaces whose crossings are worked out, if they are kinks: those of crossings come to hundreds; the same, if they are
# jumps, or if it is known where in space they come from, since few of these meet: not so where variables are more.
MOST_PAIRS, MOST_JUMPS, IN_SPACE = 12, 48, 3
MOST_SYSTEMS = 600  # whose places are projected further out: pairs of surfaces, of which 34 have so many


class Shadow(Struct, frozen=True):
    """A surface, whether what is left is like a square root there, whether it jumps, and where in space it comes from,
    if that is known: on which strata, and at which places."""

    surface: Term
    turning: bool
    steps: bool
    strata: tuple[Stratum, ...] = ()
    lifts: tuple[Lift, ...] = ()


class Here(Struct, frozen=True):
    """Where a projection has come to. chain: the variables that were integrated over, innermost first, up to the one
    whose cuts are projected. further: the variables further out, the first of them `nearest`. names: all of them."""

    chain: tuple[Within, ...]
    further: frozenset[str]
    nearest: str
    names: frozenset[str]

    @property
    def within(self) -> Within:
        return self.chain[-1]

    @property
    def variable(self) -> str:
        return self.within.variable

    @property
    def inner(self) -> frozenset[str]:
        return frozenset(w.variable for w in self.chain)


def further_systems(systems: tuple[Critical, ...], cuts: tuple[Cut, ...], here: Here) -> Iterator[Critical]:
    """What the critical places along one variable leave in those further out."""
    if not systems:
        return
    roots = [root for cut in cuts if cut.decides for root in cut.roots or ()]
    searched = [cut.surface for cut in cuts if cut.decides and cut.roots is None]
    yield from shadows(systems[:MOST_SYSTEMS], here.within, here.names, roots, searched)


def shadows_of_cuts(
    cuts: Sequence[Cut], edges: Edges, here: Here
) -> Iterator[Shadow | Critical]:  # fmt: skip
    """What the cuts of one variable leave in those further out. edges: further cuts, the lines and conics around a
    region, whose crossings with each other are its corners, which are looked for by themselves."""
    lines, conics = edges
    for cut in (*cuts, *conics):
        yield from _at_bounds(cut, here.within, False)
        yield from _turning(cut, here)
    meeting, _ = crossing(cuts, here.variable, here.further, here.names)
    for first in meeting:
        for second in meeting:
            if first is not second and first.key.digest < second.key.digest:
                yield from _crossings(first, second, here)
        for edge in (*lines, *conics):
            yield from _crossings(first, edge, here)


def shadows_of_roots(own: Cut, cuts: tuple[Cut, ...], here: Here, alone: bool) -> Iterator[Shadow | Critical]:
    """What a sum over the roots of one surface leaves: it jumps where they meet a bound, or a jump of what is summed,
    and bends where they meet a bend of that.

    alone: no other variable has a share, so that the sum is infinite where roots merge.
    """
    yield from _at_bounds(own, here.within, True)
    yield from _turning(own, here, alone)
    for cut in crossing(cuts, here.variable, here.further, here.names)[0]:
        yield from _crossings(own, cut, here, cut.decides)


def _at_bounds(cut: Cut, within: Within, steps: bool) -> Iterator[Shadow]:
    for bound in (within.lo, within.hi):
        if not infinite(bound):
            face = sub(var(within.variable), bound)
            strata = tuple(stratum.on(face) for stratum in cut.strata)
            lifts = tuple(lift.on(face, within.variable, bound) for lift in cut.lifts)
            yield Shadow(substitute(along(cut), {within.variable: bound}), False, steps, strata, lifts)


def _turning(cut: Cut, here: Here, steps: bool = False) -> Iterator[Shadow | Critical]:
    """Where the roots of a cut appear, merge or turn. Formulas of formulas grow from one to the next; where there are
    two or more variables further out, systems in the surfaces as they are take the place of what is more than a
    radical."""
    surface, variable, within = along(cut), here.variable, here.within
    strata = tuple(stratum.turning(variable) for stratum in cut.strata)
    if cut.roots is None or (cut.families and _by_numbers(surface, variable, here.further)):
        yield from folds(surface, variable, within.lo, within.hi, steps)
        if cut.roots is not None:
            return
    found = sections_in(surface, variable)
    if cut.product is None and not (isinstance(found, Sections) and found.complete):
        found = sections_in(cut.key, variable)
    if isinstance(found, Sections):
        lifts = turned(cut.lifts, surface, variable)
        for turn in found.turning:
            yield Shadow(turn, True, False, strata, lifts)
        for stop in dict.fromkeys(stop for family in found.families for stop in family.stops):
            yield Shadow(substitute(surface, {variable: stop}), True, False)


def crossing(
    cuts: Sequence[Cut], variable: str, further: frozenset[str], names: frozenset[str]
) -> tuple[list[Cut], bool]:
    """The cuts whose crossings are worked out, and whether those are all that may cross. names: the variables of
    integration."""
    meeting = [c for c in cuts if c.roots or c.families or c.roots is None]
    meeting = [c for c in meeting if not scattered(along(c), variable, further)]
    few = len(names) <= IN_SPACE
    most = [MOST_JUMPS if c.decides or (few and known(c.strata, names)) else MOST_PAIRS for c in meeting]
    chosen = [c for n, c in enumerate(meeting) if n < most[n]]
    return chosen, chosen == meeting


def _by_numbers(surface: Term, variable: str, further: frozenset[str]) -> bool:
    """Whether what a surface leaves in variables further out is better searched for."""
    return len(surface.free & further) >= 2 and slope_of(surface, variable) is not None


def _crossings(first: Cut, second: Cut, here: Here, steps: bool = False) -> Iterator[Shadow | Critical]:
    """Where two sections meet: the simpler one's roots put into the other's surface, where they are all known."""
    strata = met(first.strata, second.strata, here.inner, here.names)
    if strata is not None and not strata:
        return
    solved = [c for c in (first, second) if c.roots is not None and not c.families]
    a = min(solved, key=lambda c: (len(c.roots or ()), sum(_size(r) for r in c.roots or ())), default=None)
    radical = a is not None and any(_radical(root) for root in a.roots or ())
    if radical and len(here.chain) > 1 and (vertices := _vertices(strata, here, steps)):
        yield from vertices
        return
    searched = a is None or (
        radical and all(_by_numbers(along(c), here.variable, here.further) for c in (first, second))
    )
    meetings, roots = list[Term](), list[Term]()
    if a is not None:
        b, roots = (second if a is first else first), list(a.roots or ())
        meetings = [simplify(substitute(b.surface, {here.variable: root})) for root in roots]
    if searched:  # by numbers, where the places are isolated: of two spheres a circle may be at one distance from here
        meetings = [settled(meeting, frozenset((here.nearest,))) for meeting in meetings]
    if a is None or (searched and any(here.nearest in meeting.free for meeting in meetings)):
        yield Critical((along(first), along(second)), (here.within,), False, steps)
        return
    for meeting, root in zip(meetings, roots, strict=True):
        if meeting.free:
            lifts = crossed(first.lifts, second.lifts, strata, here.chain, root)
            yield Shadow(meeting, False, steps, strata or (), lifts)


def _vertices(strata: Sequence[Stratum] | None, here: Here, steps: bool) -> list[Critical]:
    """Systems in the surfaces as they are for the places where strata meet, where these are isolated and on no bound:
    formulas of roots within roots lose digits, and are 0 at places besides."""
    bounds = {sub(var(w.variable), bound) for w in here.chain for bound in (w.lo, w.hi)}
    found = [Critical(tuple(sorted(stratum.surfaces, key=lambda s: s.digest)), here.chain, False, steps)
             for stratum in strata or ()
             if not stratum.folded and len(stratum.surfaces) == 1 + len(here.chain) <= MOST_EQUATIONS
             and bounds.isdisjoint(stratum.surfaces)]  # fmt: skip
    return found if len(found) == len(strata or ()) else []


def _radical(root: Term) -> bool:
    """Whether a root is more than a quotient of polynomials."""
    return any(isinstance(node, Branch) or (isinstance(node, Prim) and node.op not in RATIONAL)
               for node in postorder(root))  # fmt: skip


@lru_cache(maxsize=8192)
def _size(term: Term) -> int:
    return len(postorder(term))
