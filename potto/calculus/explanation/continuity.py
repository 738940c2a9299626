"""Whether a surface is one on which nothing jumps: where the two sides meet, its delta adds nothing.

Owns `continuous`.
"""

from __future__ import annotations

from collections.abc import Iterable

from potto.calculus.algebra.rational_form import is_zero
from potto.calculus.differentiation.boundary_terms import JumpTerm
from potto.calculus.solving.solve import Sections, sections
from potto.calculus.surfaces.branch_assignment import unguarded
from potto.core.terms import Term, Tuple, substitute


def continuous(item: JumpTerm, names: Iterable[str]) -> bool:
    """Whether the jump is 0 all over its surface, by the roots in one of the variables `names`.

    False also where that is not known.
    """
    if item.sums:
        return False
    for name in names:
        if name not in item.surface.free or name not in item.jump.free:
            continue
        found = sections(item.surface, name)
        if isinstance(found, Sections) and found.complete and found.roots and not found.families:
            return all(_vanishes(substitute(item.jump, {name: unguarded(root)})) for root in found.roots)
    return False


def _vanishes(term: Term) -> bool:
    return all(map(_vanishes, term.items)) if isinstance(term, Tuple) else is_zero(term)
