"""Where the integrals of a batch are cut along one variable.

Owns `segments`: bounds and sections, evaluated for the whole batch with their tangents, sorted, clipped to the bounds,
and turned into stretches on which the integrand is smooth. A cut counts only strictly inside the bounds: a surface that
lies exactly on an edge gives no boundary term, and is reported (`SurfaceOnBound`) since the one-sided derivatives then
differ.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.integrate.decomposition.meetings import (
    SEARCHED,
    FoldsHere,
    Meeting,
    Row,
    Sliver,
    SurfaceOnBound,
    as_array,
    folds_at,
    meetings,
    slivers,
    tangents,
)
from potto.integrate.levels import RESTING, LevelPlan
from potto.integrate.pieces import Evaluator, mostly, numbers_at
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.substitution import Segments, choose
from potto.kernels.cells import Array, Bools, Cell, Ints, Value

# The part of a range up to which cuts that rounding does not tell apart are taken for one: what is further off, however
# little is known of where it is, is not to be lost.
ONE_PLACE = 1e-6
# The part of its size up to which a place is all but that of another cut: no rule has its nodes in so few doubles.
NARROW = 16 * EPS
# How far beside cuts that are taken for one a place is clear of all of them, in terms of how far off they may be.
BLUR = 8
# How many roundings apart an end and a turning place are one.
ITSELF = 4


class Cuts(Struct):
    """The outcome for one variable: orientation (B,), segments, whether anything moves, edges.

    brushes: edges at which only something further in changes. folds: where roots of one surface are at one place.
    slivers: what may lie between cuts that are taken for one. lost: the most that cuts left out may matter. unplaced:
    members of which a surface may have a root anywhere.
    conflict: cuts all but at one place move differently: harmless only where the integrand does not jump there.
    paired: cuts at one place, at which it should only bend, move as one: so does a surface that runs along what is
    further in, where it leaves the one bound and the other.
    rested: cuts move with which no nodes do, since the integrand should be continuous there.
    """

    sign: Array
    segments: Segments
    moving: bool
    edges: list[SurfaceOnBound]
    bound_nan: Bools | None
    conflict: bool = False
    paired: bool = False
    rested: bool = False
    meetings: list[Meeting] = []
    brushes: list[SurfaceOnBound] = []
    folds: list[FoldsHere] = []
    slivers: list[Sliver] = []
    lost: Array | None = None
    unplaced: Ints | None = None


def frame_rows(plan: LevelPlan, machine: Evaluator, env: Mapping[str, Value]) -> tuple[Cell, Cell, list[Row]]:
    """The bounds of a variable, and the candidate cuts that have closed forms."""
    cells = numbers_at(plan.frame, machine, env)
    rows = [
        Row(cell.v, cell.t, cut, turning, 0.0 if cell.e is None else cell.e, cell.et)  # type: ignore[arg-type]
        for cell, (cut, turning) in zip(cells[2:], plan.rows, strict=True)
    ]
    for row in rows:
        if row.cut < 0:  # nothing bends at these: it is all the same how far off they are
            row.e = None
        if row.cut == RESTING:
            row.t = row.et = ()
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


def _calmed(t: Array, inside: Bools, kin: Ints) -> None:
    """Bring speeds to rest (k, rows, B) that are infinite at single nodes of variables further out, where a root merges
    with another just here. Those that are so at many of them count."""
    fast = inside & ~np.isfinite(t).all(axis=0)
    for i in np.nonzero(fast.any(axis=1))[0]:
        here = np.nonzero(fast[i])[0]
        t[:, i, np.setdiff1d(here, mostly(here, kin, kin.size))] = 0.0


def _stacked(rows: list[Row], batch: int, directions: int) -> tuple[Array, Array, Array]:
    """Where roots are, and how far off they may be, (rows, B) each; their speeds, then how far off these may be,
    (2k, rows + 2, B), with room for those of the bounds."""
    roots, off = np.empty((2, len(rows), batch))
    t = np.zeros((2 * directions, len(rows) + 2, batch))
    for i, row in enumerate(rows):
        roots[i] = row.x
        off[i] = SEARCHED * EPS * np.abs(row.x) if row.e is None else row.e
        for first, speeds in ((0, row.t), (directions, row.et)):
            for d, speed in enumerate(speeds[:directions], first):
                if speed is not None:
                    t[d, i + 1] = speed
    return roots, off, t


def segments(
    plan: LevelPlan, lo: Cell, hi: Cell, rows: list[Row], batch: int, directions: int, kin: Ints | None
) -> Cuts:
    """Cut [lo, hi] at the rows; reversed bounds are turned round and counted negative.

    kin: of a batch of nodes of variables further out, whose they are; None where there is no variable further out.
    """
    nested = kin is not None
    (low, tl, el), (high, th, eh), sign = _ends(lo, hi, batch, directions)
    beyond = [as_array(row.x, batch) for row in rows if row.passed]
    rows = [row for row in rows if not row.passed]
    count = len(rows)
    roots, off, t = _stacked(rows, batch, directions)
    inside = np.zeros((count + 2, batch), dtype=bool)
    inner = inside[1:-1] = (roots > low) & (roots < high)
    if kin is not None:
        _calmed(t[:directions, 1:-1], inner, kin)
    x, e = np.empty((2, count + 2, batch))
    x[0], x[-1], x[1:-1] = low, high, np.where(inner, roots, high)
    e[0], e[-1], e[1:-1] = el, eh, np.where(inner, off, eh)
    ends = (low, tl, el), (high, th, eh)
    edges, brushes = _edges(plan, rows, roots, off, t[:directions, 1:-1], ends) if directions else ([], [])
    t[:directions, 0], t[:directions, -1] = tl, th
    t[:directions, 1:-1] = np.where(inner, t[:directions, 1:-1], th[:, None])
    t[directions:, 1:-1] = np.where(inner, t[directions:, 1:-1], 0.0)
    turning = (row.turning or (row.cut >= 0 and plan.level.cuts[row.cut].turning) for row in rows)
    beyond += [root for root, turns in zip(roots, turning, strict=True) if turns]
    rank = np.zeros((count + 2, batch), dtype=np.int64)
    conflict = paired = merged = False
    blur = np.zeros_like(x)
    if count == 1:  # in order already
        rank[1] = _rank(plan, rows[0]) * inside[1]
    elif count:
        x, e, t, rank, (conflict, paired), blur = _sorted(plan, rows, x, e, t, inside)
        merged = bool(blur.any())
    cuts = _pieces(x, e, t, rank, blur, sign, beyond, edges)
    cuts.conflict, cuts.paired, cuts.brushes = conflict, paired, brushes
    if merged or edges or not nested or any(row.hides is not None for row in rows):
        cuts.slivers = slivers(plan, rows, low, high, ((tl, el), (th, eh)), directions, batch, kin)
    if directions:
        cuts.folds = folds_at(plan, rows, low, high, directions, batch, nested)
    if conflict:
        cuts.meetings = meetings(plan, rows, inside, low.size, directions)
    return cuts


def on_bounds(
    plan: LevelPlan, lo: Cell, hi: Cell, rows: list[Row], batch: int, directions: int, kin: Ints | None
) -> list[Row]:
    """The rows, with jumps put on a bound that rounding does not tell from it, or what lies between from nothing: for
    derivatives to one side, where it is known on which side of the bound they are. kin: as `segments` takes it."""
    ends = _ends(lo, hi, batch, directions)[:2]
    roots, off, t = _stacked(rows, batch, directions)
    found = []
    for number, row in enumerate(rows):
        x = roots[number]
        most = _one_place(ends[0][0], ends[1][0], x)
        for bound, speed, e in ends if plan.decides(row.cut) else ():
            near = np.clip(off[number] + e, NARROW * np.abs(bound), most)
            near = (np.abs(x - bound) <= near) & (x != bound) & np.isfinite(bound)
            near &= (t[:directions, number + 1] != speed).any(axis=0)
            if near.any():
                owner = np.nonzero(near)[0]
                owner = owner if kin is None else mostly(owner, kin, batch)
                x = x.copy()
                x[owner] = bound[owner]
        found.append(row if x is roots[number] else replace(row, x=x))
    return found


def _one_place(low: Array, high: Array, x: Array) -> Array:
    """How far from x another place is at the most the same but for rounding. Of infinite ranges no part tells that."""
    reach = high - low
    return ONE_PLACE * np.where(np.isfinite(reach), reach, 1 + np.abs(x))


def standing(cuts: Cuts) -> Cuts:
    """The same cuts, none of which moves."""
    return replace(at_rest(cuts), edges=[], conflict=False, rested=False, meetings=[], brushes=[], folds=[])


def at_rest(cuts: Cuts) -> Cuts:
    """The same cuts, with which no nodes move; what was found of their motion stays."""
    seg = cuts.segments
    moved = seg.ta.any() or seg.tb.any()
    seg.ta, seg.tb, seg.da, seg.db = (np.zeros_like(speed) for speed in (seg.ta, seg.tb, seg.da, seg.db))
    return replace(cuts, moving=False, rested=bool(moved))


def finite_speeds(cuts: Cuts) -> Cuts:
    """The same cuts, those at rest that would move infinitely fast, as roots do that merge just here: for cuts along
    which what is integrated is continuous, where any motion of nodes does."""
    seg = cuts.segments
    for name, beside in (("ta", "da"), ("tb", "db")):
        fast = ~np.isfinite(getattr(seg, name))
        if fast.any():
            setattr(seg, name, np.where(fast, 0.0, getattr(seg, name)))
            setattr(seg, beside, np.where(fast, 0.0, getattr(seg, beside)))
    return cuts


def _edges(
    plan: LevelPlan, rows: list[Row], roots: Array, off: Array, speeds: Array, ends: tuple[_End, _End]
) -> tuple[list[SurfaceOnBound], list[SurfaceOnBound]]:
    """Where cuts lie on a bound and do not move with it: those that decide; and the others, also where they lie beside
    it by rounding."""
    decides = np.array([plan.decides(row.cut) for row in rows], dtype=bool)
    (low, _, _), (high, _, _) = ends
    found: list[tuple[int, SurfaceOnBound]] = []
    for upper, (bound, tb, e) in enumerate(ends):
        with np.errstate(invalid="ignore"):
            near = np.where(decides[:, None], 0.0, np.minimum(off + e, _one_place(low, high, roots)))
            on = (roots == bound) | (np.abs(roots - bound) <= near)
        for i in np.nonzero(on.any(axis=1))[0].tolist():
            if rows[i].cut < 0:
                continue
            speed = speeds[:, i]
            moves = np.abs(speed - tb) > 64 * EPS * np.maximum(np.abs(speed), np.abs(tb))
            owner = np.nonzero(on[i] & np.isfinite(bound) & (low < high) & moves.any(axis=0))[0]
            if owner.size:
                edge = SurfaceOnBound(rows[i].cut, owner, bool(upper), bound[owner], speed[:, owner], tb[:, owner])
                found.append((i, edge))
    found.sort(key=lambda pair: pair[0])
    return [edge for i, edge in found if decides[i]], [edge for i, edge in found if not decides[i]]


def _sorted(
    plan: LevelPlan, rows: list[Row], x: Array, e: Array, t: Array, inside: Bools
) -> tuple[Array, Array, Array, Ints, tuple[bool, bool], Array]:
    conflict, paired, blur = False, False, np.zeros_like(x)
    order = np.argsort(x, axis=0, kind="stable")
    # the bounds stay first and last even among equals: candidates were clipped to the upper bound
    member = np.arange(x.shape[1])
    x, e, inside = x[order, member], e[order, member], inside[order, member]
    most = np.minimum(e[1:] + e[:-1], _one_place(x[0], x[-1], x[1:]))  # roots that merge may be off by anything
    close = (x[1:] - x[:-1] <= most) & inside[1:] & inside[:-1]
    rank: Ints = np.where(inside, np.array([0, *(_rank(plan, r) for r in rows), 0])[order], 0)
    if close.any():  # to rounding they are at one place
        for i in np.nonzero(close.any(axis=1))[0]:
            wide = np.where(close[i], BLUR * (e[i] + e[i + 1] + EPS * np.abs(x[i])), 0.0)
            blur[i], blur[i + 1] = np.maximum(blur[i], wide), np.maximum(blur[i + 1], wide)
        _put_at_one_place(x, e, close, rank)
    if t.shape[0]:
        t = t[:, order, member]
        near = (x[1:] - x[:-1] <= NARROW * np.abs(x[1:])) & inside[1:] & inside[:-1]
        if near.any():
            speeds = t[: t.shape[0] // 2]
            apart = np.abs(speeds[:, 1:] - speeds[:, :-1]) > 1e-9 * (np.abs(speeds[:, 1:]) + np.abs(speeds[:, :-1]))
            conflict = bool((near & apart.any(axis=0)).any())
            bends = (rank[1:] == 1) & (rank[:-1] == 1) & speeds[:, 1:].any(axis=0)
            paired = bool((near & bends & ~apart.any(axis=0)).any())
            _agree(t, near & (x[1:] == x[:-1]), rank)
    return x, e, t, rank, (conflict, paired), blur


def _rank(plan: LevelPlan, row: Row) -> int:
    return 2 if plan.decides(row.cut) else int(row.cut >= 0)


def _put_at_one_place(x: Array, e: Array, close: Bools, rank: Ints) -> None:
    """Cuts that rounding does not tell apart are where that one is that jumps, and of several the best known: what
    crosses a jump that moves is worked out at its place, and a double root beside it may be off by 1e-8."""
    rank, e = rank.copy(), e.copy()
    met = np.nonzero(close.any(axis=1))[0].tolist()
    for i in [*met, *reversed(met)]:
        first = (rank[i] > rank[i + 1]) | ((rank[i] == rank[i + 1]) & (e[i] <= e[i + 1]))
        for taker, giver, of in ((i + 1, i, close[i] & first), (i, i + 1, close[i] & ~first)):
            for known in (x, e, rank):
                known[taker] = np.where(of, known[giver], known[taker])


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
    x: Array, e: Array, t: Array, rank: Ints, blur: Array, sign: Array, beyond: list[Array],
    edges: list[SurfaceOnBound],
) -> Cuts:  # fmt: skip
    a, b = x[:-1], x[1:]
    owner, place = np.nonzero((b > a).T)
    a, b = a[place, owner], b[place, owner]
    k = t.shape[0] // 2
    (ta, da), (tb, db) = (np.split(t[:, at, owner], [k]) for at in (place, place + 1))
    left, right = np.full(a.shape, -np.inf), np.full(a.shape, np.inf)
    for root in beyond:
        at = root[owner]
        # a map around a point that is but a rounding beyond an end leaves out the square root of that
        near = ITSELF * EPS * np.abs(at)
        left = np.where((at <= a) & (at > left), np.where(at >= a - near, a, at), left)
        right = np.where((at >= b) & (at < right), np.where(at <= b + near, b, at), right)
    moving = bool(ta.any() or tb.any())
    bad, ea, eb = np.isnan(x[0]) | np.isnan(x[-1]), e[place, owner], e[place + 1, owner]
    near = np.stack((blur[place, owner], blur[place + 1, owner]))
    rank, kind = rank[place, owner], choose(a, b, left, right)
    made = Segments(owner, a, b, ta, tb, kind, left, right, rank, ea, eb, near, da, db, np.ones(a.shape))
    return Cuts(sign, made, moving, edges, bad if bad.any() else None)
