"""Whether a surface is one on which nothing jumps: where the two sides meet, its delta adds nothing.

Owns `continuous`.
"""

from __future__ import annotations

from collections.abc import Iterable

from potto.calculus.differentiation.boundary_terms import JumpTerm, identically_zero
from potto.calculus.solving.solve import Sections, sections
from potto.core.terms import substitute


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
            return all(identically_zero(substitute(item.jump, {name: root})) for root in found.roots)
    return False
