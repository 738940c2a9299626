"""Where the integrals of a batch are cut along one variable.

Owns `segments`: bounds and sections, evaluated for the whole batch with their tangents, sorted, clipped to the
bounds, and turned into stretches on which the integrand is smooth. A cut counts only strictly inside the bounds: a
surface that lies exactly on an edge gives no boundary term, and is reported (`Edge`) since the one-sided derivatives
then differ.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from potto.integrate.levels import LevelPlan
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.substitution import Segments, choose
from potto.kernels.cells import Array, Bools, Cell, Ints, Value

# How far off, in units of the last place, a root may be that was found by numbers.
SEARCHED = 4
# The part of a range up to which cuts that rounding does not tell apart are taken for one: what is further off, however
# little is known of where it is, is not to be lost.
ONE_PLACE = 1e-6
# The part of its size up to which a place is all but that of another cut: no rule has its nodes in so few doubles.
NARROW = 16 * EPS
# How far beside cuts that are taken for one a place is clear of all of them, in terms of how far off they may be.
BLUR = 8


@dataclass
class Row:
    """One candidate cut for the whole batch: where it is, how it moves, which cut of the level it belongs to.

    e, et: how far off the place, and its speeds, may be by rounding; None where that is not known.
    hides: how long the stretch around it is on all of which the surface is 0 to rounding, if there is one.
    """

    x: Array
    t: tuple[Any, ...]
    cut: int
    turning: bool
    e: Any = None
    et: tuple[Any, ...] = ()
    hides: Any = None


@dataclass
class Edge:
    """A surface that lies on a bound, for some of the batch: `owner` (m,), at the upper bound or not, its speeds."""

    cut: int
    owner: Ints
    upper: bool
    x: Array
    root_t: Array
    bound_t: Array

    def pick(self, index: Any) -> Edge:
        return Edge(self.cut, self.owner[index], self.upper, self.x[index], self.root_t[:, index],
                    self.bound_t[:, index])  # fmt: skip


@dataclass
class Meeting:
    """Jumps at one place that move apart, for some of the batch: `owner` (B,), place (B,), speeds (n, k, B).

    merged_t: the speed with which all of them were integrated, (k, B).
    """

    cuts: tuple[int, ...]
    owner: Ints
    x: Array
    speeds: Array
    merged_t: Array

    def pick(self, index: Any) -> Meeting:
        return Meeting(self.cuts, self.owner[index], self.x[index], self.speeds[:, :, index], self.merged_t[:, index])


@dataclass
class Sliver:
    """Jumps that rounding does not tell apart, from one another or from a bound, for some of the batch.

    `owner` (m,), place (m,), width (m,): how far apart they may be all the same; speed (m,): that of the fastest, over
    the range of the variable; upper: whether seen from below. passes: (k, m) how fast a jump that rounding puts beside
    a bound goes across it, so that it may be on either side: 0 where it is on the bound.
    """

    cuts: tuple[int, ...]
    owner: Ints
    x: Array
    width: Array
    speed: Array
    upper: bool
    passes: Array

    def pick(self, index: Any) -> Sliver:
        return Sliver(self.cuts, self.owner[index], self.x[index], self.width[index], self.speed[index], self.upper,
                      self.passes[:, index])  # fmt: skip


@dataclass
class Fold:
    """Sections of a surface that appear, merge or turn just here, for some of the batch: `owner` (m,), place (m,)."""

    cut: int
    owner: Ints
    x: Array


@dataclass
class Cuts:
    """The outcome for one variable: orientation (B,), segments, whether anything moves, edges.

    brushes: edges at which only something further in changes. folds: where roots of one surface are at one place.
    slivers: what may lie between cuts that are taken for one. lost: the most that cuts left out may matter.
    conflict: cuts all but at one place move differently: harmless only where the integrand does not jump there.
    """

    sign: Array
    segments: Segments
    moving: bool
    edges: list[Edge]
    bound_nan: Bools | None
    conflict: bool = False
    meetings: list[Meeting] = field(default_factory=list)
    brushes: list[Edge] = field(default_factory=list)
    folds: list[Fold] = field(default_factory=list)
    slivers: list[Sliver] = field(default_factory=list)
    lost: Array | None = None


def as_array(x: Any, batch: int) -> Array:
    if isinstance(x, np.ndarray):
        return x
    return np.full(batch, x)


def frame_rows(plan: LevelPlan, values: tuple[Value, ...]) -> tuple[Cell, Cell, list[Row]]:
    cells = []
    for value in values:
        assert isinstance(value, Cell)
        cells.append(value)
    rows = [
        Row(cell.v, cell.t, cut, turning, 0.0 if cell.e is None else cell.e, cell.et)  # type: ignore[arg-type]
        for cell, (cut, turning) in zip(cells[2:], plan.rows, strict=True)
    ]
    return cells[0], cells[1], rows


_End = tuple[Any, Any, Any]  # values (batch), tangents (directions, batch), errors


def _ends(lo: Cell, hi: Cell, batch: int, directions: int) -> tuple[_End, _End, Array]:
    """The lower and the upper end, each with its tangents and its error, and the sign that turning them round costs."""
    low, high = as_array(lo.v, batch), as_array(hi.v, batch)
    tl, th = tangents(lo.t, batch, directions), tangents(hi.t, batch, directions)
    el, eh = (0.0 if bound.e is None else bound.e for bound in (lo, hi))
    sign = np.ones(batch)
    turn = high < low
    if turn.any():
        sign[turn] = -1.0
        low, high = np.where(turn, high, low), np.where(turn, low, high)
        tl, th = np.where(turn, th, tl), np.where(turn, tl, th)
        el, eh = np.where(turn, eh, el), np.where(turn, el, eh)
    return (low, tl, el), (high, th, eh), sign


def segments(plan: LevelPlan, lo: Cell, hi: Cell, rows: list[Row], batch: int, directions: int, nested: bool) -> Cuts:
    """Cut [lo, hi] at the rows; reversed bounds are turned round and counted negative."""
    (low, tl, el), (high, th, eh), sign = _ends(lo, hi, batch, directions)
    count = len(rows)
    x = np.empty((count + 2, batch))
    t = np.zeros((2 * directions, count + 2, batch))  # speeds, then their errors
    e = np.empty((count + 2, batch))
    x[0], x[-1], e[0], e[-1] = low, high, el, eh
    t[:directions, 0], t[:directions, -1] = tl, th
    inside = np.zeros((count + 2, batch), dtype=bool)
    edges: list[Edge] = []
    brushes: list[Edge] = []
    beyond: list[tuple[Array, bool]] = []
    for i, row in enumerate(rows, 1):
        root = as_array(row.x, batch)
        inner = (root > low) & (root < high)
        if nested:  # roots that merge just here move infinitely fast; a single node of the variables further out
            for speed in row.t:
                if speed is not None and isinstance(speed, np.ndarray):
                    inner &= np.isfinite(speed)
        inside[i] = inner
        x[i] = np.where(inner, root, high)
        off = SEARCHED * EPS * np.abs(root) if row.e is None else row.e
        e[i] = np.where(inner, off, eh)
        t[:directions, i] = np.where(inner, 0.0, th)
        for d, speed in enumerate(row.t[:directions]):
            if speed is not None:
                t[d, i] = np.where(inner, speed, th[d])
        for d, slip in enumerate(row.et[:directions]):
            if slip is not None:
                t[directions + d, i] = np.where(inner, slip, 0.0)
        if row.turning or (row.cut >= 0 and plan.level.cuts[row.cut].turning):
            beyond.append((root, True))
        if directions and row.cut >= 0:
            found, beside = (edges, None) if plan.level.cuts[row.cut].decides else (brushes, off)
            found += _edges(row, root, beside, (low, tl, el), (high, th, eh), directions, batch)
    rank = np.zeros((count + 2, batch), dtype=np.int64)
    conflict = merged = False
    blur = np.zeros_like(x)
    if count == 1:  # in order already
        rank[1] = _rank(plan, rows[0]) * inside[1]
    elif count:
        x, e, t, rank, conflict, blur = _sorted(plan, rows, x, e, t, inside)
        merged = bool(blur.any())
    cuts = _pieces(x, e, t, rank, blur, sign, beyond, edges)
    cuts.conflict, cuts.brushes = conflict, brushes
    if merged or edges or not nested or any(row.hides is not None for row in rows):
        cuts.slivers = _slivers(plan, rows, low, high, ((tl, el), (th, eh)), directions, batch)
    if directions:
        cuts.folds = _folds(plan, rows, low, high, directions, batch)
    if conflict:
        cuts.meetings = _meetings(plan, rows, inside, low.size, directions)
    return cuts


def _meetings(plan: LevelPlan, rows: list[Row], inside: Bools, batch: int, directions: int) -> list[Meeting]:
    """The jumps of different surfaces that coincide inside the bounds and move apart."""
    jumps = [i for i, row in enumerate(rows) if row.cut >= 0 and plan.level.cuts[row.cut].decides]
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
        for pattern in np.unique(on[:, here], axis=1).T if here.size else ():
            owner = here[(on[:, here] == pattern[:, None]).all(axis=0)]
            met = np.nonzero(pattern)[0]
            speeds = t[met][:, :, owner]
            merged = np.take_along_axis(speeds, x[met][:, owner].argmin(axis=0)[None, None], axis=0)[0]
            out.append(Meeting(tuple(rows[jumps[m]].cut for m in met), owner, x[n, owner], speeds, merged))
    return out


def _slivers(
    plan: LevelPlan, rows: list[Row], low: Array, high: Array, ends: tuple[Any, Any], directions: int, batch: int
) -> list[Sliver]:
    jumps = [row for row in rows if row.cut >= 0 and plan.level.cuts[row.cut].decides]
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
            every = np.broadcast_to(np.where(gap > 0, passes, 0.0), (directions, batch))[:, owner]
            moves = np.abs([tangents(jumps[i].t, batch, directions) for i in of]).max(axis=(0, 1), initial=0.0)
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


def _folds(plan: LevelPlan, rows: list[Row], low: Array, high: Array, directions: int, batch: int) -> list[Fold]:
    """Where roots of one surface are at one place, or one on which the integrand jumps moves infinitely fast."""
    out: list[Fold] = []
    before: dict[int, list[Any]] = {}
    for row in rows:
        others = before.setdefault(row.cut, [])
        others.append(row.x)
        if row.cut < 0 or not (plan.level.cuts[row.cut].decides or row.turning or plan.level.cuts[row.cut].turning):
            continue
        x = as_array(row.x, batch)
        folded: Any = np.zeros(batch, dtype=bool)
        if plan.level.cuts[row.cut].decides and any(not np.isfinite(t).all() for t in row.t if t is not None):
            folded = ~np.isfinite(tangents(row.t, batch, directions)).all(axis=0)
        for other in others[:-1]:
            folded = folded | (x == other)
        owner = np.nonzero(folded & (x >= low) & (x <= high))[0]
        if owner.size:
            out.append(Fold(row.cut, owner, x[owner]))
    return out


def standing(cuts: Cuts) -> Cuts:
    """The same cuts, none of which moves."""
    return replace(at_rest(cuts), edges=[], conflict=False, meetings=[], brushes=[], folds=[])


def at_rest(cuts: Cuts) -> Cuts:
    """The same cuts, with which no nodes move; what was found of their motion stays."""
    seg = cuts.segments
    seg.ta, seg.tb, seg.da, seg.db = (np.zeros_like(speed) for speed in (seg.ta, seg.tb, seg.da, seg.db))
    return replace(cuts, moving=False)


def tangents(t: tuple[Any, ...], batch: int, directions: int) -> Array:
    out = np.zeros((directions, batch))
    for d, x in enumerate(t):
        if x is not None:
            out[d] = x
    return out


def _edges(row: Row, root: Array, off: Any, lower: _End, upper: _End, directions: int, batch: int) -> list[Edge]:
    """Where a cut lies on a bound, or beside it by rounding, and does not move with it. off: that of the cut's place;
    None for cuts that must lie on the bound."""
    out: list[Edge] = []
    for above, (bound, tb, e) in ((False, lower), (True, upper)):
        on = root == bound
        if off is not None:
            with np.errstate(invalid="ignore"):
                on = on | (np.abs(root - bound) <= np.minimum(off + e, ONE_PLACE * (upper[0] - lower[0])))
        if not on.any():
            continue
        on = on & np.isfinite(bound) & (lower[0] < upper[0])
        speed = tangents(row.t, batch, directions)
        moves = np.abs(speed - tb) > 64 * EPS * np.maximum(np.abs(speed), np.abs(tb))
        owner = np.nonzero(on & moves.any(axis=0))[0]
        if owner.size:
            out.append(Edge(row.cut, owner, above, bound[owner], speed[:, owner], tb[:, owner]))
    return out


def _sorted(
    plan: LevelPlan, rows: list[Row], x: Array, e: Array, t: Array, inside: Bools
) -> tuple[Array, Array, Array, Ints, bool, Array]:
    conflict, blur = False, np.zeros_like(x)
    order = np.argsort(x, axis=0, kind="stable")
    # the bounds stay first and last even among equals: candidates were clipped to the upper bound
    member = np.arange(x.shape[1])
    x, e, inside = x[order, member], e[order, member], inside[order, member]
    close = (x[1:] - x[:-1] <= np.minimum(e[1:] + e[:-1], ONE_PLACE * (x[-1] - x[0]))) & inside[1:] & inside[:-1]
    if close.any():  # to rounding they are at one place
        for i in np.nonzero(close.any(axis=1))[0]:
            x[i + 1] = np.where(close[i], x[i], x[i + 1])
            wide = np.where(close[i], BLUR * (e[i] + e[i + 1] + EPS * np.abs(x[i])), 0.0)
            blur[i], blur[i + 1] = np.maximum(blur[i], wide), np.maximum(blur[i + 1], wide)
    rank: Ints = np.where(inside, np.array([0, *(_rank(plan, r) for r in rows), 0])[order], 0)
    if t.shape[0]:
        t = t[:, order, member]
        near = (x[1:] - x[:-1] <= NARROW * np.abs(x[1:])) & inside[1:] & inside[:-1]
        if near.any():
            speeds = t[: t.shape[0] // 2]
            apart = np.abs(speeds[:, 1:] - speeds[:, :-1]) > 1e-9 * (np.abs(speeds[:, 1:]) + np.abs(speeds[:, :-1]))
            conflict = bool((near & apart.any(axis=0)).any())
            _agree(t, near & (x[1:] == x[:-1]), rank)
    return x, e, t, rank, conflict, blur


def _rank(plan: LevelPlan, row: Row) -> int:
    if row.cut < 0:
        return 0
    return 2 if plan.level.cuts[row.cut].decides else 1


def _agree(t: Array, same: Bools, rank: Ints) -> None:
    """Coinciding cuts move as one, as the one that jumps does: the empty stretch between them is left out."""
    count = same.shape[0]
    for i in [*range(count), *reversed(range(count))]:
        first = same[i] & (rank[i] >= rank[i + 1])
        t[:, i + 1] = np.where(first, t[:, i], t[:, i + 1])
        rank[i + 1] = np.where(first, rank[i], rank[i + 1])
        second = same[i] & ~first
        t[:, i] = np.where(second, t[:, i + 1], t[:, i])
        rank[i] = np.where(second, rank[i + 1], rank[i])


def _pieces(
    x: Array, e: Array, t: Array, rank: Ints, blur: Array, sign: Array, beyond: list[tuple[Array, bool]],
    edges: list[Edge],
) -> Cuts:  # fmt: skip
    a, b = x[:-1], x[1:]
    owner, place = np.nonzero((b > a).T)
    a, b = a[place, owner], b[place, owner]
    k = t.shape[0] // 2
    (ta, da), (tb, db) = (np.split(t[:, at, owner], [k]) for at in (place, place + 1))
    left, right = np.full(a.shape, -np.inf), np.full(a.shape, np.inf)
    for root, _ in beyond:
        at = root[owner]
        left = np.where((at <= a) & (at > left), at, left)
        right = np.where((at >= b) & (at < right), at, right)
    moving = bool(ta.any() or tb.any())
    bad, ea, eb = np.isnan(x[0]) | np.isnan(x[-1]), e[place, owner], e[place + 1, owner]
    near = np.stack((blur[place, owner], blur[place + 1, owner]))
    rank, kind = rank[place, owner], choose(a, b, left, right)
    made = Segments(owner, a, b, ta, tb, kind, left, right, rank, ea, eb, near, da, db)
    return Cuts(sign, made, moving, edges, bad if bad.any() else None)
