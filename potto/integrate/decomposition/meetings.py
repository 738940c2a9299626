"""Candidate cuts of one variable, and where they meet: on a bound, on one another, or where roots merge.

Owns `Row`, `SurfaceOnBound`, `Meeting`, `Sliver` and `FoldsHere`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct

from potto.integrate.columns import Columns, patterns_of
from potto.integrate.levels import LevelPlan
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Ints

# How far off, in units of the last place, a root may be that was found by numbers.
SEARCHED = 4
# How long a stretch is, in its own size, on which a surface is 0 to rounding because roots merge there: the root of
# what rounding comes to, where that around a simple root is as long as its rounding.
FLAT = 2.0**-30


class Row(Struct):
    """One candidate cut for the whole batch: where it is, how it moves, which cut of the level it belongs to.

    e, et: how far off the place, and its speeds, may be by rounding; None where that is not known.
    hides: how long the stretch around it is on all of which the surface is 0 to rounding, if there is one.
    passed: nothing is cut there, though what lies beside it may go on like a square root that turns there.
    """

    x: Array
    t: tuple[Any, ...]
    cut: int
    turning: bool
    e: Any = None
    et: tuple[Any, ...] = ()
    hides: Any = None
    passed: bool = False


class SurfaceOnBound(Columns):
    """A surface that lies on a bound, for some of the batch: `owner` (m,), at the upper bound or not, its speeds."""

    cut: int
    owner: Ints
    upper: bool
    x: Array
    root_t: Array
    bound_t: Array


class Meeting(Columns):
    """Jumps at one place that move apart, for some of the batch: `owner` (B,), place (B,), speeds (n, k, B).

    merged_t: the speed with which all of them were integrated, (k, B).
    """

    cuts: tuple[int, ...]
    owner: Ints
    x: Array
    speeds: Array
    merged_t: Array


class Sliver(Columns):
    """Jumps that rounding does not tell apart, from one another or from a bound, for some of the batch.

    `owner` (m,), place (m,), width (m,): how far apart they may be all the same; speed (m,): that of the fastest, over
    the range of the variable; upper: whether seen from below. passes: (k, m) how fast a jump that rounding puts beside
    a bound goes across it, so that it may be on either side: 0 where it is exactly on the bound.
    """

    cuts: tuple[int, ...]
    owner: Ints
    x: Array
    width: Array
    speed: Array
    upper: bool
    passes: Array


class FoldsHere(Struct):
    """Sections of a surface that appear, merge or turn just here, for some of the batch: `owner` (m,), place (m,)."""

    cut: int
    owner: Ints
    x: Array


def as_array(x: Any, batch: int) -> Array:
    if isinstance(x, np.ndarray):
        return x
    filled = np.empty(batch)  # what `np.full` does in five times the time
    filled.fill(x)
    return filled


def tangents(t: tuple[Any, ...], batch: int, directions: int) -> Array:
    out = np.zeros((directions, batch))
    for d, x in enumerate(t):
        if x is not None:
            out[d] = x
    return out


def meetings(plan: LevelPlan, rows: list[Row], inside: Bools, batch: int, directions: int) -> list[Meeting]:
    """The jumps of different surfaces that coincide inside the bounds and move apart."""
    jumps = [i for i, row in enumerate(rows) if plan.decides(row.cut)]
    x = np.stack([as_array(rows[i].x, batch) for i in jumps]) if jumps else np.zeros((0, batch))
    e = np.stack([as_array(0.0 if rows[i].e is None else rows[i].e, batch) for i in jumps]) if jumps else x
    t = np.stack([tangents(rows[i].t, batch, directions) for i in jumps]) if jumps else np.zeros((0, 0, batch))
    there = inside[[i + 1 for i in jumps]] & np.isfinite(t).all(axis=1)
    out: list[Meeting] = []
    for n, i in enumerate(jumps):
        other = np.array([rows[j].cut != rows[i].cut for j in jumps])
        on = there & there[n] & (np.abs(x - x[n]) <= e + e[n]) & other[:, None]
        apart = (np.abs(t - t[n]) > 1e-9 * (np.abs(t) + np.abs(t[n]))).any(axis=1)
        here = np.nonzero((on & apart).any(axis=0) & ~on[:n].any(axis=0))[0]
        on[n] = True
        for pattern, owner in patterns_of(on, here):
            met = np.nonzero(pattern)[0]
            speeds = t[met][:, :, owner]
            merged = np.take_along_axis(speeds, x[met][:, owner].argmin(axis=0)[None, None], axis=0)[0]
            out.append(Meeting(tuple(rows[jumps[m]].cut for m in met), owner, x[n, owner], speeds, merged))
    return out


def slivers(
    plan: LevelPlan, rows: list[Row], low: Array, high: Array, ends: tuple[Any, Any], directions: int, batch: int,
    kin: Ints | None,
) -> list[Sliver]:  # fmt: skip
    """Jumps that rounding does not tell apart. kin: of nodes of variables further out, whose they are."""
    jumps = [row for row in rows if plan.decides(row.cut)]
    if not jumps:
        return []
    x = np.stack([as_array(row.x, batch) for row in jumps])
    off = np.stack([as_array(np.nan if row.e is None else row.e, batch) for row in jumps])
    off = np.where(np.isnan(off), SEARCHED * EPS * np.abs(x), off)
    off = np.where(np.isfinite(off), off, 0.0)
    out: list[Sliver] = []

    def put(of: tuple[int, ...], at: Array, gap: Array, width: Array, upper: bool, passes: Any = 0.0) -> None:
        owner = np.nonzero((gap <= width) & (width > 0) & (low < high))[0]
        if owner.size:
            off_it = gap > 0
            if kin is not None:  # on a bound at some nodes, a few doubles beside it at others: on it by an accident
                off_it = off_it | np.isin(kin, kin[off_it & (gap <= SEARCHED * EPS * np.abs(at))])
            every = np.broadcast_to(np.where(off_it, passes, 0.0), (directions, batch))[:, owner]
            moves = np.abs([tangents(jumps[i].t, batch, directions) for i in of]).max(axis=(0, 1), initial=0.0)
            if of.count(of[0]) > 1:  # roots that merge move infinitely fast
                flat = (kin is None) & (width > FLAT * (1 + np.abs(at)))
                moves = np.where((moves > 0) & flat, np.inf, moves)
            fast = (moves / (high - low))[owner]
            out.append(Sliver(tuple(jumps[i].cut for i in of), owner, at[owner], width[owner], fast, upper, every))

    for bound, (moves, e), upper in ((low, ends[0], False), (high, ends[1], True)):
        gap, width = np.abs(x - bound), off + e
        for i in np.nonzero((gap <= width).any(axis=1))[0].tolist():
            put((i,), bound, gap[i], width[i], upper, np.abs(tangents(jumps[i].t, batch, directions) - moves))
    for j, i in _close(x, off):
        if jumps[j].cut != jumps[i].cut:
            gap = np.where((x[i] > low) & (x[i] < high), np.abs(x[i] - x[j]), np.inf)
            put((j, i), x[i], gap, off[i] + off[j], True)
    for i, row in enumerate(jumps):
        if row.hides is not None:
            put((i, i), x[i], np.where((x[i] > low) & (x[i] < high), 0.0, np.inf), row.hides, True)
    return out


def _close(x: Array, off: Array) -> list[tuple[int, int]]:
    """The pairs of rows that are as close for some member as they may be off; by neighbours, next but one, and so on,
    until none are close enough."""
    order = np.argsort(x, axis=0, kind="stable")
    x, off = np.take_along_axis(x, order, axis=0), np.take_along_axis(off, order, axis=0)
    pairs: set[tuple[int, int]] = set()
    for step in range(1, len(x)):
        gap = x[step:] - x[:-step]
        if not (gap <= 2 * off.max(axis=0)).any():
            break
        place, owner = np.nonzero(gap <= off[step:] + off[:-step])
        both = np.sort((order[place, owner], order[place + step, owner]), axis=0)
        pairs.update(zip(*both.tolist(), strict=True))
    return sorted(pairs)


def folds_at(
    plan: LevelPlan, rows: list[Row], low: Array, high: Array, directions: int, batch: int, nested: bool
) -> list[FoldsHere]:
    """Where roots of one surface are at one place, or one on which the integrand jumps moves infinitely fast; and where
    they merge to rounding, but for nodes of variables further out, which are cut where that happens. Those that only
    further in are something count where they go apart infinitely fast: what appears between them may be anything."""
    out: list[FoldsHere] = []
    before: dict[int, list[Any]] = {}
    for row in rows:
        others = before.setdefault(row.cut, [])
        others.append(row.x)
        if row.cut < 0:
            continue
        cut, x = plan.level.cuts[row.cut], as_array(row.x, batch)
        merged = np.zeros(batch, dtype=bool)
        for other in others[:-1]:
            merged = merged | (x == other)
        plain = not (cut.decides or row.turning or cut.turning)
        unknown = np.isnan(tangents(row.t, batch, directions)).any(axis=0)
        if plain and not (merged.any() or unknown.any()):
            continue
        fast: Any = np.zeros(batch, dtype=bool)
        if (cut.decides or plain) and any(not np.isfinite(t).all() for t in row.t if t is not None):
            fast = ~np.isfinite(tangents(row.t, batch, directions)).all(axis=0)
        folded = unknown | (merged & fast if plain else merged | fast)
        if row.hides is not None and cut.decides and not nested:
            flat = row.hides > FLAT * (1 + np.abs(x))
            folded = folded | (flat & (tangents(row.t, batch, directions) != 0).any(axis=0))
        owner = np.nonzero(folded & (x >= low) & (x <= high))[0]
        if owner.size:
            out.append(FoldsHere(row.cut, owner, x[owner]))
    return out
