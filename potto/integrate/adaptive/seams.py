"""What lies between the last node of a piece and its end.

Owns `at_seams` and `beyond_nodes`. A piece all of whose nodes lie on one side of a jump is smooth to them. But the jump
then lies between its outermost node and its end, and what its nodes lead to at that end is not what the next piece
begins with: the difference is the jump, and it was missed over no more than what lies beyond the node. So it is with
what rises there, as the tail of something narrow does that the next piece holds.
"""

from __future__ import annotations

import numpy as np

from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Pieces
from potto.integrate.rules import substitution
from potto.integrate.rules.gauss import gauss

# How many times the last terms of what nodes lead to two pieces differ by at their end, if nothing is there; over how
# many times what lies beyond the last node what is there goes on: the last ones may see 0 of what oscillates.
PLAIN, REACH = 2.0, 4.0


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


def beyond_nodes(work: PanelBatch, p: Pieces) -> Pieces:
    """Pieces whose errors are no less than what they missed beside neighbours with which the integrand goes on
    smoothly. Of nodes that move with cuts only those in one segment do so."""
    if p.segment.size < 2:
        return p
    seg, order = work.seg, np.lexsort((p.u0, p.segment))
    plain = (seg.kind[p.segment] == substitution.LINEAR) & (p.end == 0)
    left, right = order[:-1], order[1:]
    one, other = p.segment[left], p.segment[right]
    within = (one == other) & (p.u1[left] == p.u0[right])
    across = (other == one + 1) & (p.u1[left] == 1) & (p.u0[right] == 0) & (seg.owner[one] == seg.owner[other])
    across &= (seg.b[one] == seg.a[other]) & (seg.rank[other] == 0)
    smooth = (within | across) & plain[left] & plain[right]
    left, right, within = left[smooth], right[smooth], within[smooth]
    if not left.size:
        return p
    length = (seg.b - seg.a)[p.segment] * (p.u1 - p.u0)
    low, high = (part / length for part in np.split(p.led, 2))
    rest = p.rest / length
    with np.errstate(invalid="ignore"):
        step = np.abs(high[:, left] - low[:, right])
        step = np.where(step > PLAIN * (rest[:, left] + rest[:, right]), step, 0.0).reshape(work.width, -1, left.size)
    if work.moving:
        step[:, 1 : 1 + work.k] *= within
    step = REACH * gauss(work.parent.order).nodes[0] * step.reshape(-1, left.size)
    missed = np.zeros_like(p.error)
    for those in (left, right):
        missed[:, those] = np.maximum(missed[:, those], step * length[those])
    p.error = np.maximum(p.error, missed)
    return p
