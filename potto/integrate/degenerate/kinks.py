"""Kinks and surfaces that lie all along a stretch of the domain: |x*t|, or [x*t <= 0], at t = 0, max(x + t*y, x).

Owns `lying_along`, `on_bounds` and `note_flat`. There is no place to cut at. Where such a kink moves, the integrand has
two derivatives throughout the stretch; where such a surface does, the stretch is on one of its sides, or cut, at once.
"""

from __future__ import annotations

import numpy as np

from potto.core.terms import Term, function_of
from potto.integrate.degenerate.scene import CLEAR, IteratedVariable
from potto.integrate.degenerate.undefined import LOOKED_AT
from potto.integrate.events import Along
from potto.integrate.pieces import Evaluator, components, gather, numbers_at, still
from potto.integrate.plan import Plan
from potto.integrate.rules import substitution
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Cell, Ints, Value, pad

# At how many places each of a few members is looked at, and each of many: what takes up less of the domain is missed.
PLACES, FEW_PLACES, MANY = 16, 4, 64
# Multiples of these, modulo 1, fill a box evenly: the powers of the root of z^4 = z + 1, as Kronecker's sequences have.
STEPS = 1.2207440846057596 ** -np.arange(1.0, 9.0)


def lying_along(plan: Plan, env: dict[str, Value], batch: int, machine: Evaluator) -> list[tuple[int, Ints]]:
    """The numbers of the kinks of a plan that are 0 at places of the domain which no program would choose, and move
    there; with the members for which they do."""
    owner, quiet = _owners(batch), machine.apart().tracking()
    here = _places(plan, env, owner, batch, quiet)
    met = []
    for number, kink in enumerate(components(quiet.evaluate(plan.kinks, here, None))):
        members = _resting_at_0(kink, owner)
        if members.size:
            met.append((number, members))
    return met


def on_bounds(plan: Plan, env: dict[str, Value], batch: int, machine: Evaluator) -> list[tuple[Along, Ints]]:
    """The surfaces that lie all along a bound of a variable, and move there otherwise than it does; with the members
    for which they do."""
    owner, quiet = _owners(batch), machine.apart().tracking()
    jumps = [group.cut.surface for group in plan.groups]
    met: dict[tuple[str, Term], Bools] = {}
    for number, level in enumerate(plan.levels):
        along = [surface for surface in jumps if level.variable in surface.free]
        for upper in (False, True) if along else ():
            here = _places(plan, env, owner, batch, quiet, (number, upper))
            for surface in along:
                value = quiet.evaluate(function_of(surface), here, None)
                members = _resting_at_0(value, owner) if isinstance(value, Cell) else owner[:0]
                there = met.setdefault((level.variable, surface), np.zeros(batch, dtype=bool))
                there[members] = True
    return [(Along(*where, bound=True), np.nonzero(there)[0]) for where, there in met.items() if there.any()]


def _owners(batch: int) -> Ints:
    """Whose places are looked at: several of each member."""
    return np.repeat(np.arange(batch), PLACES if batch <= MANY else FEW_PLACES)


def _places(
    plan: Plan, env: dict[str, Value], owner: Ints, batch: int, machine: Evaluator, at: tuple[int, bool] | None = None
) -> dict[str, Value]:
    """Places of the domain which no program would choose; or at the lower or upper bound of a variable, by its number,
    and so moving with it."""
    here = gather({name: pad(value, machine.directions) for name, value in env.items()}, owner) if batch > 1 else env
    for number, level in enumerate(plan.levels):
        if at is not None and number == at[0]:
            ends = numbers_at(level.bounds, machine, here)
            here = {**here, level.variable: pad(ends[at[1]], machine.directions)}
            continue
        resting = {n: still(here[n]) for n in level.bounds.params}
        ends = numbers_at(level.bounds, machine, resting)
        lo, hi = (np.broadcast_to(end.v, owner.shape) for end in ends)
        part = (0.5 + np.arange(1, owner.size // batch + 1) * STEPS[number % STEPS.size]) % 1.0
        x = _between(lo, hi, np.tile(part, batch))
        here = {**here, level.variable: Cell(x, None, (None,) * machine.directions)}
    return here


def _resting_at_0(value: Cell, owner: Ints) -> Ints:
    """The members at one of whose places a number is 0 to rounding, and moves. At infinite bounds it may be infinite,
    with an error that is so, too."""
    there = np.isfinite(value.v) & (np.abs(value.v) <= CLEAR * (0.0 if value.e is None else value.e))
    there = there & _moves(value, owner.size)
    return np.unique(owner[np.broadcast_to(there, owner.shape)])


def note_flat(scene: IteratedVariable, seg: Segments, flat: dict[int, Bools]) -> None:
    """Say which surfaces lie all along segments, and move there. flat: by group, the segments on which it is 0 wherever
    it was looked at."""
    level, machine = scene.level, scene.machine
    index = np.nonzero(np.any(list(flat.values()), axis=0))[0]
    owner = seg.owner[index]
    env = gather({n: scene.env[n] for n in level.surfaces.params if n in scene.env}, owner)
    moves = np.zeros((len(level.decided), owner.size), dtype=bool)
    for share in LOOKED_AT:
        x, _, _ = substitution.points(seg.pick(index), np.full((index.size, 1), share))
        here = {n: pad(v, machine.directions) for n, v in {**env, level.variable: Cell(x[:, 0])}.items()}
        values = numbers_at(level.surfaces, machine.tracking(), here)
        moves |= np.stack([_moves(value, owner.size) for value in values])
    for group, along in zip(level.decided, moves, strict=True):
        there = owner[along & flat[group][index]] if group in flat else owner[:0]
        there = there[scene.counted(there)]
        if there.size:
            surface = scene.parent.plan.groups[group].cut.surface
            machine.note(Along(level.variable, surface), scene.below(there))


def _moves(value: Cell, count: int) -> Bools:
    """Where a number moves in any direction, by more than rounding."""
    moves = np.zeros(count, dtype=bool)
    for t, et in zip(value.t, value.et or (None,) * len(value.t), strict=True):
        if t is not None:
            moves |= np.abs(t) > CLEAR * (0.0 if et is None else et)
    return moves


def _between(lo: Array, hi: Array, part: Array) -> Array:
    """Places between bounds, which may be infinite."""
    wide = part / (1 - part)
    with np.errstate(invalid="ignore"):
        plain = lo + part * (hi - lo)
    both = np.isinf(lo) & np.isinf(hi)
    x = np.where(np.isinf(hi), lo + wide, np.where(np.isinf(lo), hi - wide, plain))
    return np.asarray(np.where(both, np.log(wide), x))
