"""A batch of integrals in which each member gets the answer, the cost and the reasons that it gets by itself.

Owns `by_members` and `Whole`. A batch is integrated at once. Members that meet something (a surface that runs along a
variable, roots that merge, a bound that rounding hides, a budget that is spent) are taken out, since what helps them
costs the others time and tells nothing of them: those that another order of the variables may help are done so
together, those at folds together, those with two sides together, those that no order helps in each direction that
moves them by itself (`directions`), all others one by one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from msgspec.structs import replace

from potto.core.terms import Integral
from potto.integrate.columns import run_of
from potto.integrate.events import Along, Degenerate, Events, Shortfall, SurfaceFold, TwoSided, Unsearched
from potto.integrate.pieces import Sums
from potto.kernels.cells import Array, Bools, Ints
from potto.kernels.memory import kept
from potto.runtime.answers.convergence import Precise, missing, rounded
from potto.runtime.integration.methods.attempts import proved_beforehand
from potto.runtime.integration.methods.choices import orders, preferred
from potto.runtime.integration.methods.directions import by_directions
from potto.runtime.integration.methods.quadrature import cut_up, whole_boxes
from potto.runtime.integration.problem import Problem

# Up to how many members are done one by one, to the digits that each has by itself.
FEW_MEMBERS = 10
# The same for each variable where they are summands that proofs settle: eq. (1) at 8 values takes 5.5 ms so, and 6.3
# together; a condition in one variable at 4 takes 1.8 and 1.6.
PROVED = 4
# Up to how many are done one by one where somebody has met something and nobody knows who; more are halved.
MOST_UNKNOWN = 64
# Up to which part of a batch is left as rules have it where rounding spoils them all: one member by itself takes as
# long as ten thousand, for an error that is 0.2 to 0.7 of what it was.
RARE = 1e-3
# Up to which part of a batch others are looked at by themselves, beside those that are known to be precise.
OTHERS = 0.125
# For how many members without the accuracy asked for it is tried what can be done for one.
MOST_ROUGH = 256
NOBODY: Ints = np.zeros(0, dtype=np.int64)

# What is still to be done for members with plain sums, or with two sides, in an order of the variables.
Settled = Callable[[Problem, Integral, Sums], Sums]


class Whole:
    """The sums of a batch, put together from those of its parts."""

    def __init__(self) -> None:
        self.parts: list[tuple[Ints, Sums]] = []

    def put(self, index: Ints, part: Sums) -> None:
        if index.size:
            self.parts.append((index, part))

    @property
    def sums(self) -> Sums:
        index, part = self.parts[0]
        if len(self.parts) > 1 or (index.size > 1 and run_of(index) is None):  # else all of them, in order
            order = np.argsort(np.concatenate([index for index, _ in self.parts]))
            part = Sums.joined([_with_gross(part) for _, part in self.parts]).pick(order)
        return replace(part, gross=added_up(part))


def _with_gross(sums: Sums) -> Sums:
    """Sums of which is known what is added up, at the least nothing: those that are joined have the same fields."""
    return sums if sums.gross is not None else replace(sums, gross=np.zeros((2, sums.v.shape[-1])))


def added_up(sums: Sums) -> Array:
    """What is added up for each without regard to sign, at the least what it comes to."""
    most = np.stack((np.abs(sums.v).max(axis=0), np.abs(sums.t).max(axis=(0, 1), initial=0.0)))
    return most if sums.gross is None else np.maximum(most, sums.gross)


def by_members(problem: Problem, settled: Settled) -> Sums:
    """The sums of a batch: whole boxes first, which need nothing more, then the others."""
    kept()
    plan = problem.plan(next(iter(preferred(problem))))
    boxes = whole_boxes(plan, problem.machine, problem.env, problem.batch)
    if boxes is None:
        return _cut(problem, settled)
    sums, rest = boxes.sums, boxes.rest
    if rest.size:
        with problem.among(rest) as part:
            sums = sums.with_members(rest, _cut(part, settled))
        problem.events.take(part.events, rest)
    if boxes.precise and rest.size < OTHERS * problem.batch:
        problem.machine.record.precise = Precise(sums, rest)
    return sums


def _cut(problem: Problem, settled: Settled) -> Sums:
    """The sums of members whose boxes are cut."""
    found = Whole()
    few = PROVED * len(problem.term.variables) if problem.machine.summed else _singly(problem)
    todo = np.arange(problem.batch) if problem.batch > few else _proved(problem, found)
    alone = [todo] if todo.size <= _singly(problem) else _together(problem, todo, settled, found)
    for i in map(int, np.concatenate(alone)):
        one = np.array([i])
        with problem.among(one) as single:
            found.put(one, single.solver(single))
        problem.events.take(single.events, one)
    return found.sums


def _singly(problem: Problem) -> int:
    """Up to how many members are done one by one: summands need not have the digits of each, and to one side of the
    parameters nothing is proved of one by itself."""
    return 1 if problem.machine.summed or problem.machine.side else FEW_MEMBERS


def _proved(problem: Problem, found: Whole) -> Ints:
    """Put the first members, as long as there is a proof for each; those that are left."""
    everybody = np.arange(problem.batch)
    for i in everybody:
        one = everybody[i : i + 1]
        with problem.among(one) as single:
            sums = proved_beforehand(single)
        if sums is None:
            return everybody[i:]
        found.put(one, sums)
        problem.events.take(single.events, one)
    return everybody[:0]


def _together(problem: Problem, todo: Ints, settled: Settled, found: Whole) -> list[Ints]:
    """Put what can be done together; what is left is to be done one by one."""
    alone = [NOBODY]
    for order in preferred(problem):
        with problem.among(todo) as here:
            others = (here.plan(other) for other in orders(problem.term) if other is not order)
            few = _singly(problem)
            sums, short = cut_up(here.plan(order), here.machine, here.env, here.batch, others, few)
        kinds = _kinds(here.events, todo.size)
        if kinds is None and todo.size > MOST_UNKNOWN:
            for half in np.array_split(todo, 2):
                alone += _together(problem, half, settled, found)
            return alone
        if kinds is None:
            return [*alone, todo]
        turned, trouble, *apart = kinds
        if RARE * todo.size < short.sum() <= few:
            trouble |= short
        plain = ~np.logical_or.reduce(kinds)
        for group in (np.nonzero(kind)[0] for kind in (plain, *apart)):
            if group.size:
                with here.among(group) as part:
                    part.events.take(here.events.of(group, TwoSided, SurfaceFold, Along), np.arange(group.size))
                    own = settled(part, order, sums.pick(group))
                    rough = missing(problem.term, own, problem.machine.settings, part.env)
                    rough &= ~short[group]
                    spoilt = rough & rounded(own) if rough.any() else rough
                    if spoilt.sum() > FEW_MEMBERS:
                        rough &= ~spoilt
                if rough.sum() > MOST_ROUGH:
                    rough[:] = False
                keep = np.nonzero(~rough)[0]
                problem.events.take(part.events.of(keep), todo[group[keep]])
                found.put(todo[group[keep]], own.pick(keep))
                alone.append(todo[group[rough]])
        alone.append(todo[trouble])
        todo = todo[turned]
        if not todo.size:
            return alone
    if problem.machine.directions < 2 or todo.size <= _singly(problem):
        return [*alone, todo]
    with problem.among(todo) as here:
        found.put(todo, by_directions(here))
    problem.events.take(here.events, todo)
    return alone


def _kinds(events: Events, size: int) -> tuple[Bools, Bools, Bools, Bools] | None:
    """The members that want other variables innermost, those in trouble, those at folds, and those with two sides; None
    if nobody knows of something which of them met it."""
    if not events.known(Degenerate, Shortfall, Unsearched, SurfaceFold, TwoSided):
        return None
    turned = events.touched(size, Degenerate)
    trouble = events.touched(size, Shortfall, Unsearched) & ~turned
    folded = events.touched(size, SurfaceFold) & ~turned & ~trouble
    return turned, trouble, folded, events.touched(size, TwoSided) & ~(turned | trouble | folded)
