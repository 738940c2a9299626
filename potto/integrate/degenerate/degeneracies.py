"""Steps where only bends are expected: a surface that runs along a variable further in has no section there.

Owns `seems_to_step`, `steps_at_cuts`, `brush` (at bounds), `beneath` (where another surface is), `beside` and `jumps`.
What is further in is integrated on both sides of the place. If it jumps, and it is one surface that makes it jump, what
crosses that face is known (`faces`); else another variable must go innermost.
"""

from __future__ import annotations

import numpy as np

from potto.integrate.columns import distinct
from potto.integrate.decomposition.cuts import Cuts
from potto.integrate.degenerate.faces import THIN, Place, crossing, running
from potto.integrate.degenerate.scene import IteratedVariable, around, placed
from potto.integrate.events import Degenerate
from potto.integrate.panels.panel_batch import PanelBatch
from potto.integrate.pieces import Crossing, Pieces, numbers_at, take
from potto.integrate.rules.gauss import EPS
from potto.integrate.rules.substitution import LINEAR, Segments
from potto.kernels.cells import Array, Bools, Ints, Mask

# How far beside a place it is looked at (beside a bound twice), and what part may be lost across it.
BESIDE, DISCONTINUITY = (1e-7, 1e-9), 1e-6
# How long a stretch is, in the size of the place, beside which a step can be seen. Shorter ones, as of an edge that
# leans by some doubles, are all within rounding.
SLIM = 1024 * EPS
HARMLESS = 1e-12  # the part of a derivative up to which cuts of a step may move apart, as a part of its error
# How far sections may have come at the nearer of these places, in their size, that don't run along the bound.
SLOW = 1e-3


def steps_at_cuts(work: PanelBatch, whole: Pieces) -> Crossing | None:
    """What crosses the cuts at which the integral further in jumps where only its kinks were expected, which move in
    different ways.

    A surface that runs along the variables further in leaves such a step. Looked at just beside the cut, since on
    the cut itself the sides are a matter of rounding; so they are between cuts that are all but at one place.
    """
    seg, parts = work.seg, len(BESIDE)
    left, right = _neighbours(seg)
    if not left.size:
        return None
    owner, x = seg.owner[right], seg.a[right]
    width = np.minimum((seg.b - seg.a)[right], (seg.b - seg.a)[left])
    scene = IteratedVariable(work.parent, work.number, work.level, work.env, {}, work.machine, work.batch, work.root)
    reach, known = np.maximum(seg.ea[right], x - seg.b[left]), not (work.parent.plan.hides or work.machine.frozen)
    along = running(scene, owner, x, reach) > 0 if known else np.zeros(owner.size, dtype=bool)
    if not (work.conflict or work.rested or along.any()):
        return None
    beside = [end + sign * part * np.minimum(width, 1e300)
              for part in BESIDE for end, sign in ((x, 1.0), (seg.b[left], -1.0))]  # fmt: skip
    index = np.concatenate([right, left] * parts)
    sides: dict[int, Mask] = {g: np.broadcast_to(m, index.shape) for g, m in take(work.sides, index).items()}
    crowded = (seg.a[right] > seg.b[left]) | (seg.blur[0, right] > 0)
    if crowded.any():  # where several run along, neither side says what lies between them
        hidden = distinct(owner[crowded][running(scene, owner[crowded], x[crowded], reach[crowded]) > 1])
        if hidden.size:
            work.machine.note(Degenerate(work.level.variable), scene.below(hidden))
            return None
    values = _inside(scene, owner, np.concatenate(beside), sides)
    after, before = values[:, 0::2], values[:, 1::2]
    mean = whole.size.reshape(work.width, -1, seg.a.size)[:, 0] / (seg.b - seg.a)
    size = np.abs(after[:, 1]) + np.abs(before[:, 1]) + mean[:, right] + mean[:, left]
    # What jumps may come to nothing over the variables further in, as x*y does over an even range of y, but not times
    # the speed, which depends on them.
    jumps = np.nonzero(_does_jump(np.abs(after - before), size) | along)[0]
    if not jumps.size:
        return None
    left, right = left[jumps], right[jumps]
    off = np.maximum(np.minimum(seg.ea[right], THIN * width[jumps]), x[jumps] - seg.b[left])
    sides = take(work.sides, left)
    place = Place(owner[jumps], x[jumps], off, seg.ta[:, right], sides, (before - after)[:, 1, jumps])
    as_one = _move_as_one(work, whole, left, right, place.jump)
    found = crossing(scene, place, DISCONTINUITY * size[:, jumps]) if as_one else None
    if found is None:
        work.machine.note(Degenerate(work.level.variable), scene.below(distinct(owner[jumps])))
        return None
    for i, j in zip(left, right, strict=True):  # what moves there is what crosses
        for part in (whole.integral, whole.error, whole.floor):
            part.reshape(work.width, -1, seg.a.size)[:, 1:, i + 1 : j] = 0.0
    return found


