"""What the cuts of one variable leave in those further out: the projection of a cylindrical decomposition.

Owns `shadows_of_cuts`, `shadows_of_roots`, and which cuts meet.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

from potto.calculus.algebra.rational_form import settled
from potto.calculus.decomposition.conic_regions import Edges
from potto.calculus.decomposition.critical import Critical, Within, folds, infinite, scattered, shadows
from potto.calculus.decomposition.surface_cuts import RATIONAL, Cut, along, sections_in
from potto.calculus.solving.enclosable import slope_of
from potto.calculus.solving.solve import Sections
from potto.core.simplify import simplify
from potto.core.terms import Branch, Prim, Term, postorder, substitute

MOST_PAIRS = 12  # surfaces whose crossings are worked out, if they are kinks: those of crossings come to hundreds
MOST_JUMPS = 48  # the same, if they are jumps
# A surface, whether what is left is like a square root there, and whether it jumps; or a system.
Shadow = tuple[Term, bool, bool] | Critical


def further_systems(
    systems: tuple[Critical, ...], cuts: tuple[Cut, ...], variable: str, lo: Term, hi: Term
) -> Iterator[Critical]:
    """What the critical places along one variable leave in those further out."""
    if not systems:
        return
    roots = [root for cut in cuts if cut.decides for root in cut.roots or ()]
    searched = [cut.surface for cut in cuts if cut.decides and cut.roots is None]
    yield from shadows(systems[:MOST_PAIRS], variable, lo, hi, roots, searched)


def shadows_of_cuts(
    cuts: Sequence[Cut], edges: Edges, within: Within, further: frozenset[str], nearest: str
) -> Iterator[Shadow]:  # fmt: skip
    """What the cuts of one variable leave in those further out, `nearest` the first of these. edges: further cuts, the
    lines and conics around a region, whose crossings with each other are its corners, which are looked for by
    themselves."""
    lines, conics = edges
    for cut in (*cuts, *conics):
        yield from _at_bounds(cut, within, False)
        yield from _turning(cut, within, further)
    meeting, _ = crossing(cuts, within.variable, further)
    for first in meeting:
        for second in meeting:
            if first is not second and first.key.digest < second.key.digest:
                yield from _crossings(first, second, within, further, nearest)
        for edge in (*lines, *conics):
            yield from _crossings(first, edge, within, further, nearest)


def shadows_of_roots(
    own: Cut, cuts: tuple[Cut, ...], within: Within, further: frozenset[str], nearest: str, alone: bool
) -> Iterator[Shadow]:
    """What a sum over the roots of one surface leaves: it jumps where they meet a bound, or a jump of what is summed.

    alone: no other variable has a share, so that the sum is infinite where roots merge.
    """
    yield from _at_bounds(own, within, True)
    yield from _turning(own, within, further, alone)
    for cut in cuts:
        if cut.decides:
            yield from _crossings(own, cut, within, further, nearest, True)


def _at_bounds(cut: Cut, within: Within, steps: bool) -> Iterator[Shadow]:
    for bound in (within.lo, within.hi):
        if not infinite(bound):
            yield substitute(along(cut), {within.variable: bound}), False, steps


def _turning(cut: Cut, within: Within, further: frozenset[str], steps: bool = False) -> Iterator[Shadow]:
    """Where the roots of a cut appear, merge or turn.

    further: the variables further out. Formulas of formulas grow from one to the next; where there are two or more,
    systems in the surfaces as they are take the place of what is more than a radical.
    """
    surface, variable = along(cut), within.variable
    if cut.roots is None or (cut.families and _by_numbers(surface, variable, further)):
        yield from folds(surface, variable, within.lo, within.hi, steps)
        if cut.roots is not None:
            return
    found = sections_in(surface, variable)
    if cut.product is None and not (isinstance(found, Sections) and found.complete):
        found = sections_in(cut.key, variable)
    if isinstance(found, Sections):
        for turn in found.turning:
            yield turn, True, False
        for stop in dict.fromkeys(stop for family in found.families for stop in family.stops):
            yield substitute(surface, {variable: stop}), True, False


def crossing(cuts: Sequence[Cut], variable: str, further: frozenset[str]) -> tuple[list[Cut], bool]:
    """The cuts whose crossings are worked out, and whether those are all that may cross."""
    meeting = [c for c in cuts if c.roots or c.families or c.roots is None]
    meeting = [c for c in meeting if not scattered(along(c), variable, further)]
    chosen = [c for n, c in enumerate(meeting) if n < (MOST_JUMPS if c.decides else MOST_PAIRS)]
    return chosen, chosen == meeting


def _by_numbers(surface: Term, variable: str, further: frozenset[str]) -> bool:
    """Whether what a surface leaves in variables further out is better searched for."""
    return len(surface.free & further) >= 2 and slope_of(surface, variable) is not None


def _crossings(
    first: Cut, second: Cut, within: Within, further: frozenset[str], nearest: str, steps: bool = False
) -> Iterator[Shadow]:
    """Where two sections meet: the simpler one's roots put into the other's surface, where they are all known."""
    solved = [c for c in (first, second) if c.roots is not None and not c.families]
    a = min(solved, key=lambda c: (len(c.roots or ()), sum(_size(r) for r in c.roots or ())), default=None)
    searched = a is None or (
        any(_radical(root) for root in a.roots or ())
        and all(_by_numbers(along(c), within.variable, further) for c in (first, second))
    )
    meetings: list[Term] = []
    if a is not None:
        b = second if a is first else first
        meetings = [simplify(substitute(b.surface, {within.variable: root})) for root in a.roots or ()]
    if searched:  # by numbers, where the places are isolated: of two spheres a circle may be at one distance from here
        meetings = [settled(meeting, frozenset((nearest,))) for meeting in meetings]
    if a is None or (searched and any(nearest in meeting.free for meeting in meetings)):
        yield Critical((along(first), along(second)), (within,), False, steps)
        return
    for meeting in meetings:
        if meeting.free:
            yield meeting, False, steps


def _radical(root: Term) -> bool:
    """Whether a root is more than a quotient of polynomials."""
    return any(isinstance(node, Branch) or (isinstance(node, Prim) and node.op not in RATIONAL)
               for node in postorder(root))  # fmt: skip


@lru_cache(maxsize=8192)
def _size(term: Term) -> int:
    return len(postorder(term))
