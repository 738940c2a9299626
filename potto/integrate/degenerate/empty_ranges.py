"""Ranges of length zero: there is nothing to integrate over, and the derivative is not 0, since their bounds move.

Owns `Collapsed`, `collapsed_ranges` and `count_collapsed`. A little beside the parameters the range is a short one
between its bounds, and what jumps at its place cuts it, each as far along as it is fast. What the integral grows by is
the sum over these stretches of the integrand there times the rate at which the stretch grows (Leibniz' rule, with the
integrand to be taken between the surfaces). Where growing and shrinking parameters give two answers, both are told.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.integrate.columns import patterns_of
from potto.integrate.decomposition.meetings import SEARCHED, Row, as_array, tangents
from potto.integrate.degenerate.coincidences import one_by_one
from potto.integrate.degenerate.scene import IteratedVariable
from potto.integrate.events import EMPTY_UNDEFINED, EMPTY_UNSEEN, Shortfall, TwoSided
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Sums
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints

if TYPE_CHECKING:
    from collections.abc import Iterator


class Collapsed(Struct, frozen=True):
    """Ranges of length zero of some members: `owner` (m,), place x (m,), and the cuts that jump there.

    low, high: how the bounds move, (k, m); speeds: how the cuts do, (n, k, m); off: how far apart the bounds may be by
    rounding, (m,).
    """

    cuts: tuple[int, ...]
    owner: Ints
    x: Array
    low: Array
    high: Array
    speeds: Array
    off: Array

    def at_rest(self) -> Collapsed:
        """The same ranges with nothing that moves."""
        nothing = {name: np.zeros_like(getattr(self, name)) for name in ("low", "high", "speeds")}
        return replace(self, **nothing)


def collapsed_ranges(
    level: LevelPlan, lo: Cell, hi: Cell, rows: list[Row], batch: int, directions: int
) -> list[Collapsed]:
    """The ranges of length zero among those of a batch; those with the same jumps at their place together."""
    low, high = as_array(lo.v, batch), as_array(hi.v, batch)
    empty: Bools = (low == high) & np.isfinite(low)
    if not empty.any():
        return []
    tl, th = (tangents(bound.t, batch, directions) for bound in (lo, hi))
    off = sum(np.broadcast_to(0.0 if bound.e is None else bound.e, batch) for bound in (lo, hi))
    jumps = [row for row in rows if level.decides(row.cut)]
    found = []
    for owner, here in _by_jumps(jumps, low, empty):
        speeds = np.zeros((len(here), directions, owner.size))
        for n, row in enumerate(here):
            speeds[n] = tangents(row.t, batch, directions)[:, owner]
        cuts = tuple(row.cut for row in here)
        moves = tl[:, owner], th[:, owner], speeds
        found.append(Collapsed(cuts, owner, low[owner], *moves, np.asarray(off)[owner]))
    return found


def _by_jumps(jumps: list[Row], x: Array, empty: Bools) -> Iterator[tuple[Ints, list[Row]]]:
    """Members whose range is empty, with the jumps at its place."""
    on = np.zeros((len(jumps), x.size), dtype=bool)
    for n, row in enumerate(jumps):
        near = SEARCHED * EPS * np.abs(x) if row.e is None else row.e
        on[n] = np.abs(as_array(row.x, x.size) - x) <= near
    if not on[:, empty].any():
        yield np.nonzero(empty)[0], []
        return
    for pattern, owner in patterns_of(on, np.nonzero(empty)[0]):
        yield owner, [row for row, there in zip(jumps, pattern, strict=True) if there]


def count_collapsed(scene: IteratedVariable, found: list[Collapsed], sums: Sums) -> Sums:
    """The sums with what ranges of length zero grow by, and what rounding of their bounds may hide."""
    for ranges in found:
        if ranges.cuts and scene.parent.plan.hides:
            _unknown(scene, ranges, sums, EMPTY_UNSEEN)
            continue
        speeds = ranges.speeds if ranges.speeds.shape[1] else np.zeros((len(ranges.cuts), 1, ranges.x.size))
        order = np.argsort(np.stack([-speeds, speeds]), axis=1, kind="stable")
        f, e = scene.flips(ranges.cuts, ranges.owner, ranges.x, False, one_by_one(order))
        sums = sums.widened(f.shape[-2])
        folds = len(set(ranges.cuts)) < len(ranges.cuts)  # what that comes to is known from beside the parameters alone
        both = zip(f, order, (-1, 1), strict=True)
        backward, forward = np.zeros((2, 1)) if folds else (_growth(values, ranges, *which) for values, *which in both)
        size, at = np.abs(f).max(axis=(0, 1, 2)), (slice(None), slice(None), ranges.owner)
        rates = np.abs(ranges.low) + np.abs(ranges.high)
        differ = np.abs(forward - backward) > 1e-12 * size[:, None] * rates
        if scene.machine.side:
            growth = forward if scene.machine.side > 0 else backward
        else:
            as_it_falls = scene.as_it_falls(ranges.owner, ranges.x)[:, None] * (ranges.high - ranges.low)
            growth = np.where(differ | folds, as_it_falls, forward)
            two = differ.any(axis=(0, 1))
            if two.any():
                named = TwoSided(scene.level.variable, scene.surface(ranges.cuts[0]))
                scene.machine.note(named, scene.below(ranges.owner[two]))
        sums.t[at] = growth
        sums.et[at] = e.max(axis=(0, 1, 2))[:, None] * rates + 4 * EPS * np.abs(growth)
        sums.e[:, ranges.owner] = np.where(ranges.off > 0, size * ranges.off, 0.0)
        _note_gross(sums, ranges.owner, size[:, None] * rates)
        if np.isnan(sums.t[at]).any():
            _unknown(scene, ranges, sums, EMPTY_UNDEFINED)
        sums.et[at] = np.where(np.isinf(sums.t[at]), np.inf, sums.et[at])
    return sums


def _growth(f: Array, ranges: Collapsed, order: Ints, sign: int) -> Array:
    """The rate for parameters that grow, or shrink: (components, k, m). f: with the first 0, 1, … of the cuts in an
    order passed, (1 + n, k, components, m)."""
    low, high, speeds = sign * ranges.low, sign * ranges.high, sign * ranges.speeds
    first, last = np.minimum(low, high), np.maximum(low, high)
    ends = np.clip(np.take_along_axis(speeds, order, axis=0), first, last)
    lengths = np.diff(np.concatenate((first[None], ends, last[None])), axis=0)[:, :, None]
    grown = np.moveaxis(np.sum(np.where(lengths > 0, f * lengths, 0.0), axis=0), 0, 1)
    return np.asarray(sign * np.where(high < low, -1.0, 1.0) * grown)


def _note_gross(sums: Sums, owner: Ints, rates: Array) -> None:
    """What these members add up without regard to sign is at the least what goes in and out at their bounds."""
    gross = np.zeros((2, sums.v.shape[1])) if sums.gross is None else sums.gross.copy()
    gross[1, owner] = np.maximum(gross[1, owner], rates.max(axis=(0, 1), initial=0.0))
    sums.gross = gross


def _unknown(scene: IteratedVariable, ranges: Collapsed, sums: Sums, why: Shortfall) -> None:
    sums.et[:, :, ranges.owner] = np.inf
    scene.machine.note(why, scene.below(ranges.owner))
