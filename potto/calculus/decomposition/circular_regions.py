"""Regions that lines and circles bound, intersections, unions and whatever is made of both: their corners.

Owns `circular_region`. Of n lines and circles in a plane n^2/2 pairs cross; what lies outside of what is integrated, or
within a union of others, leaves nothing that is not smooth. Which crossings those are the parameters decide, so numbers
find them (`integrate/decomposition/corners`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.polynomial_in import collect
from potto.calculus.algebra.rational_form import is_zero, shorter
from potto.calculus.decomposition.critical import Within
from potto.calculus.decomposition.side_polynomials import Sides, settling
from potto.calculus.decomposition.surface_cuts import CircularRegion, Cut, side
from potto.core.terms import ONE, ZERO, Term, mul, neg, sub, var

LEAST = 6  # the crossings of fewer are rows of plans that need no search
Polynomial = Callable[[Sides], Term | None]
Edges = tuple[list[Cut], list[Cut]]
Covers = dict[Cut, int]  # what they have as `covers`


def circular_region(
    cuts: Sequence[Cut], within: Within, further: frozenset[str], polynomial: Polynomial | None
) -> tuple[CircularRegion | None, Edges, Covers]:
    """The region that half planes and discs of a variable and the outermost one bound, with the lines and the circles
    among the cuts, and which of them cover others; None and no cuts where there are few, or other variables further
    out. polynomial: gives the integrand in the sides of surfaces. Where that can't be told, those cuts count of which
    one side has to hold."""
    if len(further) != 1 or (within.lo.free | within.hi.free) & further:
        return None, ([], []), {}
    names = (*further, within.variable)
    flat = [cut for cut in cuts if cut.product is None and (cut.holds or not (cut.bends or cut.steps))]
    some = _region(flat, within, names, polynomial) if polynomial is not None else None
    return some or _region([cut for cut in flat if cut.holds], within, names, None) or (None, ([], []), {})


def _region(
    cuts: Sequence[Cut], within: Within, names: Sequence[str], polynomial: Polynomial | None
) -> tuple[CircularRegion, Edges, Covers] | None:
    lines: dict[Cut, tuple[Term, ...]] = {}
    circles: dict[Cut, tuple[Term, ...]] = {}
    for cut in cuts:
        if (form := affine(cut.surface, names)) is not None:
            lines[cut] = (*form.coefficients, form.rest)
        elif (numbers := circle(cut.surface, *names)) is not None:
            circles[cut] = numbers
    edges = (*circles, *lines)
    if len(edges) < LEAST:
        return None
    bounds = (ZERO, ONE, neg(within.lo)), (ZERO, neg(ONE), within.hi)
    y, by_sides, covers = var(within.variable), None, dict[Cut, int]()
    if all(cut.holds for cut in edges):
        lines, circles = ({cut: _turned(cut, of[cut]) for cut in of} for of in (lines, circles))
    else:
        sides = {jump.path: (side(n), jump.orientation) for n, cut in enumerate(edges) for jump in cut.jumps}
        if polynomial is None or (by_sides := polynomial(sides)) is None:
            return None
        settled = settling(by_sides, [side(n) for n in range(len(edges))])
        covers = {cut: settled.get(side(n), 0) for n, cut in enumerate(edges)} if settled else {}
        by_sides = mul(by_sides, *(var(side(len(edges) + n)) for n in range(2)))
    surfaces = (*(cut.surface for cut in edges), sub(y, within.lo), sub(y, within.hi))
    region = CircularRegion((*lines.values(), *bounds), tuple(circles.values()), within.variable, surfaces, by_sides)
    return region, (list(lines), list(circles)), covers


def circle(surface: Term, x: str, y: str) -> tuple[Term, Term, Term, Term] | None:
    """q, a, b and c of a surface q*(x^2 + y^2) + a*x + b*y + c; None if it is none."""
    along = polynomial(surface, y)
    if along is None or len(along) != 3 or {x, y} & (along[0].free | along[1].free):
        return None
    across = polynomial(along[2], x)
    if across is None or len(across) != 3 or {x, y} & frozenset().union(*(part.free for part in across)):
        return None
    (q, b, _), (p, a, c) = along, across
    return (q, a, b, c) if is_zero(sub(p, q)) else None


def polynomial(term: Term, name: str) -> tuple[Term, ...] | None:
    """The coefficients of a polynomial of degree 1 or 2 in a variable, the highest first."""
    found = collect(term, name)
    if found is None or not found.atoms <= {var(name)}:
        return None
    degrees = found.degrees(var(name))
    most = max(degrees, default=Fraction(0))
    if most not in (1, 2) or not set(degrees) <= set(map(Fraction, range(3))):
        return None
    return tuple(shorter(degrees.get(Fraction(n), ZERO)) for n in reversed(range(1 + int(most))))


def _turned(cut: Cut, numbers: tuple[Term, ...]) -> tuple[Term, ...]:
    """The numbers of a surface on the side that has to hold."""
    return numbers if cut.holds > 0 else tuple(map(neg, numbers))
