"""Faces of surfaces that run along all variables further in: what crosses them, integrated over these variables.

Owns `crossing`, `running` and `Face`. Where a surface psi = 0 is a place of one variable x,
whatever the variables y further in are, it has no section in y. Its boundary term is then an integral over y, in which
F stands with the surface on either side and everything else as it falls at the place:

    int (F before - F after) dx/dtheta dy,  dx/dtheta = - psi_theta / psi_x  on psi(x, y) = 0

It is integrated as the tangents of a vector that stands still, by the same rules as everything else.
"""

from __future__ import annotations

from contextlib import nullcontext
from functools import cached_property

import numpy as np
from msgspec import Struct

from potto.core.terms import Lam, Term, children, function_of
from potto.integrate.columns import distinct
from potto.integrate.degenerate.scene import CLEAR, IteratedVariable
from potto.integrate.pieces import Crossing, Evaluator, components, gather, number_at, numbers_at, still, take
from potto.integrate.plan import Plan
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints, Mask, Number, Value, pad

# The part of the stretches beside it up to which a face may be off its place: a tenth of what is allowed for a sum that
# cancels (`convergence.CANCELS`).
THIN = 1e-13
# Where between their bounds the variables further in are looked at: no fractions that programs are likely to have.
FRACTIONS = (0.137, 0.483, 0.829)
# Where beside a place, in its size, the slope of a surface is looked at, and the part of the steepest that it has to be
# at the place: that of x^3 is 0 there, and how the place moves cannot be told from it.
ASIDE, SIMPLE = (0.0, 1e-7, -1e-7), 0.5


class Place(Struct, frozen=True):
    """Places of one variable at which what is further in jumps: whose they are, where, how far off that may be, with
    what speeds (k, P) they were integrated; the sides of the surfaces so far, and the jumps (m, P)."""

    owner: Ints
    x: Array
    off: Array
    speed: Array
    sides: dict[int, Mask]
    jump: Array


class AlongPlaces(Struct, frozen=True):
    """Which surfaces run along the variables further in at some places, and which of them cross 0 there: (G, P)."""

    there: Bools
    simple: Bools


class Face(Struct, frozen=True, dict=True):
    """A face as an integrand: the group of its surface, that surface, the variable it is a place of."""

    group: int
    surface: Term
    variable: str

    @cached_property
    def psi(self) -> Lam:
        return function_of(self.surface)

    def crossed(self, plan: Plan, env: dict[str, Value], sides: dict[int, Mask], machine: Evaluator) -> Value:
        """F before it less F after it; as tangents that times the speeds of the face."""
        k, plain = machine.directions, machine.with_directions(0)
        here = {n: still(env[n]) for n in plan.body.params}
        up, down = (components(plain.evaluate(plan.body, here, plan.trace({**sides, self.group: on})))
                    for on in (True, False))  # fmt: skip
        moving: dict[str, Value] = {n: pad(env[n], k + 1) for n in self.psi.params}
        x = env[self.variable]
        assert isinstance(x, Cell)
        moving[self.variable] = Cell(x.v, x.e, (None,) * k + (1.0,))
        psi = number_at(self.psi, machine.with_directions(k + 1).tracking(), moving)
        slope = np.asarray(psi.t[k])
        rise, blur = np.sign(slope), _size(psi.et[k]) / np.abs(slope)
        speeds = [(0.0 if t is None else -t / slope, _size(et) / np.abs(slope)) for t, et in zip(psi.t[:k], psi.et)]
        cells = []
        for on, off in zip(up, down, strict=True):
            jump, e = rise * (off.v - on.v), _size(on.e) + _size(off.e)
            t = tuple(jump * speed for speed, _ in speeds)
            et = tuple(e * np.abs(s) + np.abs(jump) * (es + blur * np.abs(s)) for s, es in speeds)
            cells.append(Cell(jump, e, t, et))
        return tuple(cells)


def _size(x: Number | None) -> Number:
    return 0.0 if x is None else np.abs(x)


