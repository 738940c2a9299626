"""An integral by the first method that settles it, and then by whatever makes the answer better.

Owns `solve`, `METHODS` and the improvers. A method answers a problem, or None where it is not for it. An improver takes
an answer, and what was met on the way to it, to one that is no worse; each says where it can help.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from msgspec.structs import replace

from potto.calculus.differentiation.level_sets import placed_along
from potto.core.terms import Integral
from potto.integrate.events import (
    ALONG_AXES,
    TOO_MANY_CASES,
    UNCOUNTED_JUMP,
    Degenerate,
    Shortfall,
)
from potto.integrate.fixed.a_priori import certain
from potto.integrate.pieces import Sums, still
from potto.integrate.plan import Plan
from potto.kernels.cells import Ints
from potto.runtime.integration.at_kinks import at_kinks
from potto.runtime.integration.choices import many, passes_on, too_many, trials
from potto.runtime.integration.differences import by_differences
from potto.runtime.integration.elimination import ACCURATE, WORTH, accurate, step_by_step
from potto.runtime.integration.members import by_members, one_by_one
from potto.runtime.integration.one_sided import at_folds, beside_axes, on_both_sides
from potto.runtime.integration.problem import Problem
from potto.runtime.integration.quadrature import within
from potto.runtime.integration.second_looks import beside_another, by_less, in_another_order

# How many times the evaluations that iteration was tried with elimination may take after that, if only three variables
# are to be eliminated: a ridge in space takes twice as many (0.4 s). It gets all that there is where iteration then
# leaves more than a relative error of ROUGH: of a torus as a quartic 8e-7, of which tables leave 2e-12 after 2.7
# million; of one with a root 5e-8, and three million come to nothing.
TABLES, ROUGH = 3, 1e-7

Method = Callable[[Problem], Sums | None]
Improver = Callable[[Problem, Integral, Sums], Sums]


def solve(problem: Problem) -> Sums:
    """What an integral amounts to."""
    for method in METHODS if problem.outermost else (along_cuts,):
        found = method(problem)
        if found is not None:
            return at_kinks(problem, found)
    raise AssertionError("cuts are for every integral")


# Methods


def by_elimination(problem: Problem) -> Sums | None:
    """One variable after the other, where each hands on one number."""
    if problem.machine.settings.method in ("mc", "qmc") or not many(problem):
        return None
    return step_by_step(problem, WORTH if too_many(problem) else ACCURATE)


def by_samples(problem: Problem) -> Sums | None:
    """All variables at once, where that was asked for, or where they are too many for rules."""
    from potto.integrate.montecarlo.sampling import sample

    method = problem.machine.settings.method
    if placed_along(problem.term) is not None or (method not in ("mc", "qmc") and not too_many(problem)):
        return None
    plan = problem.plan()
    sums = counted(problem, plan, sample(plan, problem.machine, problem.env, problem.batch, method), drawn=True)
    problem.machine.record.methods.add("mc" if method == "mc" else "qmc")
    sums.et[:, :, _blind(problem)] = np.inf  # what crosses those that were left out is not known
    return sums


def as_a_batch(problem: Problem) -> Sums | None:
    """Many members together, and one by one where they meet something."""
    if problem.batch == 1:
        return None
    problem.machine.record.methods.add("quadrature")
    return by_members(problem, _settled)


def _settled(part: Problem, order: Integral, sums: Sums) -> Sums:
    return improved(part, order, counted(part, part.plan(order), sums), TOGETHER)


def along_cuts(problem: Problem) -> Sums:
    """Iterated quadrature, in the first order of the variables in which no surface runs along the one that it cuts."""
    machine, env, batch, events = problem.machine, problem.env, problem.batch, problem.events
    machine.record.methods.add("quadrature")
    tried, stopped = 0, False
    for order, most in trials(problem):
        events.forget(Degenerate)
        if most is None and tried and batch == 1 and passes_on(problem):
            eliminated = step_by_step(problem, ACCURATE, TABLES * tried)
            if eliminated is not None:
                return eliminated
            stopped = True
        tried = most or 0
        plan = problem.plan(order)
        if batch == 1 and plan.straight is not None:
            plain = certain(plan.straight, machine, env)
            if plain is not None:
                return plain
        found = within(most, plan, machine, env, batch)
        if found is not None:
            sums = counted(problem, plan, found)
            if not events.every(Degenerate):
                sums = improved(problem, order, sums, ALONE if problem.outermost else INSIDE)
                if stopped and not accurate(sums, ROUGH, machine):
                    sums = step_by_step(problem, ACCURATE) or sums
                return unbounded(problem, sums) if problem.outermost else sums
    return _along_axes(problem, plan, sums)


def _along_axes(problem: Problem, plan: Plan, sums: Sums) -> Sums:
    """Surfaces run along every variable: each direction by itself, or beside the parameters."""
    machine, events = problem.machine, problem.events
    if problem.outermost and machine.directions > 1:
        return one_by_one(problem)
    if problem.outermost:
        variable = min(event.variable for event, _ in events.every(Degenerate))
        resting = {n: still(v) for n, v in problem.env.items()}
        values = solve(problem.at(resting, machine=machine.with_directions(0), outermost=False))
        sums = replace(sums, v=values.v, e=values.e)
        if beside_axes(problem, plan, sums, variable):
            return unbounded(problem, sums)
    machine.note(ALONG_AXES)
    return replace(sums, et=np.full_like(sums.et, np.inf))


METHODS: tuple[Method, ...] = (by_elimination, by_samples, as_a_batch, along_cuts)


# What of an answer is known


def counted(problem: Problem, plan: Plan, sums: Sums, drawn: bool = False) -> Sums:
    """The sums, with derivatives that no one vouches for where not all jumps could be taken account of, and of values
    that are not `drawn` where it is not known where they are."""
    if plan.confused:
        problem.machine.note(TOO_MANY_CASES)
        e = sums.e if drawn else np.full_like(sums.e, np.inf)
        return replace(sums, e=e, et=np.full_like(sums.et, np.inf))
    if problem.machine.directions and not plan.reaches:
        problem.machine.note(UNCOUNTED_JUMP)
        return replace(sums, et=np.full_like(sums.et, np.inf))
    return sums


def unbounded(problem: Problem, sums: Sums) -> Sums:
    """Rules on panels that should have been cut further are good for nothing."""
    blind = _blind(problem)
    if blind.size:
        sums.e[:, blind], sums.et[:, :, blind] = np.inf, np.inf
    return sums


def _blind(problem: Problem) -> Ints:
    """The members of which a part was not seen."""
    mask = np.zeros(problem.batch, dtype=bool)
    for shortfall, members in problem.events.every(Shortfall):
        if shortfall.blind:
            mask[slice(None) if members is None else members] = True
    return np.nonzero(mask)[0]


# Improvers


def improved(problem: Problem, order: Integral, sums: Sums, improvers: Sequence[Improver]) -> Sums:
    for improve in improvers:
        sums = improve(problem, order, sums)
    return sums


ALONE = (by_less, beside_another, on_both_sides, at_folds, in_another_order, by_differences)
TOGETHER = (beside_another, on_both_sides, in_another_order)
INSIDE = (beside_another,)