def seems_to_step(work: PanelBatch, whole: Pieces) -> bool:
    """Whether the integrand may take a step at cuts with which no nodes move, since it is taken to be continuous there:
    as its polynomials on both sides have it, or because a map of the nodes hides what it is there."""
    seg = work.seg
    if not work.rested or work.at_ends is None:
        return False
    left, right = _neighbours(seg)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = whole.size[:: whole.size.shape[0] // work.width] / (seg.b - seg.a)
    before, after = work.at_ends[0][:, 1, left], work.at_ends[0][:, 0, right]
    steps = np.abs(after - before) > DISCONTINUITY * (mean[:, left] + mean[:, right])
    mapped = seg.kind != LINEAR
    return bool((steps | mapped[left] | mapped[right]).any())


def _move_as_one(work: PanelBatch, whole: Pieces, left: Ints, right: Ints, jump: Array) -> bool:
    """Whether all cuts between two segments move in one way, but for what is next to nothing for the jump (m, P) there
    and counts as its error: an edge that leans by some doubles moves by as little at its other end."""
    seg = work.seg
    t, error = (part.reshape(work.width, -1, seg.a.size)[:, 1 : 1 + work.k] for part in (whole.integral, whole.error))
    for number, (i, j) in enumerate(zip(left, right, strict=True)):
        speeds = np.concatenate((seg.tb[:, i:j], seg.ta[:, i + 1 : j]), axis=1) - seg.ta[:, j, None]
        lost = np.abs(jump[:, number, None]) * np.abs(speeds).max(axis=1)
        if not (lost <= HARMLESS * np.abs(t[:, :, seg.owner == seg.owner[j]]).sum(axis=-1)).all():
            return False
        error[:, :, j] += lost
    return True


def _neighbours(seg: Segments) -> tuple[Ints, Ints]:
    """The segments between which nothing lies but kinks, and what is too narrow to tell them apart."""
    width = seg.b - seg.a
    wide = np.nonzero(width > SLIM * np.abs(seg.b))[0]
    expected = np.ones(width.size, dtype=bool)
    expected[1:] = (seg.owner[1:] != seg.owner[:-1]) | (seg.a[1:] != seg.b[:-1]) | (seg.rank[1:] != 1)
    stretch = np.cumsum(expected)
    together = np.nonzero(stretch[wide[1:]] == stretch[wide[:-1]])[0]
    return wide[together], wide[together + 1]


def beneath(scene: IteratedVariable, cuts: Cuts) -> None:
    """Whether a surface runs along what is further in just where one of this variable is, and moves otherwise: in
    another order of the variables both have sections."""
    seg = cuts.segments
    inner = np.zeros(seg.a.size, dtype=bool)
    inner[1:] = (seg.owner[1:] == seg.owner[:-1]) & (seg.a[1:] == seg.b[:-1]) & (seg.rank[1:] > 1)
    places = np.nonzero(inner & scene.counted(seg.owner))[0]
    if not places.size:
        return
    owner = seg.owner[places]
    members = distinct(owner[running(scene, owner, seg.a[places], seg.ea[places]) > 0])
    if members.size:
        scene.machine.note(Degenerate(scene.level.variable), scene.below(members))


def brush(scene: IteratedVariable, cuts: Cuts) -> None:
    """Whether what is further in jumps at a bound on which it should only bend: a surface runs along the bound.

    Looked at on both sides of the bound, with the surfaces of this variable as they are inside.
    """
    for upper in (False, True):
        found = [edge for edge in cuts.brushes if edge.upper == upper]
        if not found:
            continue
        owner, first = np.unique(np.concatenate([edge.owner for edge in found]), return_index=True)
        x = np.concatenate([edge.x for edge in found])[first]
        counts = scene.counted(owner)
        owner, x = owner[counts], x[counts]
        if not owner.size or _bends(scene, owner, x, upper):
            continue
        _, (inner,) = around(scene.level, owner, x, (not upper,), scene.env, scene.sides, scene.machine)
        many = 2 * len(BESIDE)
        sides: dict[int, Mask] = {g: np.tile(np.broadcast_to(m, owner.shape), many) for g, m in inner.items()}
        values = _inside(scene, owner, beside(x), sides)
        if (there := jumps(values)).any():
            scene.machine.note(Degenerate(scene.level.variable), scene.below(owner[there]))


def _inside(scene: IteratedVariable, owner: Ints, x: Array, sides: dict[int, Mask]) -> Array:
    """What is further in at several places for each of some members, (m, places, members)."""
    many = np.tile(owner, x.size // owner.size)
    values, _ = scene.inside(many, placed(scene.level, many, x, scene.env), sides)
    return values.reshape(values.shape[0], -1, owner.size)


def beside(x: Array) -> Array:
    """Places above and below each of some, then such that are nearer, one after the other."""
    aside = np.array(BESIDE)[:, None] * (1 + np.abs(x))
    return np.concatenate([x + sign * a for a in aside for sign in (1.0, -1.0)])


def jumps(values: Array) -> Bools:
    """At which of n places something jumps that has these values, (m, places, n), where `beside` looks."""
    above, below = values[:, 0::2], values[:, 1::2]
    return _does_jump(np.abs(above - below), np.abs(above[:, 1]) + np.abs(below[:, 1]))


def _does_jump(steps: Array, size: Array) -> Bools:
    """Where values on the two sides of a place differ, and no less so nearer to it: what bends would shrink."""
    far, near = steps[:, 0], steps[:, 1]
    return np.asarray(((near > 0.5 * far) & (near > DISCONTINUITY * size)).any(axis=0))


def _bends(scene: IteratedVariable, owner: Ints, x: Array, upper: bool) -> bool:
    """Whether it is plain that no surface runs along the bound: all sections in the innermost variable are slow."""
    levels, frozen = scene.parent.plan.levels, scene.machine.with_directions(0)
    further = levels[scene.number + 1]
    if scene.number + 2 < len(levels) or further.searched:
        return False
    aside = BESIDE[1] * (1 + np.abs(x)) * (-1 if upper else 1)
    places = (placed(scene.level, owner, place, scene.env) for place in (x, x + aside))
    for row, beside in zip(*(numbers_at(further.frame, frozen, at) for at in places), strict=True):
        with np.errstate(invalid="ignore"):
            slow = np.abs(row.v - beside.v) <= SLOW * (1 + np.abs(row.v))
        if not np.all(slow):
            return False
    return True
