"""Regions that lines and conics bound, intersections, unions and whatever is made of both: their corners.

Owns `conic_region`, and `covering`. Of n lines and conics in a plane n^2/2 pairs cross; what lies outside of what is
integrated, or within a union of others, leaves nothing that is not smooth. Which crossings those are the parameters
decide, so numbers find them (`integrate/decomposition/corners`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.polynomial_in import in_powers
from potto.calculus.algebra.rational_form import is_zero, shorter
from potto.calculus.decomposition.critical import Within
from potto.calculus.decomposition.side_polynomials import Sides, settling
from potto.calculus.decomposition.surface_cuts import ConicRegion, Cut, side
from potto.core.terms import ONE, ZERO, Term, mul, neg, sub, var

LEAST = 6  # the crossings of fewer lines and circles are rows of plans that need no search
Polynomial = Callable[[Sides], Term | None]
Edges = tuple[list[Cut], list[Cut]]
Covers = dict[Cut, int]  # what they have as `covers`


def conic_region(
    cuts: Sequence[Cut], within: Within, further: frozenset[str], polynomial: Polynomial | None
) -> tuple[ConicRegion | None, Edges, Covers]:
    """The region that lines and conics bound in a variable and the outermost one, with the lines and the conics
    among the cuts, and which of them cover others; None and no cuts where there are few, or other variables further
    out. polynomial: gives the integrand in the sides of surfaces. Where that can't be told, those cuts count of which
    one side has to hold."""
    if len(further) != 1 or (within.lo.free | within.hi.free) & further:
        return None, ([], []), {}
    names = (*further, within.variable)
    flat = [cut for cut in cuts if cut.product is None and (cut.holds or not (cut.bends or cut.steps))]
    some = _region(flat, within, names, polynomial) if polynomial is not None else None
    return some or _region([cut for cut in flat if cut.holds], within, names, None) or (None, ([], []), {})


def covering(cuts: Sequence[Cut], polynomial: Polynomial) -> Covers:
    """Which surfaces leave nothing to the others on one of their sides, whatever they are; nothing where none does."""
    flat = [cut for cut in cuts if cut.product is None and (cut.holds or not (cut.bends or cut.steps))]
    if len(flat) < 2 or (by_sides := polynomial(_sides(flat))) is None:
        return {}
    settled = settling(by_sides, [side(n) for n in range(len(flat))])
    return {cut: settled.get(side(n), 0) for n, cut in enumerate(flat)} if settled else {}


def _sides(cuts: Sequence[Cut]) -> Sides:
    return {jump.path: (side(n), jump.orientation) for n, cut in enumerate(cuts) for jump in cut.jumps}


def _region(
    cuts: Sequence[Cut], within: Within, names: Sequence[str], polynomial: Polynomial | None
) -> tuple[ConicRegion, Edges, Covers] | None:
    lines: dict[Cut, tuple[Term, ...]] = {}
    conics: dict[Cut, tuple[Term, ...]] = {}
    for cut in cuts:
        if (form := affine(cut.surface, names)) is not None:
            lines[cut] = (*form.coefficients, form.rest)
        elif (numbers := conic(cut.surface, *names)) is not None:
            conics[cut] = numbers
    edges = (*conics, *lines)
    if len(edges) < LEAST and _crossing_on_lines(list(conics.values())):
        return None
    bounds = (ZERO, ONE, neg(within.lo)), (ZERO, neg(ONE), within.hi)
    y, by_sides, covers = var(within.variable), None, dict[Cut, int]()
    each: tuple[int, ...] = ()
    if all(cut.holds for cut in edges):
        lines, conics = ({cut: _turned(cut, of[cut]) for cut in of} for of in (lines, conics))
    else:
        if polynomial is None or (by_sides := polynomial(_sides(edges))) is None:
            return None
        settled = settling(by_sides, [side(n) for n in range(len(edges))])
        covers = {cut: settled.get(side(n), 0) for n, cut in enumerate(edges)} if settled else {}
        by_sides = mul(by_sides, *(var(side(len(edges) + n)) for n in range(2)))
        each = (*(settled.get(side(n), 0) for n in range(len(edges))), -1, -1)
    surfaces = (*(cut.surface for cut in edges), sub(y, within.lo), sub(y, within.hi))
    region = ConicRegion((*lines.values(), *bounds), tuple(conics.values()), within, surfaces, by_sides, each)
    return region, (list(lines), list(conics)), covers


def conic(surface: Term, x: str, y: str) -> tuple[Term, ...] | None:
    """The numbers of x*x, x*y, y*y, x, y and 1 of a surface that is a polynomial of degree 2; None if it is none."""
    parts = [None if part is None else _coefficients(part, x) for part in _coefficients(surface, y) or (None,)]
    match parts:
        case [(none, nothing, c), (zero, b, e), (a, d, f)] if none is nothing is zero is ZERO:
            return a, b, c, d, e, f
        case _:
            return None


def _crossing_on_lines(conics: Sequence[tuple[Term, ...]]) -> bool:
    """Whether any two conics cross on a line for all parameters, as circles do: their squares are those of one."""
    pairs = ((conic[i], conic[j], first[i], first[j])
             for first in conics[:1] for conic in conics[1:] for i, j in ((0, 1), (0, 2), (1, 2)))  # fmt: skip
    return all(is_zero(sub(mul(a, d), mul(b, c))) for a, b, c, d in pairs)


def polynomial(term: Term, name: str) -> tuple[Term, ...] | None:
    """The coefficients of a polynomial of degree 1 or 2 in a variable, the highest first."""
    found = _coefficients(term, name)
    while found and found[0] is ZERO:
        found = found[1:]
    return found if found and len(found) > 1 else None


def _coefficients(term: Term, name: str) -> tuple[Term, ...] | None:
    """The coefficients of a polynomial of degree 2 at the most in a variable, of the square first."""
    found = in_powers(term, name, 2)
    return None if found is None else tuple(map(shorter, found))


def _turned(cut: Cut, numbers: tuple[Term, ...]) -> tuple[Term, ...]:
    """The numbers of a surface on the side that has to hold."""
    return numbers if cut.holds > 0 else tuple(map(neg, numbers))
