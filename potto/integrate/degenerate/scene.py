"""One variable of an iteration as it is being integrated, and its integrand at places beside where it is cut.

Owns `IteratedVariable`, and what is there `around` a place: its environment, and the sides of all surfaces.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import nullcontext

import numpy as np
from msgspec import Struct

from potto.core.terms import Term
from potto.integrate.decomposition.meetings import as_array
from potto.integrate.levels import LevelPlan
from potto.integrate.panels.iterated import Iterated
from potto.integrate.pieces import Evaluator, gather, mostly, numbers_at, still, take
from potto.integrate.rules.gauss import EPS
from potto.kernels.cells import Array, Bools, Cell, Ints, Mask, Value, pad

# Beside a place, in its own size: where surfaces that are 0 at it, to so many times their rounding, have a side.
BESIDE, CLEAR = 1e-7, 4.0
# Where the limit of an integrand without a value at a bound is read off, as parts of the place; what is no difference
# of such values, and what a power falls by at the least from one to the next.
NEARER, RESTS, FALLS = (2.0**-30, 2.0**-40, 2.0**-50), 1e-7, 0.9

Pair = tuple[Array, Array]


class IteratedVariable(Struct, frozen=True):
    """One variable of an iteration as it is being integrated: everything that is needed to evaluate its integrand.

    slack: as `Iteration.run` takes it."""

    parent: Iterated
    number: int
    level: LevelPlan
    env: dict[str, Value]
    sides: dict[int, Mask]
    machine: Evaluator
    batch: int = 1
    root: Ints | None = None
    slack: Array | None = None

    def below(self, owner: Ints) -> Ints | None:
        """The members of the outermost batch that some of this one belong to; None if there is but one."""
        if self.number == 0:
            return owner if self.batch > 1 else None
        return None if self.root is None else self.root[owner]

    def counted(self, owner: Ints) -> Bools:
        """Which of a batch count: not single nodes of the variables further out."""
        return np.isin(owner, mostly(owner, self.root, self.batch)) if self.number else np.ones(owner.size, dtype=bool)

    def flips(
        self, cuts: Sequence[int], owner: Ints, x: Array, above: bool, turned: Bools, room: Array | None = None
    ) -> tuple[Array, Array]:
        """F just beside x with some cuts' surfaces flipped, and the errors of that, (..., m, B) each.

        turned: which of the cuts, (..., n, B), or for all members the same, (..., n, 1). The errors are nan where it
        depends on the side of another surface that rounding hides. Two sections of one surface flip it twice, one at
        which it only touches 0 not at all. room: (B,) how far it is to the next cut.
        """
        hidden: dict[int, Bools] = {}
        ways, machine = (above, not above), self.machine
        here, (inner, beyond) = around(self.level, owner, x, ways, self.env, self.sides, machine, room, hidden)
        groups = [group_of(self.level, cut) for cut in cuts]
        rows, which = _apart_from_one_another(turned)
        found = []
        for row in rows:
            both = dict(inner)
            for g in set(groups):
                odd = np.bitwise_xor.reduce([row[i] for i, other in enumerate(groups) if other == g])
                way = np.asarray(beyond[g]) if groups.count(g) == 1 else ~np.asarray(inner[g])
                both[g] = np.where(odd, way, inner[g])
            f, e = self.at_the_end(owner, here, both, above, room)
            for g in hidden.keys() - set(groups):
                other, _ = self.inside(owner, here, {**both, g: np.asarray(both[g]) ^ hidden[g]})
                e = np.where(other == f, e, np.nan)
            found.append((f, e))
        m = max(f.shape[0] for f, _ in found)  # one component stands for all where nothing is integrated
        columns = zip(*found, strict=True)
        values, errors = (np.stack([np.broadcast_to(x, (m, owner.size)) for x in own]) for own in columns)
        at = which.reshape(*turned.shape[:-2], -1), slice(None), np.arange(owner.size)
        return np.moveaxis(values[at], -1, -2), np.moveaxis(errors[at], -1, -2)

    def at_the_end(
        self, owner: Ints, here: dict[str, Value], sides: dict[int, Mask], above: bool, room: Array | None
    ) -> tuple[Array, Array]:
        """F at places on some sides; where it has no value there, as densities may have none at the ends of their
        ranges, what it tends to. room: as above."""
        f, e = self.inside(owner, here, sides)
        lost = np.nonzero((np.isnan(f) | np.isnan(e)).any(axis=0))[0]
        x = here[self.level.variable]
        if room is None or not lost.size or not isinstance(x, Cell):
            return f, e
        at, far = as_array(x.v, owner.size)[lost], np.minimum(room[lost], 1.0)
        some, given = gather(here, lost), take(sides, lost)
        size = np.where(at == 0, far, np.abs(at)) * (1 if above else -1)
        places = [{**some, self.level.variable: Cell(at + size * share)} for share in NEARER]
        found = np.stack([self.inside(owner[lost], place, given)[0] for place in places])
        limits = np.where(np.abs(size) * NEARER[0] < far, _limits(*found), np.nan)
        f, e = (np.array(np.broadcast_to(part, np.broadcast_shapes(part.shape, f.shape))) for part in (f, e))
        f[:, lost], e[:, lost] = limits, 0.0
        return f, e

    def inside(self, owner: Ints, here: dict[str, Value], sides: dict[int, Mask]) -> tuple[Array, Array]:
        """F at places of some members, on the sides given, and its errors, (m, B): a check, for which nothing moves."""
        costs, aside = self.machine.costs, self.machine.looking_aside()
        with nullcontext() if costs is None else costs.apart():
            return self.parent.inside(self.number, here, owner.size, sides, aside, self.below(owner))

    def as_it_falls(self, owner: Ints, x: Array) -> Array:
        """F at x itself, (m, B): a surface that is 0 there is on the side that its comparison says."""
        here, sides = placed(self.level, owner, x, self.env), take(self.sides, owner)
        if self.level.decided:
            groups = self.parent.plan.groups
            values, _ = surfaces_at(self.level, here, owner.size, self.machine)
            up = [v >= 0 if groups[g].up_at_zero else v > 0 for g, v in zip(self.level.decided, values, strict=True)]
            sides = decided(self.level, sides, up)
        return self.inside(owner, here, sides)[0]

    def surface(self, cut: int) -> Term:
        return self.level.level.cuts[cut].surface


def _limits(far: Array, nearer: Array, nearest: Array) -> Array:
    """What three values tend to: where they hardly change, or go to 0 like a power or faster; else nan."""
    with np.errstate(all="ignore"):
        rests = np.abs(nearest - nearer) <= RESTS * np.abs(nearest)
        first, second = np.abs(nearer / far), np.abs(nearest / nearer)
        falls = (nearest == 0) | ((second <= FALLS) & (second <= (1 + RESTS) * first))
    return np.where(rests, nearest, np.where(falls, 0.0, np.nan))


def _apart_from_one_another(turned: Bools) -> tuple[Bools, Ints]:
    """Of all that may be flipped, (..., n, B), what is not the same for all members, (R, n, B), and which that is for
    each of them; or all there can be, if these are less."""
    flat = turned.reshape(math.prod(turned.shape[:-2]), *turned.shape[-2:])
    rows, which = np.unique(flat, axis=0, return_inverse=True)
    count = flat.shape[1]
    if len(rows) <= 1 << count:
        return rows, which[:, None]
    return all_subsets(count), np.sum(flat << np.arange(count)[:, None], axis=1)


def around(
    level: LevelPlan, owner: Ints, x: Array, ways: Sequence[bool], env: dict[str, Value], sides: dict[int, Mask],
    machine: Evaluator, room: Array | None = None, hidden: dict[int, Bools] | None = None,
) -> tuple[dict[str, Value], list[dict[int, Mask]]]:  # fmt: skip
    """The environment of some members at x, and the sides of all surfaces beside it, for each of the ways: just above
    it, or just below.

    room: how far it is to where they change. hidden: takes, by group, for whom rounding hides the side that is asked
    for first.
    """
    here, inner = placed(level, owner, x, env), take(sides, owner)
    if not level.decided:
        return here, [inner for _ in ways]
    size = 1 + np.abs(x)
    reach = BESIDE * size if room is None else np.minimum(BESIDE * size, 0.5 * room)
    # The part of how they change up to there that the rounding of the place itself comes to.
    misplaced = CLEAR * EPS * size / reach

    def at(place: Array) -> Array:
        there = {**here, level.variable: Cell(place, None, (1.0,))}
        return _with_slopes(level, there, owner.size, machine.with_directions(1))

    on, beside = at(x), list[dict[int, Mask]]()
    for way, step in enumerate(reach if above else -reach for above in ways):
        up = []
        for group, (v, e, slope), (w, off, _) in zip(level.decided, on, at(x + step), strict=True):
            unseen = (e > 0) & (np.abs(v) <= CLEAR * e) & (np.abs(w) <= CLEAR * off)
            if hidden is not None and way == 0 and unseen.any():
                hidden[group] = unseen
            seen = (np.abs(w) > CLEAR * off) | (slope == 0)  # what is steep further out is flat
            there = np.where(seen, w, slope * step)
            up.append(np.where(np.abs(v) > CLEAR * e + misplaced * np.abs(w - v), v, there) >= 0)
        beside.append(decided(level, inner, up))
    return here, beside


def placed(level: LevelPlan, owner: Ints, x: Array, env: dict[str, Value]) -> dict[str, Value]:
    """The environment of some members at x, where nothing moves."""
    here = gather({n: still(v) for n, v in env.items()}, owner)
    here[level.variable] = Cell(x)
    return here


def surfaces_beside(level: LevelPlan, owner: Ints, x: Array, env: dict[str, Value], machine: Evaluator) -> Pair:
    """The surfaces that a level decides the sides of, for some members at x, and their rounding, (G, B) each."""
    here = placed(level, owner, x, {name: value for name, value in env.items() if name in level.surfaces.params})
    return surfaces_at(level, here, owner.size, machine)


def surfaces_at(level: LevelPlan, here: dict[str, Value], count: int, machine: Evaluator) -> Pair:
    """The same in an environment."""
    found = _with_slopes(level, here, count, machine.with_directions(0))
    return found[:, 0], found[:, 1]


def _with_slopes(level: LevelPlan, here: dict[str, Value], count: int, machine: Evaluator) -> Array:
    """Of each surface its values, their rounding, and how they change in the one direction that there may be: (G, 3,
    B)."""
    env = {n: pad(here[n], machine.directions) for n in level.surfaces.params}
    values = numbers_at(level.surfaces, machine.tracking(), env)
    found = np.zeros((len(values), 3, count))
    for own, value in zip(found, values, strict=True):
        own[0] = value.v
        if value.e is not None:
            own[1] = value.e
        if value.t and value.t[0] is not None:
            own[2] = value.t[0]
    return found


def decided(level: LevelPlan, sides: dict[int, Mask], up: Sequence[Bools]) -> dict[int, Mask]:
    """The sides of all surfaces so far, with those of this level as their own terms say."""
    sides = dict(sides)
    for g, side, turned in zip(level.decided, up, level.turned, strict=True):
        for outer in turned:
            side = side ^ np.logical_not(sides[outer])
        sides[g] = side
    return sides


def group_of(level: LevelPlan, cut: int) -> int:
    """The group whose side a cut of the level decides."""
    return level.decided[[i for i, c in enumerate(level.level.cuts) if c.decides].index(cut)]


def all_subsets(count: int) -> Bools:
    """Of n: (2^n, n, 1)."""
    return (np.arange(1 << count)[:, None, None] >> np.arange(count)[:, None] & 1).astype(bool)