def crossing(scene: IteratedVariable, place: Place, tolerance: Array) -> Crossing | None:
    """What crosses surfaces that run along the variables further in; None where it is not one surface that makes what
    is further in jump."""
    if scene.parent.plan.hides or scene.machine.frozen:
        return None
    along = _running_along(scene, place.owner, place.x, place.off)
    if along is None or not (along.simple | ~along.there).all() or not np.isfinite(place.speed).all():
        return None
    which = _the_only_one(scene, along.there)
    if (which < 0).any():
        return None
    found = Crossing(*np.zeros((4, place.jump.shape[0], scene.machine.directions, scene.batch)))
    for group in distinct(which).tolist():
        here = which == group
        jump, e, t, et = _crossed(scene, place, group, here)
        if not (np.abs(jump - place.jump[:, here]) <= tolerance[:, here] + e).all():
            return None
        speed = place.speed[:, here]
        counted = speed * jump[:, None], np.abs(speed) * e[:, None]
        et = et + THIN * (np.abs(t) + np.abs(counted[0]))
        for into, part in zip((found.t, found.et, found.counted, found.uncertain), (t, et, *counted), strict=True):
            for number, owner in enumerate(place.owner[here]):
                into[:, :, owner] += part[:, :, number]
    return found


def _crossed(scene: IteratedVariable, place: Place, group: int, here: Bools) -> tuple[Array, Array, Array, Array]:
    """What jumps across a face, and that times its speeds, with their errors: (m, P) and (m, k, P)."""
    level = next(level for level in scene.parent.plan.levels if group in level.decided)
    surface = children(level.surfaces.body)[level.decided.index(group)]
    face = Face(group, surface, scene.level.variable)
    owner, machine = place.owner[here], scene.machine
    env = gather(scene.env, owner)
    env[scene.level.variable] = Cell(place.x[here], None, (None,) * machine.directions)
    sides = take(place.sides, np.nonzero(here)[0])
    iteration = scene.parent.across(face)
    with nullcontext() if machine.costs is None else machine.costs.apart():
        sums = iteration.run(scene.number + 1, env, owner.size, sides, machine.standing(), scene.below(owner))
    return sums.v, sums.e, sums.t, sums.et


def running(scene: IteratedVariable, owner: Ints, x: Array, off: Array) -> Ints:
    """How many surfaces run along the variables further in at places of some members, as far as that can be seen."""
    along = _running_along(scene, owner, x, off)
    return np.zeros(owner.size, dtype=np.int64) if along is None else np.asarray(along.there.sum(axis=0))


def _the_only_one(scene: IteratedVariable, along: Bools) -> Ints:
    """Per place the group of the one surface that runs along, -1 if there is none, or several."""
    further = scene.parent.plan.levels[scene.number + 1 :]
    groups = np.array([group for level in further for group in level.decided])
    found: Ints = np.where(along.sum(axis=0) == 1, groups[np.argmax(along, axis=0)], -1)
    return found


def _running_along(scene: IteratedVariable, owner: Ints, x: Array, off: Array) -> AlongPlaces | None:
    """Which of the surfaces further in are 0 at some places, all along the variables further in, (G, P); None where
    that cannot be looked at."""
    further = scene.parent.plan.levels[scene.number + 1 :]
    if not any(level.decided for level in further):
        return None
    quiet = scene.machine.with_directions(1).tracking()
    shape = (len(FRACTIONS), len(ASIDE), x.size)
    there = x + np.array(ASIDE)[:, None] * (1 + np.abs(x))
    many = np.tile(owner, shape[0] * shape[1])
    here = gather({n: pad(still(v), 1) for n, v in scene.env.items()}, many)
    here[scene.level.variable] = Cell(np.tile(there.ravel(), shape[0]), None, (1.0,))
    off = np.where(np.isfinite(off), off, 0.0) + EPS * np.abs(x)
    along, simple = [], []
    for number, level in enumerate(further):  # never on a diagonal, on which y^2 - z^2 is 0
        fraction = np.repeat(np.roll(FRACTIONS, number), there.size)
        lo, hi = (np.broadcast_to(cell.v, many.shape) for cell in numbers_at(level.bounds, quiet, here))
        here[level.variable] = Cell(lo + fraction * (hi - lo), None, (None,))
        if any(level.turned) or not np.isfinite(lo + hi).all():
            return None
        for psi in numbers_at(level.surfaces, quiet, here):
            parts = (np.broadcast_to(_size(part), many.shape) for part in (psi.v, psi.e, psi.t[0]))
            size, e, slope = (part.reshape(shape) for part in parts)
            steepest = slope.max(axis=1)
            near = (size[:, 0] <= CLEAR * (e[:, 0] + steepest * off)) & (steepest > 0)
            along.append(near.all(axis=0))
            simple.append((slope[:, 0] >= SIMPLE * steepest).all(axis=0))
    return AlongPlaces(np.array(along), np.array(simple))
