"""Surfaces that coincide and move apart: what lies between them on either side of the present parameters.

Owns `count_meetings`. Cuts at one place are integrated as one that moves with the first. What the others add follows
from the integrand on the stretch that opens between them: as the parameters grow, the slower is crossed first; as they
shrink, the faster. Where the two come to the same (the jumps are added up), that is the derivative; where they do not
(they are multiplied), there is none, and both sides are told.

    forward:  F0 v_slow - F2 v_fast + F(slow crossed) (v_fast - v_slow)
    backward: F0 v_fast - F2 v_slow + F(fast crossed) (v_slow - v_fast)

with F0 and F2 the integrand on the two sides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from potto.core.printer import format_term
from potto.integrate.cuts import Cuts, Meeting
from potto.integrate.edges import around, group_of, tell
from potto.integrate.pieces import Evaluator, Sided, Sums
from potto.integrate.plan import LevelPlan
from potto.kernels.cells import Array, Mask, Value

if TYPE_CHECKING:
    from potto.integrate.levels import Iteration


def count_meetings(
    parent: Iteration, number: int, level: LevelPlan, cuts: Cuts, env: dict[str, Value], sides: dict[int, Mask],
    sums: Sums, machine: Evaluator,
) -> None:  # fmt: skip
    """Add to the tangents what coinciding cuts contribute by their different speeds."""
    for meeting in cuts.meetings:
        if number and 2 * meeting.owner.size < cuts.sign.size:
            continue  # single nodes of the variables further out: of measure zero
        first, second = (level.level.cuts[n].surface for n in (meeting.first, meeting.second))
        if meeting.crowded:
            sums.et[:, :, meeting.owner] = np.inf
            machine.note_unfinished(f"more than two surfaces meet, {format_term(first)} = 0 among them, and move apart")
            continue
        forward, backward, scale = apart(parent, number, level, meeting, env, sides, machine)
        base = sums.t[:, :, meeting.owner]
        sums.t[:, :, meeting.owner] = base + forward
        differ = np.abs(forward - backward) > 1e-12 * (np.abs(base) + scale)
        if differ.any():
            told = tell(number, Sided(level.variable, first, second), base + backward, base + forward, machine)
            sums.t[:, :, meeting.owner] = base + forward if told is None else told


def apart(
    parent: Iteration, number: int, level: LevelPlan, meeting: Meeting, env: dict[str, Value],
    sides: dict[int, Mask], machine: Evaluator,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """What the forward and the backward derivative have beyond that of one cut; their size."""
    one, two = group_of(level, meeting.first), group_of(level, meeting.second)
    here, inner = around(level, meeting.owner, meeting.x, False, env, sides, machine)
    flipped: dict[int, Mask] = {g: ~np.asarray(inner[g]) for g in (one, two)}
    frozen, count = machine.with_directions(0), meeting.owner.size
    ways: tuple[dict[int, Mask], ...] = ({}, {one: flipped[one]}, {two: flipped[two]}, flipped)
    left, first, second, right = (
        parent.inside(number, here, count, {**inner, **way}, frozen)[0][:, None] for way in ways
    )
    v, w = meeting.first_t, meeting.second_t
    slow, fast = np.minimum(v, w), np.maximum(v, w)
    ahead, behind = np.where(v <= w, first, second), np.where(v <= w, second, first)
    merged = (left - right) * meeting.merged_t
    forward = left * slow - right * fast + ahead * (fast - slow) - merged
    backward = left * fast - right * slow + behind * (slow - fast) - merged
    scale = (np.abs(left) + np.abs(right) + np.abs(first) + np.abs(second)) * (np.abs(v) + np.abs(w))
    return forward, backward, scale
