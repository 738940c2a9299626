"""Iterated quadrature of a batch by one plan: whole boxes first, the rest cut, so many members at a time.

Owns `in_parts`, `whole_boxes`, `cut_up`, `iterated` and `stretches`. Each loads what it rests on when it first runs:
most integrals of a program are settled before any of them, and these are an eighth of the evaluator.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager
from functools import lru_cache
from itertools import chain
from typing import Any

import numpy as np

from potto.integrate.pieces import Shaped, Sums, Uncut, gather, still
from potto.integrate.plan import Plan
from potto.kernels.cells import Bools, Ints, Value
from potto.runtime.answers.convergence import rounded
from potto.runtime.evaluation.machine import Machine

START_ORDER = 11  # nodes of a panel to begin with
ORDERS = (4, 6, 10, 14, 18)  # those that are tried for a large batch
PILOTS = 64  # members that they are tried on
BATCH = 4096  # members integrated at once
FEW = 64  # members for which it does not pay to look for those that nothing cuts
MOST_AXES = 2  # of a product rule for one member: with 4,096 nodes 14 of each of three, which hardly ever are enough


def in_parts(plan: Plan, machine: Machine, env: dict[str, Value], batch: int) -> Sums:
    """Quadrature: whole boxes first, then what is cut."""
    found = whole_boxes(plan, machine, env, batch)
    if found is None:
        return cut_up(plan, machine, env, batch)[0]
    sums, rest = found.sums, found.rest
    if rest.size:
        apart = machine.apart()
        sums = sums.with_members(rest, cut_up(plan, apart, gather(env, rest), rest.size)[0])
        machine.events.take(apart.events, rest)
    return sums


def whole_boxes(plan: Plan, machine: Machine, env: dict[str, Value], batch: int) -> Uncut | None:
    """The sums of a batch whose boxes nothing cuts, and the members that are left; None where it is not worth a look,
    or nothing came of it."""
    if batch < FEW or plan.box is None:
        return None
    from potto.integrate.fixed.boxes.uncut import uncut

    with one_thread():
        found = uncut(plan.box, machine, env, batch)
    if found is not None and machine.costs is not None:
        machine.costs.whole += batch - found.rest.size
        machine.costs.looked += batch
    return found


def cut_up(
    plan: Plan, machine: Machine, env: dict[str, Value], batch: int, turned: Iterable[Plan] = (), few: int = 0
) -> tuple[Sums, Bools]:  # fmt: skip
    """Quadrature along cuts: what a product rule settles first, then a bounded number of members at a time. With those
    for which rounding leaves less than was asked for by every rule, and along cuts: of these the smallest errors.

    turned: plans with other variables innermost, by which a rule may settle members that it did not, since a surface is
    steep in the one and flat in the other: a look takes 1 ms, along cuts one member takes 5. The first one is tried
    again where they are few: then rounding is followed at every node. few: up to so many that rounding spoils by rules
    are not done along cuts, but left to the caller.
    """
    sums: Sums | None = None
    rest, short = np.arange(batch), np.zeros(batch, dtype=bool)
    for number, own in enumerate(chain((plan,), turned, (plan,))):
        if number and own is plan and not rest.size <= FEW < batch:
            continue
        with one_thread():
            here = env if rest.size == batch else gather(env, rest)
            found = _alike(own, machine, here, rest.size, batch <= FEW)
        if found is None:
            continue
        spoilt = found.short & rounded(found.sums)
        sums = found.sums if sums is None else _with(sums, rest, found.sums, found.done | spoilt, short)
        short[rest] |= spoilt
        short[rest[found.done]] = False
        rest = rest[~found.done]
        if not rest.size:
            return sums, short
    if sums is None:
        return iterated(plan, machine, env, batch), short
    if short.sum() <= few:
        rest = rest[~short[rest]]
        if not rest.size:
            return sums, short
    apart = machine.apart()
    last, known = iterated(plan, apart, gather(env, rest), rest.size), short[rest]
    sums = _with(sums, rest, last, ~(known & apart.events.uncounted(rest.size)), short)
    machine.events.take(apart.events.of(np.flatnonzero(~known)), rest[~known])
    return sums, short


def _with(sums: Sums, members: Ints, part: Sums, good: Bools, short: Bools) -> Sums:
    """The sums with those of some members that are good; of those that have come short before, with the numbers that
    have smaller errors."""
    again = np.flatnonzero(good & short[members])
    if again.size:
        before, own = sums.pick(members[again]), part.pick(again)
        for number, error in (("v", "e"), ("t", "et")):
            keep = getattr(before, error) < getattr(own, error)
            for name in (number, error):
                setattr(own, name, np.where(keep, getattr(before, name), getattr(own, name)))
        part.put(again, own)
    index = np.flatnonzero(good)
    return sums.with_members(members[index], part.pick(index))


def _alike(plan: Plan, machine: Machine, env: dict[str, Value], batch: int, tight: bool) -> Shaped | None:
    """Members with cells that are alike, where all of their cuts are plain; tight: to all digits.

    One by itself is to have more digits there than product rules give over more than two variables.
    """
    if plan.straight is None or any(level.peaks for level in plan.levels):
        return None
    if batch == 1 and len(plan.levels) - sum(d is not None for d in plan.degrees) > MOST_AXES:
        return None
    from potto.integrate.fixed.cells.alike import by_shapes

    return by_shapes(plan.straight, plan.degrees, machine, env, batch, tight)


def iterated(plan: Plan, machine: Machine, env: dict[str, Value], batch: int, start_order: int = START_ORDER) -> Sums:
    """Iterated quadrature with cuts."""
    from potto.integrate.adaptive.iterated import Iteration

    if batch <= BATCH:
        return Iteration(plan, machine, start_order).whole(env, batch)
    with one_thread():
        order = best_order(plan, machine, env, batch)
        parts = []
        for start in range(0, batch, BATCH):
            index = slice(start, min(start + BATCH, batch))
            apart = machine.apart()
            parts.append(Iteration(plan, apart, order).whole(gather(env, index), index.stop - start))
            machine.events.take(apart.events, np.arange(index.start, index.stop))
    return Sums.joined(parts)


def stretches(plan: Plan, machine: Machine, env: dict[str, Value], batch: int) -> int:
    """Into how many stretches the cuts that have closed forms cut the outermost variable of a batch."""
    from potto.integrate.decomposition.cuts import frame_rows, segments

    level = plan.levels[0]
    resting = {name: still(env[name]) for name in level.frame.params}
    rows = frame_rows(level, machine.looking_aside().tracking(), resting)
    return segments(level, *rows, batch, 0, None).segments.a.size


def best_order(plan: Plan, machine: Machine, env: dict[str, Value], batch: int) -> int:
    """The number of nodes to start with that is the cheapest for a few members spread over the batch."""
    from potto.integrate.adaptive.iterated import Iteration

    index = np.linspace(0, batch - 1, PILOTS).astype(np.int64)
    here = gather(env, index)
    costs = []
    for order in ORDERS:
        before = machine.record.evaluations
        apart = machine.apart()
        Iteration(plan, apart, order).run(0, here, PILOTS, {}, apart)
        costs.append(machine.record.evaluations - before)
    return ORDERS[costs.index(min(costs))]


def one_thread() -> AbstractContextManager[object]:
    """Many small products of matrices: threads only get in each other's way."""
    limit: AbstractContextManager[object] = _threads().limit(limits=1, user_api="blas")
    return limit


@lru_cache(maxsize=1)
def _threads() -> Any:
    from threadpoolctl import ThreadpoolController  # ctypes and a look at every library loaded: for batches only

    return ThreadpoolController()
