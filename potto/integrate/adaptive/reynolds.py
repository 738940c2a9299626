"""What the pieces of a batch of integrals amount to: values, and the two forms of each derivative with their errors.

Owns `Totals`. The fixed form adds what the moving ends of segments sweep to the interior derivative; the moving form
(Reynolds' transport theorem) has that in its nodes. Both come from the same values, so that each checks the other.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.panels.roundoff import hidden_steps
from potto.integrate.pieces import Ends, Pieces, Sums
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array


class Totals(Struct):
    """Pieces added up per integral, (m, channels, B) each: integrals, errors with their rounding, magnitudes.

    moving, fixed: (value, bound) of the tangents in the two forms, (m, k, B) each; apart: how far they differ, 0 where
    that is not known. Without moving ends there is the moving form alone.
    """

    integral: Array
    error: Array
    size: Array
    moving: tuple[Array, Array]
    fixed: tuple[Array, Array] | None
    apart: Array | None


def totals(work: PanelBatch, p: Pieces, ends: Ends | None) -> Totals:
    k = work.k
    integral, error, size = added(work, np.concatenate((p.integral, p.error + p.floor, p.size)), p, 3)
    error = np.where(np.isnan(integral) | np.isnan(error), np.inf, error)
    moving, steps = (integral[:, 1 : 1 + k], error[:, 1 : 1 + k]), work.steps
    if steps is not None:
        moving = steps.added(moving, True)
    if not work.both:
        return Totals(integral, error, size, moving, None, None)
    value, bound = integral[:, 1 + k :], error[:, 1 + k :]
    if ends is not None:
        swept, rounding = boundary(work, ends)
        value, bound = value + swept, bound + rounding
    if steps is not None:
        value, bound = steps.added((value, bound), ends is not None)
    for lost in (work.misplaced, _hidden(work, ends)):
        if lost is not None:
            rows = lost.reshape(-1, work.seg.a.size)
            each = np.stack([np.bincount(work.seg.owner, row, work.batch) for row in rows])
            bound = bound + each.reshape(bound.shape)
    apart = np.abs(moving[0] - value)
    return Totals(integral, error, size, moving, (value, bound), np.where(np.isfinite(apart), apart, 0.0))


def _hidden(work: PanelBatch, ends: Ends | None) -> Array | None:
    """What the fixed form leaves out where the integrand is taken to be continuous, by segment: (m, k, S)."""
    if ends is not None or work.at_ends is None or not work.seg.blur.any():
        return None
    return hidden_steps(work.at_ends, work.seg, work.steps is None)


def added(work: PanelBatch, x: Array, p: Pieces, count: int) -> Array:
    """Channels of pieces (count * C, P) added up per integral: (count, m, channels, B)."""
    owner, batch = work.seg.owner[p.segment], work.batch
    if batch == 1:
        rows = x.sum(axis=1)
    elif (owner[1:] >= owner[:-1]).all():
        starts = np.flatnonzero(np.diff(owner, prepend=-1))
        rows = np.add.reduceat(x, starts, axis=1)
        if starts.size < batch:
            rows, present = np.zeros((x.shape[0], batch)), rows
            rows[:, owner[starts]] = present
    else:
        place = owner + batch * np.arange(x.shape[0])[:, None]
        rows = np.bincount(place.reshape(-1), x.reshape(-1), minlength=batch * x.shape[0])
    shaped: Array = rows.reshape(count, work.width, -1, batch)
    return shaped


def boundary(work: PanelBatch, ends: Ends) -> tuple[Array, Array]:
    """The fixed form's boundary terms (m, k, B), and their rounding."""
    seg = work.seg
    sizes = work.width, work.k, work.batch
    speeds = np.concatenate((seg.tb, -seg.ta), axis=1)
    terms = np.concatenate((ends.high, ends.low), axis=1)[:, None, :] * speeds
    rounded = np.concatenate((ends.high_error, ends.low_error), axis=1)[:, None, :] * np.abs(speeds)
    if work.at_ends is not None:
        low, high = work.just_inside()
        steep, low_off, high_off = work.at_ends[1], seg.ea + (low - seg.a), seg.eb + (seg.b - high)
        slips = np.concatenate((steep[:, 1] * high_off, steep[:, 0] * low_off), axis=1)
        rounded += np.where(np.isfinite(slips), slips, 0.0)[:, None, :] * np.abs(speeds)
    nothing = (speeds == 0) | np.isinf(np.concatenate((seg.b, seg.a)))
    if nothing.any():
        terms, rounded = np.where(nothing, 0.0, terms), np.where(nothing, 0.0, rounded)
    rows = np.concatenate((terms, 32 * EPS * np.abs(terms) + rounded)).reshape(2 * work.width * work.k, -1)
    place = np.concatenate((seg.owner, seg.owner)) + work.batch * np.arange(rows.shape[0])[:, None]
    sums = np.bincount(place.reshape(-1), rows.reshape(-1), minlength=work.batch * rows.shape[0])
    out, rounding = sums.reshape(2, *sizes)
    finite = np.isfinite(out)
    return np.where(finite, out, 0.0), np.where(finite, rounding, np.inf)


