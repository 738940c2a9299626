"""Half planes, discs and their complements outside of which nothing is integrated: the corners of what they leave.

Owns `circular_region`. Of n lines and circles in a plane n^2/2 pairs cross; what lies outside of one of the others
leaves nothing that is not smooth. Which crossings those are the parameters decide, so numbers find them
(`integrate/decomposition/corners`).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from potto.calculus.algebra.affine import affine
from potto.calculus.algebra.polynomial_in import collect
from potto.calculus.algebra.rational_form import is_zero, shorter
from potto.calculus.decomposition.critical import Within
from potto.calculus.decomposition.surface_cuts import CircularRegion, Cut
from potto.core.terms import ONE, ZERO, Term, neg, sub, var

LEAST = 6  # lines: the crossings of fewer are rows of plans that need no search
# The same where there are circles: formulas of their crossings have more digits where circles touch, or are small and
# far away, and take as long as all else from here on (24: 7.5 s at the first call, 0.2 without; 10: 1.0 and 0.15).
MANY = 12
Edges = tuple[list[Cut], list[Cut]]


def circular_region(
    cuts: Sequence[Cut], within: Within, further: frozenset[str]
) -> tuple[CircularRegion | None, Edges]:
    """The region that those cuts of a variable leave which have to be half planes or discs of it and the outermost one,
    or their complements, with the lines and the circles among them; None and no cuts where there are few, or other
    variables further out."""
    if len(further) != 1 or (within.lo.free | within.hi.free) & further:
        return None, ([], [])
    names = (*further, within.variable)
    lines: dict[Cut, tuple[Term, ...]] = {}
    circles: dict[Cut, tuple[Term, ...]] = {}
    for cut in cuts:
        if cut.holds and cut.product is None:
            if (form := affine(cut.surface, names)) is not None:
                lines[cut] = _turned(cut, (*form.coefficients, form.rest))
            elif (numbers := circle(cut.surface, *names)) is not None:
                circles[cut] = _turned(cut, numbers)
    if len(lines) + len(circles) < MANY:
        circles.clear()
    if len(lines) + len(circles) < LEAST:
        return None, ([], [])
    bounds = (ZERO, ONE, neg(within.lo)), (ZERO, neg(ONE), within.hi)
    y = var(within.variable)
    surfaces = (*(cut.surface for cut in (*circles, *lines)), sub(y, within.lo), sub(y, within.hi))
    region = CircularRegion((*lines.values(), *bounds), tuple(circles.values()), within.variable, surfaces)
    return region, (list(lines), list(circles))


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
