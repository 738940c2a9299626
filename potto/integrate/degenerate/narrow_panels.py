"""Stretches so narrow that rounding hides on which side of a surface they lie.

Owns `count_narrow`. Between two cuts 1e-17 apart a surface is 0 to rounding, and which side is taken is an accident.
Hardly anything depends on it but a derivative, where the ends of the stretch move apart: so what the integrand is on
the other side, as far as it differs, is part of the error. Where one end is a bound, the surface lies on it as far as
anyone can tell, and the derivative has two sides.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from potto.integrate.columns import patterns_of
from potto.integrate.degenerate.scene import IteratedVariable, placed
from potto.integrate.events import TwoSided
from potto.integrate.pieces import Sums, take
from potto.integrate.rules import substitution
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Ints, Mask

MOST_SURFACES = 4  # whose sides are turned round in all combinations, at one stretch


def count_narrow(
    scene: IteratedVariable, seg: Segments, sides: Mapping[int, Mask], doubtful: Mapping[int, Bools], sums: Sums
) -> None:
    """Add to the errors what the integrand is on other sides of narrow stretches: doubtful says, by group, of which.

    At single nodes of the variables further out that does not matter.
    """
    there = np.stack(list(doubtful.values()))
    index = np.nonzero(there.any(axis=0))[0]
    index = index[scene.counted(seg.owner[index])]
    for pattern, part in patterns_of(there, index):
        groups = [g for g, doubt in zip(doubtful, pattern, strict=True) if doubt]
        owner = seg.owner[part]
        apart = _difference(scene, seg, sides, groups, part) if len(groups) <= MOST_SURFACES else np.full(1, np.inf)
        for c, rows in enumerate(np.broadcast_to(apart, (sums.v.shape[0], part.size))):
            length = np.where(rows > 0, (seg.b - seg.a)[part], 0.0)  # that of an infinite range may be as well
            np.add.at(sums.e[c], owner, rows * length)
            for d, spreads in enumerate(np.abs(seg.tb - seg.ta)[:, part]):
                np.add.at(sums.et[c, d], owner, np.where(spreads > 0, rows * spreads, 0.0))
        if not scene.machine.side and len(groups) == 1:
            spreads = (np.abs(seg.tb - seg.ta)[:, part] > 0).any(axis=0) & (apart > 0).any(axis=0)
            met = owner[spreads & _at_ends(seg)[part]]
            if met.size:
                surface = scene.parent.plan.groups[groups[0]].cut.surface
                scene.machine.note(TwoSided(scene.level.variable, surface, hidden=True), scene.below(met))


def _at_ends(seg: Segments) -> Bools:
    """Which segments are the first or the last of their owner's."""
    first, last = np.full(seg.owner.max() + 1, np.inf), np.full(seg.owner.max() + 1, -np.inf)
    np.minimum.at(first, seg.owner, seg.a)
    np.maximum.at(last, seg.owner, seg.b)
    return np.asarray((seg.a == first[seg.owner]) | (seg.b == last[seg.owner]))


def _difference(
    scene: IteratedVariable, seg: Segments, sides: Mapping[int, Mask], groups: list[int], part: Ints
) -> Array:
    """How far the integrand in the middle of some segments is from what it is with sides of some groups turned round,
    any of them: (m, S)."""
    x, _, _ = substitution.points(seg.pick(part), np.full((part.size, 1), 0.5))
    here, own = placed(scene.level, seg.owner[part], x[:, 0], scene.env), take(sides, part)
    found = []
    for turned in itertools.product((False, True), repeat=len(groups)):
        flipped = {g: np.logical_not(own[g]) for g, turn in zip(groups, turned, strict=True) if turn}
        found.append(scene.inside(seg.owner[part], here, {**own, **flipped})[0])
    apart = np.max([np.abs(f - found[0]) for f in found], axis=0)
    return np.where(np.isfinite(apart), apart, np.inf)
