"""How far off pieces may be, which are not accurate enough, and which are as accurate as they can be.

Owns `Tally`, `filled`, `too_coarse`, `stragglers`, `missed_peak`, `count_unreached` and `doubtful`. A piece is refined
until its error is a small enough part of what it is added to, or until what is left of it is rounding. Where an
integrand takes up little of its range, nodes that hardly count need less accuracy. Estimates see only what the nodes
see, so the ends of segments and the agreement of two forms of each derivative are looked at besides.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec.structs import replace

from potto.integrate.adaptive.reynolds import Totals, added
from potto.integrate.columns import distinct
from potto.integrate.events import LATE
from potto.integrate.panels.iterated import siblings
from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Ends, Pieces
from potto.integrate.rules import substitution
from potto.integrate.rules.gauss import EPS, PEAK
from potto.kernels.cells import Array, Bools, Ints

# By how much rounding at an end may be more than what is kept track of, which leaves out what elementary functions err:
# of 2,000 option prices, whose kinks are on the wrong side by so much, 1 in 100 was refined towards its kink for 40 ms.
ROUNDED = 4.0
# How many times its last terms an interpolant may be off at an end of a segment.
MISLED = 200.0
# An error that is still above this share of itself on a half of its piece is not one of truncation. It is taken for
# rounding at once where it is below so much of what is added up, after three times where it is below so much of the
# answer, which may be far smaller.
STUCK = 0.35
NOISE = (1e-12, 1e-9)
# Members that take longer than the others are left to be done by themselves if they are one in so many.
STRAGGLERS = 16
NARROWEST = 1e-14  # the part of its segment that a piece is to be halved at: no more of it than some doubles
LEAST = 1e-6  # the relative accuracy that is asked of every node
# How often all of a segment is halved whose two derivatives do not agree. What is as small as the last halves are has
# been looked at that closely, as beside an end with a value of its own: 46 pieces there became 12,000.
DOUBTFUL_ROUNDS = 8


class Tally:
    """Running totals per integral, by which tolerances are measured: (m * (1 + k), B), and how many pieces there are.

    gross: what the pieces amount to without regard to sign, which is what rounding is measured by: (B,).

    For the outermost variable the magnitude of the result counts; further in, where results are added up once more,
    the largest magnitude of what is added up, among all that go into the same answer.

    fixed: which derivatives are told by their fixed form, (m, k, B); None as long as either may.
    """

    def __init__(self, work: PanelBatch, p: Pieces) -> None:
        self.count: Ints = np.zeros(work.batch, dtype=np.int64)
        self.gross: Array = np.zeros(work.batch)
        self.total: Array = np.zeros((work.width * (1 + work.k), work.batch))
        self.scale: Array | None = None
        self.fixed: Bools | None = None
        self.add(work, p, 1)

    def add(self, work: PanelBatch, p: Pieces, sign: int) -> None:
        """Count pieces, or (-1) take them out again. What is not a number is not counted: no sum would be rid of it,
        when smaller pieces with values have taken its place."""
        owner = work.seg.owner[p.segment]
        x, size = (np.where(np.isfinite(a), a, 0.0) for a in (p.size if work.number else p.integral, p.size))
        self.count += sign * np.bincount(owner, minlength=work.batch)
        self.gross += np.bincount(owner, sign * size.max(axis=0), minlength=work.batch)
        rows = x.reshape(work.width, -1, owner.size)[:, : 1 + work.k].reshape(-1, owner.size)
        for total, row in zip(self.total, rows, strict=True):
            total += np.bincount(owner, sign * row, minlength=work.batch)
        self.scale = None

    def replace(self, work: PanelBatch, old: Pieces, new: Pieces) -> None:
        self.add(work, old, -1)
        self.add(work, new, 1)

    def sizes(self, work: PanelBatch, spared: Array | None) -> Array:
        """The size of the answer that each of these integrals goes into, as it counts there: (m * (1 + k), B)."""
        own = np.abs(self.total)
        if not work.number:
            return own
        counts = own if spared is None else own / spared
        return np.stack([siblings(row, work.root) for row in counts])

    def whole(self, work: PanelBatch) -> Array:
        """The same, or its own size where it is larger, of tangents together with their values: (m * (1 + k), B)."""
        largest = np.maximum(self.sizes(work, spared(work)), np.abs(self.total))
        rows = largest.reshape(work.width, 1 + work.k, -1)
        rows[:, 1:] = rows.max(axis=1, keepdims=True)
        return rows.reshape(largest.shape)

    def limits(self, work: PanelBatch) -> Array:
        """The error that each of these integrals may have: (m * (1 + k), B)."""
        less = spared(work)
        if self.scale is None:
            self.scale = np.maximum(work.machine.atol, work.machine.rtol * self.sizes(work, less))
        return self.scale if less is None else self.scale * less

    def shares(self, work: PanelBatch, owner: Ints) -> Array:
        """The error that one piece of each of these integrals may have: (m * (1 + k), P)."""
        shares: Array = self.limits(work)[:, owner] / (2 * self.count[owner])
        return shares

    def settle_forms(self, work: PanelBatch, p: Pieces) -> bool:
        """Settle which form tells each derivative, the one with the smaller bound. Whether that asks for more: as long
        as either may, pieces do that are accurate in one, though of their sum only one is the answer. Not where
        rounding leaves more than that of how bounds move: the other form doesn't see it."""
        k = work.k
        if not work.both or self.fixed is not None:
            return False
        error, floor = added(work, np.concatenate((p.error, p.floor)), p, 2)
        bound = error + floor
        fixed = bound[:, 1 + k :] < bound[:, 1 : 1 + k]
        left = np.where(fixed, error[:, 1 + k :], error[:, 1 : 1 + k])
        limits = self.limits(work).reshape(work.width, 1 + k, -1)[:, 1:]
        if work.endless is not None:
            left = np.where(work.endless == 0, left, 0.0)
        if not (left > limits).any() or (floor[:, 1 : 1 + k] > limits).any():
            return False
        self.fixed = fixed
        return True


