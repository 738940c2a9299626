"""A batch of integrals in which each member gets the answer, the cost and the reasons that it gets by itself.

Owns `by_members` and `Whole`. A batch is integrated at once. Members that meet something (a surface that runs
along a variable, roots that merge, a bound that rounding hides, a budget that is spent) are taken out, since what
helps them costs the others time and tells nothing of them: those that another order of the variables may help are
done so together, those with two sides together, those that no order helps in each direction by itself, all others one
by one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from potto.core.terms import Integral
from potto.integrate.events import Degenerate, Events, Fold, Shortfall, TwoSided, Unsearched
from potto.integrate.pieces import Sums
from potto.kernels.cells import Array, Bools, Ints
from potto.runtime.integration.problem import Problem

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
    whole: Callable[[Integral, Problem], Sums]
    settled: Callable[[Integral, Problem, Sums], Sums]
    directions: Callable[[Problem], Sums]
    single: Callable[[Problem], Sums]


class Whole:
    """The sums of a batch, put together from those of its parts."""

    def __init__(self) -> None:
        self.parts: list[tuple[Ints, Sums]] = []

    def put(self, index: Ints, part: Sums) -> None:
        if index.size:
            self.parts.append((index, part))

    @property
    def sums(self) -> Sums:
        order = np.argsort(np.concatenate([index for index, _ in self.parts]))
        return Sums.joined([replace(part, gross=added_up(part)) for _, part in self.parts]).pick(order)


@dataclass(frozen=True)
class Part:
    """Members of a batch that are done together, `todo` of them, and where what they come to and have met goes."""

    found: Whole
    events: Events
    todo: Ints

    def put(self, index: Ints, sums: Sums, met: Events) -> None:
        self.events.take(met, self.todo[index])
        self.found.put(self.todo[index], sums)


def added_up(sums: Sums) -> Array:
    """What is added up for each without regard to sign, at the least what it comes to."""
    most = np.stack((np.abs(sums.v).max(axis=0), np.abs(sums.t).max(axis=(0, 1), initial=0.0)))
    return most if sums.gross is None else np.maximum(most, sums.gross)


def by_members(problem: Problem, ways: Ways, bad: Callable[[Sums], Bools]) -> Sums:
    """The sums of a batch. bad: the members that are not as accurate as was asked for."""
    found = Whole()
    everybody = np.arange(problem.batch)
    alone = [everybody] if problem.batch <= FEW_MEMBERS else _together(problem, everybody, ways, bad, found)
    for i in map(int, np.concatenate(alone)):
        one = np.array([i])
        with problem.among(one) as single:
            found.put(one, ways.single(single))
        problem.events.take(single.events, one)
    return found.sums


def _together(problem: Problem, todo: Ints, ways: Ways, bad: Callable[[Sums], Bools], found: Whole) -> list[Ints]:
    """Put what can be done together; what is left is to be done one by one."""
    alone = [NOBODY]
    for order in ways.orders():
        with problem.among(todo) as here:
            sums = ways.whole(order, here)
        kinds = _kinds(here.events, todo.size)
        if kinds is None and todo.size > MOST_UNKNOWN:
            for half in np.array_split(todo, 2):
                alone += _together(problem, half, ways, bad, found)
            return alone
        if kinds is None:
            return [*alone, todo]
        turned, trouble, sided = kinds
        for group in (np.nonzero(~(turned | trouble | sided))[0], np.nonzero(sided)[0]):
            if group.size:
                rough = _settle(order, here, group, ways, bad, sums, Part(found, problem.events, todo))
                alone.append(rough)
        alone.append(todo[trouble])
        todo = todo[turned]
        if not todo.size:
            return alone
    if problem.machine.directions < 2 or todo.size <= FEW_MEMBERS:
        return [*alone, todo]
    with problem.among(todo) as here:
        found.put(todo, ways.directions(here))
    problem.events.take(here.events, todo)
    return alone


def _kinds(events: Events, size: int) -> tuple[Bools, Bools, Bools] | None:
    """The members that want other variables innermost, those in trouble, and those with two sides; None if nobody
    knows of something which of them met it."""
    if not events.known(Degenerate, Shortfall, Unsearched, Fold, TwoSided):
        return None
    turned = events.touched(size, Degenerate)
    trouble = events.touched(size, Shortfall, Unsearched, Fold) & ~turned
    return turned, trouble, events.touched(size, TwoSided) & ~turned & ~trouble


def _settle(
    order: Integral, here: Problem, group: Ints, ways: Ways, bad: Callable[[Sums], Bools], sums: Sums, into: Part
) -> Ints:
    """Put what some of the members come to, and return those that are not accurate enough."""
    with here.among(group) as part:
        part.events.take(here.events.of(group, TwoSided), np.arange(group.size))
        settled = ways.settled(order, part, sums.pick(group))
    rough = bad(settled)
    if rough.sum() > MOST_ROUGH:
        rough[:] = False
    keep = np.nonzero(~rough)[0]
    into.put(group[keep], settled.pick(keep), part.events.of(keep))
    return into.todo[group[rough]]
