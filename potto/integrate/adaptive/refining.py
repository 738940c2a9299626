"""Panels refined until the integrals of a batch over one variable are as accurate as was asked for.

Owns `integrated`. Each segment begins as one panel; what is too coarse gets more nodes, then is halved, all such panels
of the batch in one go. For a derivative two forms are computed from the same values:

    fixed:  D int F = int D_theta F  +  sum over ends of segments of F at the end times the end's speed
    moving: D int F = int (D_theta F + v dF/dx + F dv/dx), v a velocity that agrees with the speed at every end

(Reynolds' transport theorem.) Each has its own error estimate; the better one is the answer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from potto.integrate.adaptive.divergence import endless, given_up
from potto.integrate.adaptive.refinement import (
    DOUBTFUL_ROUNDS,
    Tally,
    count_unreached,
    doubtful,
    filled,
    missed_peak,
    stragglers,
    too_coarse,
)
from potto.integrate.adaptive.reynolds import Totals, sums, totals
from potto.integrate.adaptive.seams import at_seams, beyond_nodes
from potto.integrate.adaptive.short_neighbours import unseen
from potto.integrate.adaptive.tails import paced
from potto.integrate.columns import distinct
from potto.integrate.degenerate.degeneracies import seems_to_step, steps_at_cuts
from potto.integrate.events import BUDGET_SPENT
from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Ends, Pieces, Sums, all_of
from potto.integrate.rules.substitution import GRADE
from potto.kernels.cells import Array

MOST_HALVINGS = 64
# Nodes for pieces that were too coarse: first more of them on the same piece, then on halves.
HIGH_ORDER = HALF_ORDER = 14
MORE = 6  # for graded pieces, on which what is smooth is a polynomial, whose end looks like a fast decay
# The relative error of a piece up to which more nodes promise more than halves do.
PROMISING = 1e-2
# From which relative error on a steeply graded piece is also measured as it is, and up to which it is then taken for
# smooth: what grows fast towards an end is taken for a steep power, and a grade for that is harder than the integrand
# itself, however short the piece (`exp(t)` under a normal density). Where a map crowds nodes like squares already, a
# grade brings them so close to the turning place that rounding is all that is left between them.
ROUGH, SMOOTH = 1e-8, 1e-12
ROUNDED = 8.0  # up to how many times its rounding an error beside a turning place is taken for that
TOO_LITTLE = 8  # how many times more than an error, or rounding, tells is missed
COUNTS = 0.01  # the part of what an error may be from which on it counts what was missed beside an end
LONG = 8  # after how many halvings it is looked for members that take longer than the others


def integrated(work: PanelBatch) -> Sums:
    count = work.seg.a.size
    if count == 0:
        return Sums.zeros(1, work.k, work.batch)
    zero, one = np.zeros(count), np.ones(count)
    work.seg = paced(work)
    ends = work.ends = work.end_values()
    whole = Pieces(np.arange(count), zero, one, np.zeros(count, dtype=np.int64))
    work.exact = work.enough()
    fresh = work.measure(whole, work.exact or work.parent.order, True)
    if work.exact and not work.enough():  # surfaces were met that coincide
        work.exact = None
        fresh = work.measure(whole, work.parent.order, True)
    work.looks = False
    if work.last and work.parent.extent is not None:
        size = fresh.size.reshape(work.width, -1, fresh.segment.size)[:, 0].max(axis=0)
        work.parent.extent.saw_values(size / (work.seg.b - work.seg.a), work.below(work.seg.owner))
    if not work.last and (work.conflict or work.paired or seems_to_step(work, fresh)):
        work.steps = steps_at_cuts(work, fresh)
    if work.exact is None:
        fresh = beyond_nodes(work, count_unreached(work, beside_short_ones(work, fresh), ends))
    found = totals(work, fresh, ends)
    if good_enough(work, fresh, found, ends):
        return sums(work, found, ends)
    work.endless = endless(work, found)
    tally = Tally(work, fresh)
    work.filled = filled(work, fresh)
    done = refine(work, fresh, ends, tally)
    if tally.settle_forms(work, done):
        done.excess[:] = 0.0
        done = refine(work, done, ends, tally)
    done = beyond_nodes(work, count_unreached(work, at_seams(work, done), ends))
    for _ in range(DOUBTFUL_ROUNDS):
        found = totals(work, done, ends)
        bad = doubtful(work, done, found)
        if bad is None or work.machine.exhausted():
            break
        halves = halved(done.pick(bad))
        halves = replaced(work, done.pick(bad), halves, HALF_ORDER, tally)
        done = beyond_nodes(work, at_seams(work, done.pick(~bad).join(refine(work, halves, ends, tally))))
    else:
        found = totals(work, done, ends)
    return given_up(work, done, found, sums(work, found, ends))


def beside_short_ones(work: PanelBatch, p: Pieces) -> Pieces:
    """Whole segments, of which those are halved that have missed something next to an end, of which their own errors
    say too little, and graded where a short neighbour sets its scale: what these tell is refined as anything else is.
    Of the others it is part of the error."""
    if not (looked := unseen(work, p)):
        return p
    (at_left, short_left), (at_right, short_right) = looked
    owner, size = work.seg.owner[p.segment], by_either_form(work, p.size)
    total = np.stack([np.bincount(owner, row, minlength=work.batch)[owner] for row in size])
    known = TOO_LITTLE * np.maximum(p.error, p.floor)
    least = np.maximum(known, COUNTS * np.maximum(work.machine.atol, work.machine.rtol * total))
    left, right = ((missed > least).any(axis=0) for missed in (at_left, at_right))
    p.error = p.error + np.where(left | right, 0.0, at_left + at_right)
    if not (there := left | right).any():
        return p
    halves = halved(p.pick(there))
    graded = (left & short_left)[there], (right & short_right)[there]
    halves.end = np.concatenate((np.where(graded[0], -GRADE, 0), np.where(graded[1], GRADE, 0)))
    return p.pick(~there).join(measured(work, halves, HALF_ORDER))


def good_enough(work: PanelBatch, p: Pieces, found: Totals, ends: Ends | None) -> bool:
    """Whether whole segments do as they are for every member, by the strictest reading of what is asked for."""
    if work.number and work.root is not None:
        return False  # what each may err is measured by members of the outermost batch: that takes a tally
    scale = np.abs(found.size if work.number else found.integral)[:, : 1 + work.k]
    if work.number:
        scale = scale.max(axis=-1, keepdims=True)
    error = found.error[:, : 1 + work.k]
    if found.fixed is not None:
        error = np.concatenate((error[:, :1], np.minimum(found.moving[1], found.fixed[1])), axis=1)
    if not (error <= 0.5 * np.maximum(work.machine.atol, work.machine.rtol * scale)).all():
        return False
    if ends is not None and missed_peak(work, p, ends).any():
        return False
    return doubtful(work, p, found) is None


def refine(work: PanelBatch, fresh: Pieces, ends: Any, tally: Tally) -> Pieces:
    """More nodes, then halves, for what is too coarse until nothing is; what is accepted stays accepted."""
    accepted: list[Pieces] = []
    for turn in range(MOST_HALVINGS):
        found = too_coarse(work, fresh, ends, tally)
        if found is None:
            break
        if work.machine.exhausted():
            owners = work.seg.owner[fresh.segment[found[0] | found[1]]]
            work.machine.note(BUDGET_SPENT, work.below(distinct(owners)))
            if ends is not None:  # what is known to be missing
                fresh.error[:, missed_peak(work, fresh, ends)] = np.inf
            break
        bad, waiting = found
        if turn >= LONG and (late := stragglers(work, fresh, bad)).any():
            bad, waiting = bad & ~late, waiting & ~late
            if not bad.any():
                break
        accepted.append(fresh.pick(~bad & ~waiting))
        coarse, later = fresh.pick(bad), fresh.pick(waiting)
        later.excess[:] = 0.0
        nearly = (coarse.error <= PROMISING * coarse.size).all(axis=0) if turn == 0 else np.zeros(0, dtype=bool)
        if nearly.any():
            near, far = coarse.pick(nearly), coarse.pick(~nearly)
            fresh = replaced(work, near, near.places(slice(None)), HIGH_ORDER, tally)
            if far.segment.size:
                fresh = fresh.join(replaced(work, far, halved(far), HALF_ORDER, tally))
        else:
            fresh = replaced(work, coarse, halved(coarse), HALF_ORDER, tally)
        if later.segment.size:
            fresh = fresh.join(later)
    accepted.append(fresh)
    return all_of(accepted)


def replaced(work: PanelBatch, old: Pieces, new: Pieces, order: int, tally: Tally) -> Pieces:
    """The new pieces that stand for the old ones, measured; the books follow."""
    copies = new.u0.size // old.u0.size
    new = measured(work, new, order)
    new.excess, new.stuck = np.tile(old.excess, copies), np.tile(old.stuck, copies)
    tally.replace(work, old, new)
    return new


def measured(work: PanelBatch, new: Pieces, order: int) -> Pieces:
    """Pieces of segments, measured; those that are graded once more, with more nodes, or as they are: which they stay
    where they are smooth so, or nodes that crowd lie where rounding leaves less than more nodes would miss."""
    new = work.measure(new, order)
    either = by_either_form(work, new.error, np.minimum)  # the better form is the one that is believed
    promising = (either <= PROMISING * by_either_form(work, new.size)).all(axis=0)
    if (graded := np.nonzero((new.end != 0) & promising)[0]).size:
        new.held_against(work.measure(new.places(graded), order + MORE), graded)
    turning = work.seg.turning[new.segment]
    steep = np.abs(new.end) * np.where(turning, 2, 1) > GRADE
    if (rough := np.nonzero(steep & ~(new.error + turning * new.floor <= ROUGH * new.size).all(axis=0))[0]).size:
        level = new.places(rough)
        level.end = np.zeros(rough.size, dtype=np.int64)
        level = work.measure(level, order).settled()
        least = np.maximum(SMOOTH * by_either_form(work, level.size), turning[rough] * ROUNDED * level.floor)
        smooth = (level.error <= least).all(axis=0)
        before, off = new.pick(rough), level.error + level.floor
        known = ~(before.floor <= off).all(axis=0) & ~(before.error + before.floor < off).any(axis=0)
        new.settled().put(rough[smooth | known], level.pick(smooth | known))
    return new


def by_either_form(work: PanelBatch, size: Array, which: Callable[[Array, Array], Array] = np.maximum) -> Array:
    """What errors of pieces are measured by, (C, P): of a derivative the larger of its two forms. What moves with its
    ends leaves nothing of the one but rounding, of which no digit is right."""
    if not work.both:
        return size
    rows = size.reshape(work.width, -1, size.shape[-1])
    larger = which(rows[:, 1 : 1 + work.k], rows[:, 1 + work.k :])
    return np.concatenate((rows[:, :1], larger, larger), axis=1).reshape(size.shape)


def halved(p: Pieces) -> Pieces:
    """Two pieces for each; the one at the end of its segment is graded towards that end."""
    middle = 0.5 * (p.u0 + p.u1)
    left = np.where((p.u0 == 0) & (p.end <= 0) & (p.lean < 0), p.lean, np.minimum(p.end, 0))
    right = np.where((p.u1 == 1) & (p.end >= 0) & (p.lean > 0), p.lean, np.maximum(p.end, 0))
    return Pieces(
        np.concatenate((p.segment, p.segment)),
        np.concatenate((p.u0, middle)),
        np.concatenate((middle, p.u1)),
        np.concatenate((left, right)),
    )