def spared(work: PanelBatch) -> Array | None:
    """How many times the error of each integral may be larger than that of others, since it counts so much less: (B,).
    What is not resolved at all says nothing of its error."""
    if work.slack is None:
        return None
    return np.minimum(work.slack, np.maximum(1.0, LEAST / max(work.machine.rtol, EPS)))


def filled(work: PanelBatch, p: Pieces) -> Array:
    """Which part of its range each integrand of a batch takes up, at the least: its mean over its largest, (B,)."""
    owner, length = work.seg.owner[p.segment], (work.seg.b - work.seg.a)[p.segment] * (p.u1 - p.u0)
    reach = np.bincount(owner, length, minlength=work.batch)
    share = np.ones(work.batch)
    for row in p.size.reshape(work.width, -1, owner.size)[:, : 1 + work.k].reshape(-1, owner.size):
        most = np.zeros(work.batch)
        np.maximum.at(most, owner, row / length)
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.bincount(owner, row, minlength=work.batch) / (most * reach)
        share = np.where(most > 0, np.fmin(share, np.nan_to_num(part)), share)
    return share


def too_coarse(work: PanelBatch, p: Pieces, ends: Any, tally: Tally) -> Any:
    """Masks of the pieces to halve, and of those to look at again later; None if there are none to halve.

    As long as a peak of an integral is not resolved, its total says nothing, and so what its other pieces may err
    is not known: they wait.
    """
    owner = work.seg.owner[p.segment]
    rows, m = p.integral.shape[0] // work.width, work.width
    error, floor = p.error.reshape(m, rows, -1), p.floor.reshape(m, rows, -1)
    k = work.k
    if work.both:  # per direction the better of the two forms, or the one that tells
        told = error[:, 1 + k :] < error[:, 1 : 1 + k] if tally.fixed is None else tally.fixed[:, :, owner]
        error = np.concatenate((error[:, :1], np.where(told, error[:, 1 + k :], error[:, 1 : 1 + k])), axis=1)
        floor = floor[:, : 1 + k]  # of what moves: how a bound moves shows what rounding leaves of it
    if work.endless is not None:
        error = error.copy()
        error[:, 1 : 1 + k] = np.where(work.endless[:, owner] == 0, error[:, 1 : 1 + k], 0.0)
    off, rounding = error.reshape(-1, p.segment.size), floor.reshape(-1, p.segment.size)
    bad = (off > tally.shares(work, owner)) & (off > 8 * rounding)
    bad = bad.any(axis=0) & ~noisy(p, np.where(bad, off, 0.0), tally.gross[owner], tally.whole(work)[:, owner])
    wide = (p.u1 - p.u0) >= NARROWEST
    waiting = np.zeros(bad.size, dtype=bool)
    if ends is not None:
        peak = missed_peak(work, p, ends) & wide
        if peak.any():
            blind = np.zeros(work.batch, dtype=bool)
            blind[owner[peak]] = True
            waiting = bad & blind[owner] & ~peak & wide
            bad = (bad & ~blind[owner]) | peak
    bad &= wide
    return (bad, waiting) if bad.any() else None


def stragglers(work: PanelBatch, p: Pieces, bad: Bools) -> Bools:
    """The pieces of the few members that are still refined when all others are done: they go on by themselves."""
    late: Bools = np.zeros(bad.size, dtype=bool)
    members = work.below(work.seg.owner[p.segment])
    if members is None:
        return late
    few = distinct(members[bad])
    if STRAGGLERS * few.size <= int(members.max()) + 1:
        work.machine.note(LATE, few)
        late |= np.isin(members, few)
    return late


