"""Where a term stops being defined.

Owns `ends_of_domain`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

from potto.calculus.algebra.ranges import nonnegative
from potto.calculus.surfaces.nested_brackets import BINDERS, pieces
from potto.core.terms import Prim, Term, Told, children
from potto.primitives import PRIMITIVES

Ends = tuple[Term, ...]


def _told(node: Term, below: list[Ends]) -> Ends:
    found = [ends for ends in below if ends]
    own = tuple(_own_ends(node)) if isinstance(node, Prim) and node.free and node.op != "div" else ()
    if not own and len(found) < 2:  # nearly all terms
        return found[0] if found else ()
    return tuple(dict.fromkeys((*own, *chain.from_iterable(found))))


def _own_ends(node: Prim) -> Iterator[Term]:
    """An edge that is a period's is none, but a pole, on both sides of which there is a value."""
    entry = PRIMITIVES[node.op]
    for end in () if entry.period else entry.edges(*node.args):
        if not nonnegative(end):
            yield from (piece for piece in pieces(end) if piece.free)


def _values(node: Term) -> Sequence[Term]:
    return () if isinstance(node, BINDERS) else children(node)


# Where a condition stops being defined, if it does, each place once: on what lies beyond it has no side.
ends_of_domain = Told(_told, _values)