def cut_rounding(work: PanelBatch, ends: Ends) -> tuple[Array, Array]:
    """What cuts misplaced by rounding cost, (m, B): the integrand's jump times the rounding of their places. And what
    cuts cost whose speeds are rounded, (m, k, B)."""
    seg = work.seg
    low, high = ends.low, ends.high
    follows = np.zeros(seg.a.size, dtype=bool)
    follows[1:] = (seg.owner[1:] == seg.owner[:-1]) & (seg.a[1:] == seg.b[:-1])
    last = ~np.append(follows[1:], False)
    before = np.zeros_like(high)
    before[:, 1:] = high[:, :-1]
    jump = np.abs(low - np.where(follows, before, 0.0))
    end = np.where(last, np.abs(high), 0.0)

    def total(at_a: Array, at_b: Array) -> Array:
        with np.errstate(invalid="ignore"):
            cost = jump * at_a + end * at_b
        cost = np.where(np.isfinite(cost), cost, 0.0)
        return np.stack([np.bincount(seg.owner, row, minlength=work.batch) for row in cost])

    speeds = [total(a, b) for a, b in zip(seg.da, seg.db, strict=True)]
    return total(seg.ea, seg.eb), np.stack(speeds, axis=1) if speeds else np.zeros((work.width, 0, work.batch))


def bent_elsewhere(work: PanelBatch, at_ends: Array) -> Array:
    """What is lost as an integrand bends beside the place where rounding puts its cut, (m, B): the square of how far
    off that is, times the slopes on both sides."""
    seg, steep = work.seg, at_ends[1]
    with np.errstate(invalid="ignore", over="ignore"):
        reach = seg.b - seg.a
        low, high = np.minimum(seg.ea, reach) ** 2, np.minimum(seg.eb, reach) ** 2
        cost = steep[:, 0] * low + steep[:, 1] * high
    cost = np.where(np.isfinite(cost), cost, 0.0)
    return np.stack([np.bincount(seg.owner, row, minlength=work.batch) for row in cost])


def added_up(work: PanelBatch, found: Totals) -> Array:
    """What is added up for each of the batch, without regard to sign, here and further in: (2, B)."""
    size = np.where(np.isfinite(found.size), found.size, 0.0).max(axis=0)
    gross: Array = work.cancels * np.stack((size[0], size[1:].max(axis=0, initial=0.0)))
    if work.hidden.any():
        reach = np.bincount(work.seg.owner, work.seg.b - work.seg.a, minlength=work.batch)
        gross += work.hidden * np.where(np.isfinite(reach), reach, 0.0)
    return gross


def sums(work: PanelBatch, found: Totals, ends: Ends | None) -> Sums:
    """The answer: per direction the better of the two forms, or the infinity that it is."""
    v, e = found.integral[:, 0], found.error[:, 0]
    moving, fixed = found.moving, found.fixed
    if fixed is None or found.apart is None:
        t, et = moving
    else:
        # The moving form does not cancel: where they are alike it is the better one.
        better = fixed[1] < 0.5 * moving[1]
        # two independent values that differ by more than they admit: neither estimate is believed
        doubt = np.where(found.apart > 4 * (moving[1] + fixed[1]), found.apart, 0.0)
        t, et = np.where(better, fixed[0], moving[0]), np.where(better, fixed[1], moving[1]) + doubt
    common = None
    if ends is not None:
        places, common = cut_rounding(work, ends)
        e, et = e + places, et + common
    if not work.last and work.at_ends is not None:
        e = e + bent_elsewhere(work, work.at_ends)
    if work.endless is not None:
        t, et = np.where(work.endless == 0, t, work.endless), np.where(work.endless == 0, et, np.inf)
    return Sums(v, e, t, et, gross=added_up(work, found), common=common)
