"""Surfaces that lie on a bound, or on one another: what lies between them on either side of the present parameters.

Owns `count_places`. A cut counts only strictly inside the bounds, and cuts at one place are integrated as one that
moves with the first. What is missing follows from the integrand with surfaces flipped, in the order in which they are
met as the parameters grow, or shrink:

    at one place:  sum over crossings, left to right, of speed * (F before - F after)
    at a bound:    sum over the stretches between it and the surfaces that come in of F there - F further in, times the
                   rate at which the stretch grows

Growing parameters put slower surfaces to the left of faster ones, shrinking ones to the right. Where both ways come to
the same (jumps that are added up), that is the derivative; else there are two, and both are told.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from potto.integrate.columns import patterns_of
from potto.integrate.decomposition.cuts import NARROW, Cuts
from potto.integrate.decomposition.meetings import Meeting, SurfaceOnBound, as_array
from potto.integrate.degenerate.scene import IteratedVariable, all_subsets
from potto.integrate.events import Spot, SurfaceFold, TwoSided, on_a_bound
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Sums, numbers_at, still
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Cell, Ints

SURE = 1.001  # what rounding may add to a bound
# The part of the range of a variable over which what happens at a place where it is cut may be seen beside it: where a
# radicand is the square of the distance from it, it is 0 to rounding up to 1e-8 from there.
BESIDE_A_CUT = 2.0**-20


def count_places(scene: IteratedVariable, cuts: Cuts, sums: Sums) -> None:
    """Add to the tangents what surfaces on bounds and on one another contribute; say where they have two sides."""
    level, machine = scene.level, scene.machine
    places: list[tuple[Ints, Callable[[], tuple[Array, Array, Array]], bool, TwoSided]] = []
    for meeting in cuts.meetings:
        named = TwoSided(level.variable, scene.surface(meeting.cuts[0]), scene.surface(meeting.cuts[1]))
        met = meeting.pick(scene.counted(meeting.owner))
        places.append((met.owner, lambda m=met: at_one_place(scene, cuts.segments, m), True, named))  # type: ignore[misc]
    for group in _on_one_bound(cuts.edges, cuts.sign.size):
        named = TwoSided(level.variable, scene.surface(group[0].cut))
        on = [edge.pick(scene.counted(edge.owner)) for edge in group]
        places.append((on[0].owner, lambda g=on: at_a_bound(scene, cuts.segments, g), False, named))  # type: ignore[misc]
    for owner, changes, counts, named in places:
        if not owner.size:
            continue
        forward, backward, scale = changes()
        sums.widen(forward.shape[0])
        unknown = ~(np.isfinite(forward) & np.isfinite(backward))
        if unknown.any():
            _not_known(scene, sums, owner, unknown, named)
            forward, backward = np.where(unknown, 0.0, forward), np.where(unknown, 0.0, backward)
        base = sums.t[:, :, owner]
        differ = np.abs(forward - backward) > 1e-12 * (np.abs(base) + scale + 1e-300)
        if machine.side:
            sums.t[:, :, owner] = base + (forward if machine.side > 0 else backward)
            continue
        sums.t[:, :, owner] = base + (forward if counts else np.where(differ, 0.0, forward))
        two = differ.any(axis=(0, 1))
        if counts and scene.slack is not None:  # of nodes with next to no weight it is part of what they may be off by
            with np.errstate(invalid="ignore"):  # of a node with no weight at all, for which slack is infinite
                nothing = ~(np.abs(forward - backward) > scene.slack[owner] * machine.rtol * (np.abs(base) + scale))
            sums.et[:, :, owner] += np.where(nothing, np.abs(forward - backward), 0.0)
            two &= ~nothing.all(axis=(0, 1))
        if two.any():
            machine.note(named, scene.below(owner[two]))


def count_slivers(scene: IteratedVariable, cuts: Cuts, sums: Sums) -> None:
    """Add to the errors what may lie between surfaces that rounding does not tell apart, and say where one may be on
    either side of a bound."""
    machine = scene.machine
    for found in cuts.slivers:
        sliver = found.pick(scene.counted(found.owner))
        if not sliver.owner.size:
            continue
        far = room(cuts.segments, sliver.owner, sliver.x)
        f, _ = scene.flips(sliver.cuts, sliver.owner, sliver.x, not sliver.upper, all_subsets(len(sliver.cuts)), far)
        sums.widen(f.shape[1])
        apart = np.abs(f - f[0]).max(axis=0)
        lost = SURE * apart * sliver.width
        lost = np.where(np.isfinite(lost), lost, 0.0)
        at = (slice(None), sliver.owner)
        swept = lost * np.where(np.isfinite(sliver.speed), sliver.speed, 0.0)
        either = apart[:, None] * np.where(np.isfinite(sliver.passes), sliver.passes, 0.0)
        sums.et[:, :, sliver.owner] += swept[:, None] + np.where(np.isfinite(either), either, 0.0)
        if not machine.side and (hidden := (either > 0) & np.isfinite(either)).any():
            named = TwoSided(scene.level.variable, scene.surface(sliver.cuts[0]), hidden=True)
            machine.note(named, scene.below(sliver.owner[hidden.any(axis=(0, 1))]))
        if len(set(sliver.cuts)) < len(sliver.cuts):  # nothing is known of how a surface moves where it folds
            sums.et[:, :, sliver.owner] += np.where((lost > 0) & ~np.isfinite(sliver.speed), np.inf, 0.0)[:, None]
        sums.e[at] += lost
        if len(sliver.cuts) == 1 and sums.gross is not None:
            # What lies between two roundings of a bound is rounding of the bound, if there is nothing else, and what
            # is swept there is one of the sides that the derivative has.
            empty = (sums.v[at] == 0).all(axis=0)
            sums.gross[0, sliver.owner] += np.where(empty, lost.max(axis=0), 0.0) / EPS
            sums.gross[1, sliver.owner] += swept.max(axis=0) / EPS


def note_folds(scene: IteratedVariable, cuts: Cuts) -> None:
    """Say where sections of a surface appear or merge just here. At single nodes further out that does not matter."""
    levels, number = scene.parent.plan.levels, scene.number
    for fold in cuts.folds:
        counts = scene.counted(fold.owner)
        if number and counts.any():
            apart = _apart(scene, fold.owner)
            counts = np.zeros_like(counts)
            counts[apart] = scene.counted(fold.owner[apart])
        if not counts.any():
            continue
        owner, x = fold.owner[counts], fold.x[counts]
        here = [scene.env.get(level.variable) for level in levels[:number]]
        outer = [as_array(cell.v, cuts.sign.size)[owner] for cell in here if isinstance(cell, Cell)]
        named = TwoSided(levels[number].variable, levels[number].level.cuts[fold.cut].surface, fold=True)
        members = scene.below(owner)
        first = np.array([0])
        if members is not None:
            members, first = np.unique(members, return_index=True)
        spots = (Spot(number, fold.cut, float(x[i]), tuple(float(at[i]) for at in outer)) for i in first)
        scene.machine.note(SurfaceFold(named, tuple(spots)), members)


def _apart(scene: IteratedVariable, owner: Ints) -> Ints:
    """The nodes of variables further out at which something happens, but for those beside one another: crowded next to
    the end of a panel, as rules have them where they turn, they are within rounding of the place where it is cut."""
    levels = scene.parent.plan.levels[: scene.number]
    cells = [scene.env[level.variable] for level in levels]
    places = np.stack([as_array(cell.v, scene.batch) for cell in cells if isinstance(cell, Cell)])[:, owner]
    members = np.zeros((1, owner.size)) if scene.root is None else scene.root[None, owner]
    order = np.lexsort((*places[::-1], *members))
    outer, x = np.concatenate((members, places[:-1]))[:, order], places[-1, order]
    reach = _reach(scene, levels[-1])[owner[order]]
    near = np.zeros(owner.size + 1, dtype=bool)
    near[1:-1] = (outer[:, 1:] == outer[:, :-1]).all(axis=0)
    near[1:-1] &= np.diff(x) <= BESIDE_A_CUT * np.where(np.isfinite(reach), reach, 1 + np.abs(x))[1:]
    return np.sort(order[~(near[1:] | near[:-1])])


def _reach(scene: IteratedVariable, level: LevelPlan) -> Array:
    """How far the range of a variable further out goes, for each of a batch."""
    quiet = scene.machine.with_directions(0)
    ends = numbers_at(level.bounds, quiet, {n: still(scene.env[n]) for n in level.bounds.params})
    lo, hi = (as_array(cell.v, scene.batch) for cell in ends)
    return np.abs(hi - lo)


def _not_known(scene: IteratedVariable, sums: Sums, owner: Ints, unknown: Bools, named: TwoSided) -> None:
    sums.et[:, :, owner] = np.where(unknown, np.inf, sums.et[:, :, owner])
    scene.machine.note(on_a_bound(named), scene.below(owner[unknown.any(axis=(0, 1))]))


def at_one_place(scene: IteratedVariable, seg: Segments, meeting: Meeting) -> tuple[Array, Array, Array]:
    """What the forward and the backward derivative have beyond that of the merged cut, (m, k, B); and their size."""
    v = meeting.speeds
    order = np.stack([np.argsort(sign * v, axis=0, kind="stable") for sign in (1, -1)])
    far = room(seg, meeting.owner, meeting.x)
    f, e = scene.flips(meeting.cuts, meeting.owner, meeting.x, False, one_by_one(order), far)
    f = np.where(np.isnan(e), np.nan, f)  # (sides, 1 + n, k, m, B)
    merged = (f[0, 0] - f[0, -1]) * meeting.merged_t[:, None]
    speed = np.take_along_axis(np.stack([v, v]), order, axis=1)
    crossed = np.sum((f[:, :-1] - f[:, 1:]) * speed[:, :, :, None], axis=1) - merged
    forward, backward = np.moveaxis(crossed, 1, 2)
    scale = np.abs(f).max(axis=(0, 1)) * np.abs(v).max(axis=0)[:, None]
    return forward, backward, np.moveaxis(scale, 0, 1)


def at_a_bound(scene: IteratedVariable, seg: Segments, edges: Sequence[SurfaceOnBound]) -> tuple[Array, Array, Array]:
    """What the forward and the backward derivative have beyond that without these surfaces, (m, k, B); their size."""
    first = edges[0]
    inward = np.stack([e.bound_t - e.root_t if e.upper else e.root_t - e.bound_t for e in edges])
    speed = np.stack([np.maximum(inward, 0.0), np.maximum(-inward, 0.0)])
    order = np.argsort(-speed, axis=1, kind="stable")
    far = room(seg, first.owner, first.x)
    f, e = scene.flips([edge.cut for edge in edges], first.owner, first.x, not first.upper, one_by_one(order), far)
    f = np.where(np.isnan(e), np.nan, f)  # (sides, 1 + n, k, m, B)
    speed = np.take_along_axis(speed, order, axis=1)
    growth = (speed - np.append(speed[:, 1:], np.zeros_like(speed[:, :1]), axis=1))[:, :, :, None]
    gained = np.sum(np.where(growth > 0, (f[:, 1:] - f[:, :1]) * growth, 0.0), axis=1)
    forward, backward = np.moveaxis(gained, 1, 2)
    scale = np.abs(f[0, 0]) + np.abs(f[0, -1])
    return forward, -backward, np.moveaxis(scale, 0, 1)


def one_by_one(order: Ints) -> Bools:
    """Which of n surfaces are flipped when the first 0, 1, …, n are: (sides, 1 + n, k, n, B).

    order: (sides, n, k, B).
    """
    rank = np.moveaxis(np.argsort(order, axis=1), 1, 2)[:, None]
    return np.asarray(rank < np.arange(order.shape[1] + 1)[:, None, None, None])


def room(seg: Segments, owner: Ints, x: Array) -> Array:
    """How far it is from places of some members to the next cut that rounding tells from them, (B,)."""
    place, found = np.full((2, max(seg.owner.max(initial=0), owner.max(initial=0)) + 1), np.inf)
    place[owner] = x
    at = place[seg.owner]
    for end in (seg.a, seg.b):
        with np.errstate(invalid="ignore"):
            gap = np.abs(end - at)
            np.minimum.at(found, seg.owner, np.where(gap > NARROW * np.abs(at), gap, np.inf))
    return np.asarray(found[owner])


def _on_one_bound(edges: Sequence[SurfaceOnBound], batch: int) -> list[list[SurfaceOnBound]]:
    """Edges with those others that lie on the same bound of the same members, members with the same ones together.

    Where two sections of one surface meet on a bound it folds there, and which of them come in is not known.
    """
    out: list[list[SurfaceOnBound]] = []
    for upper in (False, True):
        here = [e for e in edges if e.upper == upper]
        if not here:
            continue
        on = np.zeros((len(here), batch), dtype=bool)
        for n, edge in enumerate(here):
            on[n, edge.owner] = True
        for pattern, owner in patterns_of(on, np.nonzero(on.any(axis=0))[0]):
            group = [e.pick(np.isin(e.owner, owner)) for e, there in zip(here, pattern, strict=True) if there]
            if len({e.cut for e in group}) == len(group):
                out.append(group)
    return out
