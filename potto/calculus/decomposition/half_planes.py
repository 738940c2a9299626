"""Half planes outside of which nothing is integrated: the corners of their intersection instead of all crossings.

Owns `half_planes`. Of n lines in a plane n^2/2 pairs cross, but a convex polygon has n corners at the
most: crossings outside of it leave nothing that is not smooth. Which ones those are the parameters decide, so numbers
find them (`integrate/decomposition/corners`).
"""

from __future__ import annotations

from collections.abc import Sequence

from potto.calculus.algebra.affine import affine
from potto.calculus.decomposition.critical import Within
from potto.calculus.decomposition.surface_cuts import Cut, HalfPlanes
from potto.core.terms import ONE, ZERO, Term, neg

LEAST = 6  # half planes: the crossings of fewer are rows of plans that need no search


def half_planes(cuts: Sequence[Cut], within: Within, further: frozenset[str]) -> tuple[HalfPlanes | None, list[Cut]]:
    """The cuts of a variable that have to be half planes of it and the outermost one, and the region that they leave;
    None and no cuts where there are few, or other variables further out."""
    if len(further) != 1 or (within.lo.free | within.hi.free) & further:
        return None, []
    names = (*further, within.variable)
    found = [(cut, affine(cut.surface, names)) for cut in cuts if cut.holds and cut.product is None]
    if sum(form is not None for _, form in found) < LEAST:
        return None, []
    planes: dict[Cut, tuple[Term, Term, Term]] = {}
    for cut, form in found:
        if form is not None:
            a, b, c = (t if cut.holds > 0 else neg(t) for t in (*form.coefficients, form.rest))
            planes[cut] = a, b, c
    bounds = (ZERO, ONE, neg(within.lo)), (ZERO, neg(ONE), within.hi)
    return HalfPlanes((*planes.values(), *bounds)), list(planes)
