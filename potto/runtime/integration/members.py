"""A batch of integrals in which each member gets the answer, the cost and the reasons that it gets by itself.

Owns `by_members`, `Whole` and `picked`. A batch is integrated at once. Members that meet something (a surface that runs
along a variable, roots that merge, a bound that rounding hides, a budget that is spent) are taken out, since what
helps them costs the others time and tells nothing of them: those that another order of the variables may help are
done so together, those with two sides together, those that no order helps in each direction by itself, all others one
by one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from potto.core.terms import Integral
from potto.integrate.pieces import Sums
from potto.kernels.cells import Array, Bools, Ints, map_arrays
from potto.runtime.evaluation.record import Met
from potto.runtime.integration.plans import Linked

if TYPE_CHECKING:
    from potto.runtime.evaluation.machine import Machine

# Up to how many members are done one by one from the start: together they are no faster.
FEW_MEMBERS = 10
# Up to how many are done one by one where somebody has met something and nobody knows who; more are halved.
MOST_UNKNOWN = 64
# For how many members without the accuracy asked for it is tried what can be done for one.
MOST_ROUGH = 256
NOBODY: Ints = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class Ways:
    """How integrals are done. orders: the integral with its variables in other orders, the best first.

    whole: members together; settled: what is still to be done for members with plain sums, or with two sides;
    directions: members with each direction by itself; single: one member, with everything that there is for it.
    """

    orders: Callable[[], Iterable[Integral]]
    whole: Callable[[Integral, Linked, int], Sums]
    settled: Callable[[Integral, Linked, int, Sums], Sums]
    directions: Callable[[Linked, int], Sums]
    single: Callable[[Linked], Sums]


class Whole:
    """The sums of a batch, put together from those of its parts."""

    def __init__(self, batch: int) -> None:
        self.batch = batch
        self.parts: list[tuple[Ints, Sums]] = []

    def put(self, index: Ints, part: Sums) -> None:
        if index.size:
            self.parts.append((index, part))

    @property
    def sums(self) -> Sums:
        """One component may stand for all where nothing is integrated."""
        m, k = max(p.v.shape[0] for _, p in self.parts), self.parts[0][1].t.shape[1]
        v, e, gross = (np.zeros((rows, self.batch)) for rows in (m, m, 2))
        t, et = np.zeros((2, m, k, self.batch))
        for index, part in self.parts:
            v[:, index], e[:, index], t[:, :, index], et[:, :, index] = part.v, part.e, part.t, part.et
            gross[:, index] = added_up(part)
        return Sums(v, e, t, et, gross=gross)


def added_up(sums: Sums) -> Array:
    """What is added up for each without regard to sign, at the least what it comes to."""
    most = np.stack((np.abs(sums.v).max(axis=0), np.abs(sums.t).max(axis=(0, 1), initial=0.0)))
    return most if sums.gross is None else np.maximum(most, sums.gross)


def picked(linked: Linked, index: Ints | int) -> Linked:
    """Some members of a batch, or one of them by itself."""
    if isinstance(index, int):
        return Linked(linked.functions, {n: map_arrays(v, lambda a: float(a[index])) for n, v in linked.env.items()})
    return Linked(linked.functions, {n: map_arrays(v, lambda a: a[index]) for n, v in linked.env.items()})


def some(sums: Sums, index: Ints) -> Sums:
    gross = None if sums.gross is None else sums.gross[:, index]
    return Sums(sums.v[:, index], sums.e[:, index], sums.t[:, :, index], sums.et[:, :, index], gross=gross)


def by_members(machine: Machine, linked: Linked, batch: int, ways: Ways, bad: Callable[[Sums], Bools]) -> Sums:
    """The sums of a batch. bad: the members that are not as accurate as was asked for."""
    found = Whole(batch)
    everybody = np.arange(batch)
    alone = [everybody] if batch <= FEW_MEMBERS else _together(machine, linked, everybody, ways, bad, found)
    for i in map(int, np.concatenate(alone)):
        one = np.array([i])
        with machine.books.among(one) as met:
            part = ways.single(picked(linked, i))
        machine.books.met.take(met, one)
        found.put(one, part)
    return found.sums


def _together(
    machine: Machine, linked: Linked, todo: Ints, ways: Ways, bad: Callable[[Sums], Bools], found: Whole
) -> list[Ints]:
    """Put what can be done together; what is left is to be done one by one."""
    alone = [NOBODY]
    for order in ways.orders():
        here = picked(linked, todo)
        with machine.books.among(todo) as met:
            sums = ways.whole(order, here, todo.size)
        kinds = _kinds(met, todo.size)
        if kinds is None and todo.size > MOST_UNKNOWN:
            for half in np.array_split(todo, 2):
                alone += _together(machine, linked, half, ways, bad, found)
            return alone
        if kinds is None:
            return [*alone, todo]
        turned, trouble, sided = kinds
        for group in (np.nonzero(~(turned | trouble | sided))[0], np.nonzero(sided)[0]):
            if group.size:
                alone.append(_settle(machine, order, here, todo, group, met, ways, bad, sums, found))
        alone.append(todo[trouble])
        todo = todo[turned]
        if not todo.size:
            return alone
    if machine.directions < 2 or todo.size <= FEW_MEMBERS:
        return [*alone, todo]
    with machine.books.among(todo) as met:
        found.put(todo, ways.directions(picked(linked, todo), todo.size))
    machine.books.met.take(met, todo)
    return alone


def _kinds(met: Met, size: int) -> tuple[Bools, Bools, Bools] | None:
    """The members that want other variables innermost, those in trouble, and those with two sides; None if nobody
    knows of something which of them met it."""
    folds = {what: members for what, (_, members) in met.folds.items()}
    masks = []
    for events in ((met.degenerate,), (met.unfinished, met.incomplete, folds), (met.sided,)):
        mask = np.zeros(size, dtype=bool)
        for event in events:
            for members in event.values():
                if members is None:
                    return None
                mask[members] = True
        masks.append(mask)
    turned, trouble, sided = masks
    return turned, trouble & ~turned, sided & ~turned & ~trouble


def _settle(
    machine: Machine, order: Integral, linked: Linked, todo: Ints, group: Ints, met: Met, ways: Ways,
    bad: Callable[[Sums], Bools], sums: Sums, found: Whole,
) -> Ints:  # fmt: skip
    """Put what some of the members come to, and return those that are not accurate enough."""
    place = np.full(todo.size, -1)
    place[group] = np.arange(group.size)
    with machine.books.among(todo[group]) as own:
        for what, members in met.sided.items():
            assert members is not None
            there = place[members]
            if (there >= 0).any():
                own.sided[what] = there[there >= 0]
        part = ways.settled(order, picked(linked, group), group.size, some(sums, group))
    rough = bad(part)
    if rough.sum() > MOST_ROUGH:
        rough[:] = False
    keep = np.nonzero(~rough)[0]
    machine.books.met.take(own.of(keep), todo[group[keep]])
    found.put(todo[group[keep]], some(part, keep))
    return todo[group[rough]]