def noisy(p: Pieces, off: Array, gross: Array, whole: Array) -> Bools:
    """Pieces whose errors are small and stay as they are however they are refined: what is left is rounding.

    off: (C, P) the errors that are too large; gross: (P,) what is added up, without regard to sign; whole: (C, P) the
    size of the answer.
    """
    worst = off.max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        excess = np.where(gross > 0, worst / gross, np.inf)
    p.stuck = np.where((p.excess > 0) & (excess > STUCK * p.excess), p.stuck + 1, 0)
    p.excess = excess
    small = (off <= NOISE[1] * whole).all(axis=0)
    return np.asarray(((excess <= NOISE[0]) & (p.stuck >= 1)) | (small & (p.stuck >= 3)))


def missed_peak(work: PanelBatch, p: Pieces, ends: Ends) -> Any:
    """Pieces at an end of their segment where the integrand is not what its values at the nodes lead to.

    Either it is far larger there than at any node, or it is off the interpolant through the nodes by far more
    than the interpolant's last terms: something narrow sits at the end. Rounding there is none of it: beside a stretch
    on which the integrand is 0 every bit of it would be.
    """
    seg = work.seg
    reach = seg.b - seg.a
    width = np.where(np.isinf(reach), seg.pace, reach)[p.segment] * (p.u1 - p.u0)
    plain = (seg.kind[p.segment] == substitution.LINEAR) & (p.end == 0)
    bad = np.zeros(p.segment.size, dtype=bool)
    m = work.width
    low, high = (ends.low, ends.low_error), (ends.high, ends.high_error)
    for (f, rounded), touches, led in ((low, p.u0 == 0, p.ends[:m]), (high, p.u1 == 1, p.ends[m:])):
        for c in range(m):
            at_end, slack = f[c][p.segment] * width, ROUNDED * rounded[c][p.segment] * width
            known = touches & np.isfinite(at_end)
            bad |= known & (np.abs(at_end) - slack > PEAK * p.most[c])
            off = np.abs(at_end - led[c]) - slack
            bad |= known & plain & (off > MISLED * p.tail[c] + 1e-8 * p.most[c])
    return bad


def count_unreached(work: PanelBatch, p: Pieces, ends: Ends | None) -> Pieces:
    """With what may sit at ends of segments, in the errors of pieces there, of members of which no nodes see anything.

    A piece that is too narrow to be halved may hold as much as if it were as high as at its end all over; of
    derivatives nothing is known then. Any may hold what the integral further in is off at the end. Where nodes see
    something these would be what rounding leaves where a region begins, or a pole that is integrable.
    """
    if ends is None:
        return p
    seg, m = work.seg, work.width
    reach, owner = seg.b - seg.a, seg.owner[p.segment]
    dark = np.bincount(owner, p.most.reshape(-1, owner.size).max(axis=0) > 0, minlength=work.batch)[owner] == 0
    if not dark.any():
        return p
    width = np.where(np.isinf(reach), 0.0, reach)[p.segment] * (p.u1 - p.u0)
    narrow = p.u1 - p.u0 < NARROWEST
    error = p.error.reshape(m, -1, p.segment.size).copy()
    for f, off, touches in ((ends.low, ends.low_error, p.u0 == 0), (ends.high, ends.high_error, p.u1 == 1)):
        height = np.abs(f[:, p.segment])
        held = np.where(np.isfinite(height) & narrow & touches & dark, height, 0.0) * width
        unseen = touches & dark & (width > 0) & (not work.last)
        error[:, 0] += held + np.where(unseen, np.where(np.isfinite(height), off[:, p.segment] * width, np.inf), 0.0)
        error[:, 1:] = np.where(held[:, None] > 0, np.inf, error[:, 1:])
    return replace(p, error=error.reshape(p.error.shape))


def doubtful(work: PanelBatch, p: Pieces, found: Totals) -> Any:
    """The larger pieces of integrals whose two derivatives do not agree: something between the nodes was missed."""
    if found.fixed is None or found.apart is None:
        return None
    doubt = found.apart > 4 * (found.moving[1] + found.fixed[1])
    if work.endless is not None:
        doubt &= work.endless == 0
    if not doubt.any():
        return None
    doubt &= found.apart > 1e-9 * (np.abs(found.moving[0]) + 1e-3 * found.size[:, 1 : 1 + work.k])
    doubt &= found.apart > NOISE[0] * found.size[:, :1]
    if not doubt.any():
        return None
    owners = np.asarray(doubt.any(axis=(0, 1)))
    bad = owners[work.seg.owner[p.segment]] & (p.u1 - p.u0 > 2.0**-DOUBTFUL_ROUNDS)
    return bad if bad.any() else None
