"""What a memo hangs on in the end, so that what lies between need not be walked through."""

from __future__ import annotations

from collections.abc import Container
from itertools import chain
from typing import Final

from potto.query.nodes import Leaf, Memo, Node

LEAVES: Final = 512  # of a memo that are kept: to find out about more takes as long as to walk


def leaves_of(deps: tuple[Node, ...]) -> tuple[Leaf, ...] | None:
    """The undurable leaves below some nodes; None if there are more than `LEAVES`, or not all are known."""
    widest: tuple[Leaf, ...] = ()
    others: list[tuple[Leaf, ...]] = []
    own: list[Leaf] = []
    for dep in deps:
        if dep.durability:
            continue
        if not isinstance(dep, Memo) or dep.cuts:
            own.append(dep)
        elif dep.leaves is None:
            return None
        elif dep.leaves is not widest:
            others.append(dep.leaves)
            if len(dep.leaves) > len(widest):
                widest = dep.leaves
    if len(others) <= 1 and all(dep in widest or _is_covered(dep, widest) for dep in own):
        return widest
    union = set(own)
    for leaves in others:
        union.update(leaves)
        if len(union) > LEAVES:
            return None
    if len(union) == len(widest):
        return widest  # most chains are straight: they share one
    own = [dep for dep in own if not _is_covered(dep, union)]
    return tuple(dict.fromkeys(chain(*others, own)))  # in the order of reading: in a set's they are verified at random


def _is_covered(leaf: Leaf, others: Container[Leaf]) -> bool:
    """Whether a memo that cuts edits off hangs on one of the others alone, which says all that it could say: if that
    has not changed it has not either, and if that has there is no more to ask."""
    if not isinstance(leaf, Memo) or leaf.leaves is None or len(leaf.leaves) != 1 or leaf.durability:
        return False
    return leaf.leaves[0] in others
