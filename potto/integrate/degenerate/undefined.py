"""Places at which the integrand is not defined, since a condition has no value there.

Owns `sides_at`, `lost_members`, `fallen` and `guarded_samples`. A condition is not defined where a builtin in it is
not: [sqrt(1 + x) < 2] at x = -2. If nothing guards it there, the integral is not a number, and it is told where.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator

import numpy as np

from potto.core.terms import function_of
from potto.integrate.columns import distinct, patterns_of
from potto.integrate.decomposition.vanishing import zero_on
from potto.integrate.degenerate.scene import IteratedVariable, placed, surfaces_beside
from potto.integrate.events import undefined
from potto.integrate.levels import LevelPlan
from potto.integrate.pieces import Evaluator, gather, number_at, still, take
from potto.integrate.plan import Plan
from potto.integrate.rules import substitution
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Bools, Cell, Ints, Mask, Value

# Where a segment is looked at, as parts of it: in the middle, and where that is a pole (of sin(x)/x, say), or the very
# place where a surface touches 0, elsewhere.
LOOKED_AT = (0.5, 0.3, 0.8)


def sides_at(level: LevelPlan, env: dict[str, Value], seg: Segments, machine: Evaluator) -> tuple[Array, Array]:
    """The surfaces that a level decides the sides of, in the middle of segments, and their rounding, (G, S) each.

    They are nan where they are not defined anywhere on the segment.
    """
    found: tuple[Array, Array] | None = None
    for share in LOOKED_AT:
        x, _, _ = substitution.points(seg, np.full((seg.a.size, 1), share))
        now = surfaces_beside(level, seg.owner, x[:, 0], env, machine)
        found = now if found is None else _clearer(found, now)
        if not (np.isnan(found[0]) | (found[0] == 0)).any():
            break
    assert found is not None
    return found


def _clearer(first: tuple[Array, Array], second: tuple[Array, Array]) -> tuple[Array, Array]:
    """The second of two arrays of values with their rounding where the first says nothing."""
    (v, e), (w, off) = first, second
    other = np.isnan(v) | ((v == 0) & ~np.isnan(w))
    return np.where(other, w, v), np.where(other, off, e)


def lost_members(scene: IteratedVariable, seg: Segments, undefined: dict[int, Bools], alive: Ints | None) -> Ints:
    """The members whose integrand is not a number on one of the segments on which a surface is not defined.

    undefined: by group, those segments; alive: the segments that count, None for all. It is told where the first is.
    """
    index = np.nonzero(np.any(list(undefined.values()), axis=0))[0]
    index = index if alive is None else np.intersect1d(index, alive)
    lost: list[Ints] = []
    for pattern, part in patterns_of(np.stack(list(undefined.values())), index):
        gone = [g for g, there in zip(undefined, pattern, strict=True) if there]
        x, _, _ = substitution.points(seg.pick(part), np.full((part.size, 1), LOOKED_AT[0]))
        here = placed(scene.level, seg.owner[part], x[:, 0], scene.env)
        sides = {g: side for g, side in take(scene.sides, seg.owner[part]).items() if g not in gone}
        f, _ = scene.inside(seg.owner[part], here, sides)
        bad = np.nonzero(np.isnan(f).any(axis=0))[0]
        if bad.size:
            lost.append(seg.owner[part[bad]])
            members = scene.below(lost[-1])
            _tell(scene.parent.plan, gone[0], here, int(bad[0]), scene.machine, members)
    return distinct(np.concatenate(lost)) if lost else np.zeros(0, dtype=np.int64)


def fallen(
    plan: Plan, env: dict[str, Value], n: int, machine: Evaluator, groups: Container[int]
) -> Iterator[tuple[int, Bools, Bools]]:
    """The sides on which samples fall of the surfaces of some groups, and where a surface is not defined, (n,) each."""
    for group in plan.groups:
        if group.number in groups:
            function = function_of(group.cut.surface)
            value = number_at(function, machine.with_directions(0), {p: still(env[p]) for p in function.params})
            at = np.broadcast_to(value.v, (n,))
            yield group.number, at >= 0 if group.up_at_zero else at > 0, np.isnan(at)


def guarded_samples(
    plan: Plan, env: dict[str, Value], sides: dict[int, Mask], index: Ints, machine: Evaluator
) -> Bools:
    """Which of some samples whose integrand is not a number count for 0: a factor that is 0 there guards them.

    Of the others it is told where the first is, if it is a condition that has no value there. sides: those forced.
    """
    below = take(sides, index)
    above = dict(below)
    undefined: list[tuple[int, Bools]] = []
    here = gather(env, index)
    free = {group.number for group in plan.groups} - sides.keys()
    for number, side, lost in fallen(plan, here, index.size, machine, free):
        below[number], above[number] = side, side | lost
        undefined.append((number, lost))
    zero = np.broadcast_to(zero_on(plan.vanishing, below) & zero_on(plan.vanishing, above), index.shape)
    for number, lost in undefined:
        if (lost & ~zero).any():
            _tell(plan, number, here, int(np.nonzero(lost & ~zero)[0][0]), machine)
            break
    return zero


def _tell(
    plan: Plan, group: int, env: dict[str, Value], member: int, machine: Evaluator, members: Ints | None = None
) -> None:
    """Note that the surface of a group is not defined at one of the places of an environment.

    At infinity nothing needs to be defined: there is no sample there, and no node of a rule.
    """
    surface = plan.groups[group].cut.surface
    places = []
    for level in plan.levels:
        cell = env.get(level.variable)
        if level.variable in surface.free and isinstance(cell, Cell):
            values = np.ravel(cell.v)
            place = float(values[member % values.size])
            if math.isinf(place):
                return
            places.append(f"{level.variable} = {place:.6g}")
    where = f" at {', '.join(places)}" if places else ""
    machine.note(undefined(where, surface), members)
