"""Jumps between the last node of a piece and its end, where the places of jumps are not all known.

Owns `at_seams`. A piece all of whose nodes lie on one side of a jump is smooth to them. But the jump then lies
between its outermost node and its end, and what its nodes lead to at that end is not what the next piece begins with:
the difference is the jump, and it was missed over no more than what lies beyond the node.
"""

from __future__ import annotations

import numpy as np

from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Pieces
from potto.integrate.rules import substitution
from potto.integrate.rules.gauss import gauss


def at_seams(work: PanelBatch, p: Pieces) -> Pieces:
    """Pieces whose errors count what they may have missed beside their neighbours in the same segment; the pieces as
    they are where cuts are known to be complete."""
    if not work.blind or p.segment.size < 2:
        return p
    p.settled()
    order = np.lexsort((p.u0, p.segment))
    left, right = order[:-1], order[1:]
    inside = (p.segment[left] == p.segment[right]) & (p.u1[left] == p.u0[right])
    left, right = left[inside], right[inside]
    _, _, stretch = substitution.grade(p.u0, p.u1, p.end, np.array([0.0, 1.0]))
    low, high = p.led[: p.error.shape[0]], p.led[p.error.shape[0] :]
    beyond = gauss(work.parent.order).nodes[0]  # of a piece: no rule has its first node farther from the end
    ends, begins = stretch[left, -1], stretch[right, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        jump = np.abs(high[:, left] / ends - low[:, right] / begins)
    jump = np.where(np.isfinite(jump), jump, 0.0)
    missed = np.zeros_like(p.error)
    missed[:, left] += beyond * ends * jump
    missed[:, right] += beyond * begins * jump
    p.error = p.error + missed
    return p
