"""What a memo ultimately depends on, so that verification can skip everything in between."""

from __future__ import annotations

from collections.abc import Container
from itertools import chain
from typing import Final

from potto.query.memos import Leaf, Memo, Node

LEAVES: Final = 512  # leaves kept for a memo: checking more of them would take as long as walking


def leaves_of(deps: tuple[Node, ...]) -> tuple[Leaf, ...] | None:
    """The leaves of durability 0 below some nodes; None if there are more than `LEAVES`, or if some are not known."""
    widest: tuple[Leaf, ...] = ()
    others: list[tuple[Leaf, ...]] = []
    own: list[Leaf] = []
    for dep in deps:
        if dep.durability:
            continue
        if not isinstance(dep, Memo) or dep.cuts:
            own.append(dep)
            continue
        leaves = dep.leaves
        if leaves is None:
            return None
        if leaves is not widest:
            others.append(leaves)
            if len(leaves) > len(widest):
                widest = leaves
    if len(others) <= 1:
        for leaf in own:
            if leaf not in widest and not _is_covered(leaf, widest):
                break
        else:
            return widest
        if len(own) == 1 and not others:
            return tuple(own)
    union = set(own)
    for leaves in others:
        union.update(leaves)
        if len(union) > LEAVES:
            return None
    if len(union) == len(widest):
        return widest  # most chains are straight, so all of it is shared
    own = [dep for dep in own if not _is_covered(dep, union)]
    return tuple(dict.fromkeys(chain(*others, own)))  # in the order of reading, which a set would lose


def _is_covered(leaf: Leaf, others: Container[Leaf]) -> bool:
    """Whether a memo depends on a single leaf that is among `others` anyway. Then the memo adds nothing: as long as
    that leaf has not changed, neither has the memo."""
    if not isinstance(leaf, Memo) or leaf.leaves is None or len(leaf.leaves) != 1 or leaf.durability:
        return False
    return leaf.leaves[0] in others
