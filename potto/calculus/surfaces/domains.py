"""Where a term stops being defined.

Owns `ends_of_domain`.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from potto.calculus.algebra.ranges import nonnegative
from potto.calculus.surfaces.nested_brackets import BINDERS, pieces
from potto.core.terms import Prim, Term, outside
from potto.primitives import PRIMITIVES


@lru_cache(maxsize=4096)  # where another shader stands between the surfaces, they are what they were
def ends_of_domain(surface: Term) -> tuple[Term, ...]:
    """Where a condition stops being defined, if it does, each place once: on what lies beyond it has no side.

    An edge that is a period's is a pole, on both sides of which there is a value.
    """
    return tuple(dict.fromkeys(_ends_of_domain(surface)))


def _ends_of_domain(surface: Term) -> Iterator[Term]:
    for node in outside(surface, BINDERS):
        if isinstance(node, Prim) and node.free and node.op != "div":
            entry = PRIMITIVES[node.op]
            for end in () if entry.period else entry.edges(*node.args):
                if not nonnegative(end):
                    yield from (piece for piece in pieces(end) if piece.free)
