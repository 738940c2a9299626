"""Derivatives that are not the same on the two sides of the parameters.

Owns `on_both_sides`, `at_folds`, `beside_folds`, `beside_axes` and `beside`. What surfaces on
bounds and on one another contribute is known on either side (`integrate/degenerate/coincidences`). Where sections of a
surface appear or merge just at the parameters they move infinitely fast, and nothing at this place tells the
derivative: of [x^2 < t] at t = 0 it is 0 on one side and infinite on the other, of [x^2 + y^2 < t] 0 and pi. It is then
looked at beside the parameters, in three steps towards them; and so it is where surfaces run along every variable, and
have sections along none.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from msgspec.structs import replace

from potto.core.terms import Integral
from potto.integrate.decomposition.cuts import frame_rows
from potto.integrate.decomposition.meetings import Row
from potto.integrate.decomposition.sections import searched_rows
from potto.integrate.events import (
    BOUNDLESS,
    INNER,
    Degenerate,
    Events,
    OneSidedDerivatives,
    Shortfall,
    Spot,
    SurfaceFold,
    TwoSided,
)
from potto.integrate.pieces import Sums, gather, still
from potto.integrate.plan import Plan
from potto.kernels.cells import Array, Bools, Cell, Ints, map_cells, pad
from potto.runtime.evaluation.derivatives.beside import (
    APART,
    NEARER,
    SAME,
    Parts,
    approached,
    led_to,
    moved,
    moving,
    parameter_step,
)
from potto.runtime.integration.methods.attempts import accurate
from potto.runtime.integration.methods.choices import orders
from potto.runtime.integration.methods.quadrature import iterated
from potto.runtime.integration.problem import Mixed, Problem

# The parameters' steps that are tried, and how far apart what folds may be after one, as a part of the range.
STEPS = 2.0 ** np.arange(-1000.0, 1001.0, 4.0)
# What is nearer to a fold than this lies at it, as far as steps that parameters notice can tell.
TOGETHER = 1e-9
# The part of a derivative, or how many errors of the value, its error may be that no other order is tried.
ROUGH, ROUNDED = 1e-9, 1e4
GAP = 1e-8  # the part of a derivative from which on it is worth a look whether it has two sides that rounding hides
MOST_MEMBERS = 16  # of a batch that are looked at together
# Which of the places looked at, direction, the derivatives before and behind the parameters, of all components,
# and how far off each may be.
Sides = tuple[int, int, Array, Array, tuple[Array, Array]]


def on_both_sides(problem: Problem, order: Integral, sums: Sums) -> Sums:
    """Note the one-sided derivatives of an integral in which a part has two; where the whole has one, that is it."""
    causes, machine = problem.events.every(TwoSided), problem.machine
    if not causes or machine.side:
        return sums
    problem.events.forget(TwoSided)
    if all(cause.hidden for cause, _ in causes) and accurate(sums, max(GAP, machine.rtol), machine):
        return sums  # what hardly counts, as at a few nodes of a variable further out
    sides = _either_side(problem, order)
    backward, forward = (np.where(np.isfinite(part.et), part.t, np.nan) for part in sides)
    before, beyond = (np.where(np.isfinite(part.et), part.et, 0.0) for part in sides)
    same = np.abs(forward - backward) <= 1e-12 * (np.abs(forward) + np.abs(backward))
    differ = np.nonzero(~same.all(axis=(0, 1)))[0]
    for cause, members in causes:
        there = differ if members is None else np.intersect1d(differ, members)
        if there.size:
            sided = (x[..., there] for x in (backward, forward, before, beyond))
            machine.note(OneSidedDerivatives(cause, *sided), there)
    t, et, off = sums.t, sums.et, np.maximum(before, beyond)
    # With few evaluations left the sides may be known less well than what they agree with.
    one = same & ((off < et) | ~(np.abs(t - forward) <= et + off))
    t, et = np.where(one, forward, t), np.where(one, off, et)
    nearer = np.where(np.abs(t - forward) <= np.abs(t - backward), forward, backward)
    better = np.isfinite(backward) & np.isfinite(forward) & (off < et) & (np.abs(t - nearer) <= et)
    t, et = np.where(better, nearer, t), np.where(better, off, et)
    return replace(sums, t=t, et=et)


def _either_side(problem: Problem, order: Integral) -> list[Sums]:
    """The derivatives to both sides, backward and forward. Where surfaces are steep in the variable that is innermost
    rounding leaves them few digits, so other orders of the variables are tried.

    Backward is forward in the opposite direction, so that both are found at once.
    """
    k = problem.machine.directions
    ahead = problem.machine.with_directions(2 * k).changed(side=1)
    env = {name: map_cells(pad(value, k), _both_ways) for name, value in problem.env.items()}

    def found_in(own: Integral) -> tuple[list[Sums], Events]:
        both = problem.at(env, machine=ahead.apart())
        found = iterated(both.plan(own), both.machine, both.env, both.batch)
        halves = ((0.0 - found.t[:, k:], found.et[:, k:]), (found.t[:, :k], found.et[:, :k]))
        return [Sums(found.v, found.e, *half) for half in halves], both.events

    sides, _ = found_in(order)
    for other in itertools.islice(orders(order), 1, None):
        if all(map(_sharp, sides)) or ahead.exhausted():
            break
        parts, events = found_in(other)
        if not events.touched(problem.batch).any():
            sides = [part if (part.et <= own.et).all() else own for own, part in zip(sides, parts, strict=True)]
    return sides


def _sharp(sums: Sums) -> bool:
    return bool((sums.et <= ROUGH * np.abs(sums.t) + ROUNDED * sums.e[:, None]).all())


def _both_ways(cell: Cell) -> Cell:
    """A number as it moves in each direction, and in each opposite one."""
    return Cell(cell.v, cell.e, (*cell.t, *(None if t is None else -t for t in cell.t)), (*cell.et, *cell.et))


def at_folds(problem: Problem, order: Integral, sums: Sums) -> Sums:
    """With the derivatives where sections appear or merge just at the parameters."""
    if problem.events.every(SurfaceFold):
        beside_folds(problem, problem.plan(order), sums)
    return sums


def beside_folds(problem: Problem, plan: Plan, sums: Sums) -> None:
    """Put the one-sided derivatives of integrals at whose parameters a surface folds in their place, or note both.

    What was noted of other surfaces lacks what folds.
    """
    machine, events = problem.machine, problem.events
    met = [
        (fold.cause, member, fold.spot(i))
        for fold, who in events.every(SurfaceFold)
        for i, member in enumerate(range(problem.batch) if who is None else who.tolist())
    ]
    places = [(member, spot) for _, member, spot in met]
    for number, d, backward, forward, off in list(_sides(problem, plan, places, sums)):
        cause, member, _ = met[number]
        t, et = sums.t[:, d, member], sums.et[:, d, member]
        for edge, who in events.every(OneSidedDerivatives):
            own = np.arange(problem.batch) if who is None else who
            for side, one in zip(edge.sides, (backward, forward, *off), strict=True):
                if np.shape(side) == (*sums.t.shape[:2], own.size):
                    side[:, d, own == member] = one[:, None]
        if machine.side:
            t[:], et[:] = _of_side(machine.side, backward, forward, off)
            continue
        both = off[0] + off[1]
        if _same(backward, forward, both) and np.isfinite(forward).all():
            known = np.isfinite(t) & (np.abs(t - forward) <= SAME * np.abs(forward) + et + both)
            t[:], et[:] = np.where(known, t, forward), np.where(known, et, both)
            continue
        known = np.isfinite(t) & np.isfinite(et)
        t[:] = np.where(known, t, np.where(np.isfinite(backward), backward, forward))
        et[:] = np.where(known, et, np.where(np.isfinite(t), np.where(np.isfinite(backward), *off), np.inf))
        _endless(problem, member, backward, forward, t, et)
        _note(problem, member, OneSidedDerivatives(cause, backward, forward, *off))
    events.forget(SurfaceFold)


def _note(problem: Problem, member: int, event: OneSidedDerivatives | Shortfall) -> None:
    """Note what a member has met; its derivatives as those of a batch of one."""
    if problem.batch == 1:
        return problem.machine.note(event)
    if isinstance(event, OneSidedDerivatives):
        event = OneSidedDerivatives(event.cause, *(side[..., None] for side in event.sides))
    return problem.machine.note(event, np.array([member]))


def beside_axes(problem: Problem, plan: Plan, sums: Sums, variable: str) -> bool:
    """The same where surfaces run along `variable`, and every other one. Whether all derivatives are known then."""
    machine, batch = problem.machine, problem.batch
    if batch > MOST_MEMBERS or machine.overdrawn():
        return False
    problem.events.forget(Degenerate)
    found = list(_sides(problem, plan, [(member, None) for member in range(batch)], sums))
    resting = sum(not any(moving(v, d) for v in problem.env.values()) for d in range(machine.directions))
    if len(found) + batch * resting < batch * machine.directions:
        return False
    for member, d, backward, forward, off in found:
        t, et = sums.t[:, d, member], sums.et[:, d, member]
        if np.isnan(backward).any() or np.isnan(forward).any():
            return False
        if machine.side:
            t[:], et[:] = _of_side(machine.side, backward, forward, off)
        elif _same(backward, forward, off[0] + off[1]) and np.isfinite(forward).all():
            t[:], et[:] = 0.5 * (backward + forward), np.abs(forward - backward) + off[0] + off[1]
        else:
            et[:] = np.abs(t)
            _endless(problem, member, backward, forward, t, et)
            _note(problem, member, OneSidedDerivatives(TwoSided(variable), backward, forward, *off))
    return True


def _of_side(side: int, backward: Array, forward: Array, off: tuple[Array, Array]) -> tuple[Array, Array]:
    """The derivative to a side, with its error."""
    t, et = (forward, off[1]) if side > 0 else (backward, off[0])
    return t, np.where(np.isfinite(t), et, np.inf)


def _endless(problem: Problem, member: int, backward: Array, forward: Array, t: Array, et: Array) -> None:
    """Put the infinity that is the derivative on both sides."""
    both = np.isinf(forward) & (forward == backward)
    t[:], et[:] = np.where(both, forward, t), np.where(both, np.inf, et)
    if both.any():
        _note(problem, member, BOUNDLESS)


def _same(backward: Array, forward: Array, off: Array) -> bool:
    size = np.maximum(np.abs(backward), np.abs(forward))
    with np.errstate(invalid="ignore"):
        near = np.abs(backward - forward) <= np.where(size < np.inf, SAME * size + off, 0.0)
    return bool((near | (backward == forward)).all())


def _sides(
    problem: Problem, plan: Plan, places: Sequence[tuple[int, Spot | None]], sums: Sums
) -> Iterator[Sides]:  # fmt: skip
    """What is known of members, and where they are, in each direction in which anything moves; all that is looked at
    along one direction is a batch."""
    both = np.concatenate((-NEARER, NEARER))
    for start in range(0, len(places), MOST_MEMBERS):
        some = range(start, min(start + MOST_MEMBERS, len(places)))
        alone = {places[i][0]: problem.member(places[i][0]) for i in some}
        for d in range(problem.machine.directions):
            steps = {i: step for i in some if (step := _step(alone[places[i][0]], plan, d, places[i][1])) is not None}
            if not steps:
                continue
            members = np.repeat([places[i][0] for i in steps], both.size)
            looks = iter(_at_each(problem, d, members, np.outer(list(steps.values()), both).ravel()))
            for i, step in steps.items():
                here = sums.pick(np.array([places[i][0]]))
                backward, forward = (
                    led_to([_parts(next(looks), here, d) for _ in NEARER], (here.v, here.e), sign * step * NEARER[-1])
                    for sign in (-1.0, 1.0)
                )
                yield i, d, backward[0][:, 0], forward[0][:, 0], (backward[1][:, 0], forward[1][:, 0])


def _at_each(problem: Problem, d: int, members: Ints, steps: Array) -> list[Sums | None]:
    """These members after these steps: together, and those of which nothing is known so by themselves."""
    found: list[Sums | None] = [None] * steps.size
    if not problem.machine.overdrawn():
        with suppress(Mixed):
            here = gather(problem.env, members) if problem.batch > 1 else problem.env
            whole = problem.beside({n: moved(v, steps, d) for n, v in here.items()}, steps.size)
            known: Bools = np.logical_and.reduce(np.isfinite(np.concatenate((whole.e, *whole.et))))
            found = [whole.pick(np.array([i])) if known[i] else None for i in range(steps.size)]
    left = (
        _after(problem.member(int(member)), d, float(h)) if look is None else look
        for look, member, h in zip(found, members, steps, strict=True)
    )
    return list(left)


def _after(problem: Problem, d: int, step: float) -> Sums | None:
    """What there is after a step; None where far more than the budget is spent: each look costs some nodes."""
    if problem.machine.overdrawn():
        return None
    return problem.beside({n: moved(v, step, d) for n, v in problem.env.items()})


def beside(problem: Problem, d: int, step: float, here: Sums, rtol: float | None = None) -> tuple[Array, Array]:
    """The derivatives on the side of the parameters on which a step is, and how far off they may be, (m, B) each.

    here: what there is at the parameters. Where the values beside them lead to another one it is infinite. rtol: see
    `approached`. Not known where far more than the budget is spent: each look costs some nodes whatever is left.
    """

    def at(h: float) -> Parts:
        return _parts(_after(problem, d, h), here, d)

    return approached(at, step, (here.v, here.e), rtol)


def _parts(found: Sums | None, here: Sums, d: int) -> Parts:
    """The values and the derivatives in a direction; not known where nothing was found."""
    if found is None:
        unknown, slope = np.full_like(here.v, np.nan), np.full_like(here.t[:, d], np.nan)
        return unknown, np.full_like(here.e, np.inf), slope, np.full_like(here.et[:, d], np.inf)
    return found.v, found.e, found.t[:, d], found.et[:, d]


def _step(problem: Problem, plan: Plan, d: int, where: Spot | None) -> float | None:
    """The largest step that moves the roots that fold, or all roots, by a small part of the range, either way.

    Where nobody knows the roots, since an integral further in has them or they have no closed form, a small part of the
    parameters.
    """
    env, quiet = problem.env, problem.machine.with_directions(0)
    if where is not None and (where.number == INNER or _searched(plan, where)):
        return parameter_step(env.values(), d)
    both = np.concatenate(([0.0], STEPS, -STEPS))
    here = {n: still(moved(v, both, d)) for n, v in env.items()}
    size = both.size
    outer = () if where is None else where.outer
    fits, moves = np.ones(STEPS.size, dtype=bool), np.zeros(STEPS.size, dtype=bool)
    for number, level in enumerate(plan.levels[: None if where is None else 1 + where.number]):
        lo, hi, rows = frame_rows(level, quiet, here)
        rows += searched_rows(replace(level, searched=()), here, lo, hi, size, quiet)
        low, high = (np.broadcast_to(np.nan_to_num(end.v, posinf=1e300, neginf=-1e300), (size,)) for end in (lo, hi))
        here[level.variable] = Cell(np.full(size, outer[number]) if number < len(outer) else 0.5 * low + 0.5 * high)
        if where is None or number == where.number:
            off = _off(rows, low, high, where)
            fits &= (off <= APART * _room(low, high, rows, where))[1:].reshape(2, -1).all(axis=0)
            moves |= (off > 0)[1:].reshape(2, -1).any(axis=0)
    fits = np.logical_and.accumulate(fits) & moves
    return float(STEPS[np.nonzero(fits)[0][-1]]) if fits.any() else None


def _off(rows: Sequence[Row], low: Array, high: Array, where: Spot | None) -> Array:
    """How far each step moves those roots of a variable that fold, or all in its range."""
    off = np.zeros(low.size)
    for row in rows:
        if where is None or row.cut == where.cut:
            x = np.broadcast_to(row.x, low.shape)
            if where is None:
                x = _once_within(x, low, high)
            start = x[0] if np.isfinite(x[0]) else _near(x) if where is None else where.place
            off = np.fmax(off, np.abs(x - start))
    return off


def _searched(plan: Plan, where: Spot) -> bool:
    level = plan.levels[where.number]
    return level.level.cuts[where.cut] in level.searched


def _room(low: Array, high: Array, rows: Sequence[Row], where: Spot | None) -> Array:
    """How far it is from one end of the range to the other, or from what folds to what else lies in it."""
    reach = np.abs(high - low)
    place = 0.0 if where is None else where.place
    room = np.where((reach < 1e300) & (reach[0] > 0), reach, 1.0 + abs(place))
    if where is None:
        return room
    others = [low, high, *(row.x for row in rows)]
    gaps = [abs(float(np.broadcast_to(x, reach.shape)[0]) - place) for x in others]
    near = [gap for gap in gaps if gap > TOGETHER * (1.0 + abs(place))]
    return np.minimum(room, min(near, default=np.inf))


def _once_within(x: Array, low: Array, high: Array) -> Array:
    """Where a root is after the steps after which it is in the range, and those beyond; nan after those before."""
    inside = (x >= np.minimum(low, high)) & (x <= np.maximum(low, high))
    after = np.logical_or.accumulate(inside[1:].reshape(2, -1), axis=1).ravel() | inside[0]
    return np.where(np.concatenate((inside[:1], after)), x, np.nan)


def _near(x: Array) -> Array:
    """Where a root is after the least of the steps after which there is one, in either direction."""
    found = [x[1 + i * STEPS.size + there.argmax()] for i, there in enumerate(~np.isnan(x[1:]).reshape(2, -1))]
    return np.concatenate(([np.nan], *(np.full(STEPS.size, place) for place in found)))
