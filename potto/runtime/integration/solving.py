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
from potto.integrate.degenerate.kinks import on_bounds
from potto.integrate.events import (
    ALONG_AXES,
    TOO_MANY_CASES,
    UNCOUNTED_JUMP,
    Degenerate,
    Shortfall,
    mask_of,
)
from potto.integrate.fixed.at_sight import at_sight
from potto.integrate.pieces import Sums, still
from potto.integrate.plan import Plan
from potto.kernels.cells import Ints
from potto.runtime.integration.derivatives.at_kinks import at_kinks
from potto.runtime.integration.derivatives.differences import by_differences
from potto.runtime.integration.derivatives.one_sided import at_folds, beside_axes, on_both_sides
from potto.runtime.integration.methods.attempts import (
    Attempt,
    accurate,
    attempted,
    best,
    proved_beforehand,
    uncertainty,
)
from potto.runtime.integration.methods.choices import (
    endless,
    few_planes,
    many,
    many_variables,
    passes_on,
    to_be_seen,
    too_many,
    trial,
    tried,
    worth_trials,
)
from potto.runtime.integration.methods.directions import by_directions
from potto.runtime.integration.methods.elimination import ACCURATE, WORTH, eliminated, step_by_step
from potto.runtime.integration.methods.members import by_members
from potto.runtime.integration.methods.second_looks import beside_another, by_less, by_more, in_another_order
from potto.runtime.integration.problem import Problem

# How many times what a trial took the most promising order gets before variables are eliminated, or it gets all that
# there is: a torus takes 2.8 times as many evaluations, and tables of it 8 times. How uncertain a trial may leave an
# answer for that to be done at once: of a torus 1e-3 in the order to take and 0.3 in the others, of an arm 1e-10.
LONGER, PROMISING = 4, 1e-2
# From how many evaluations that there are those are left that tables may take for nothing, 3 million.
PLENTY = 10_000_000
# Evaluations for rules in four variables where samples are to be drawn: of 12 polytopes of random planes rules ended
# with 2 to 4 planes (2,000 to 220,000 evaluations), and with the 12 of all differences (58,000), to all digits.
# Where they did not it took as long as the samples, with 12 planes 4 s.
GLANCE = 200_000

Method = Callable[[Problem], Sums | None]
Improver = Callable[[Problem, Integral, Sums], Sums]


def solve(problem: Problem) -> Sums:
    """What an integral amounts to."""
    seen = by_a_look(problem) if problem.outermost else None
    if seen is not None:
        return seen  # nothing in it has a kink
    for method in METHODS if problem.outermost else (along_cuts,):
        found = method(problem)
        if found is not None:
            return at_kinks(problem, found)
    raise AssertionError("cuts are for every integral")


# Methods


def by_elimination(problem: Problem) -> Sums | None:
    """One variable after the other, where each hands on one number."""
    if problem.machine.settings.sampled or not many(problem):
        return None
    return step_by_step(problem, WORTH if too_many(problem) else ACCURATE)


def by_samples(problem: Problem) -> Sums | None:
    """All variables at once, where that was asked for, or where they are too many for rules."""
    if placed_along(problem.term) is not None or not (problem.machine.settings.sampled or too_many(problem)):
        return None
    if few_planes(problem):
        found = attempted(problem, problem.term, GLANCE)
        if not found.stopped and found.known and not found.events.every(Degenerate):
            problem.machine.record.methods.add("quadrature")
            return finished(problem, found)
    return _drawn(problem)


def _drawn(problem: Problem) -> Sums:
    """What samples tell."""
    from potto.integrate.montecarlo.sampling import sample

    plan, method = problem.plan(), problem.machine.settings.method
    sums = counted(problem, plan, sample(plan, problem.machine, problem.env, problem.batch, method), drawn=True)
    problem.machine.record.methods.add("mc" if method == "mc" else "qmc")
    sums.et[:, :, _blind(problem)] = np.inf  # what crosses those that were left out is not known
    if problem.machine.directions and not problem.machine.frozen:
        for event, members in on_bounds(plan, problem.env, problem.batch, problem.machine):
            problem.machine.note(event, members)
    return sums


def by_a_look(problem: Problem) -> Sums | None:
    """One member that has no plan yet, seen as it is: a plan pays where an integral is asked for again and again."""
    body = to_be_seen(problem)
    if body is None:
        return None
    problem.known.looks += 1
    found = at_sight(problem.term, body, problem.machine, problem.env)
    if found is not None:
        problem.machine.record.methods.add("quadrature")
        problem.machine.record.seen += 1
    return found


def as_a_batch(problem: Problem) -> Sums | None:
    """Many members together, and one by one where they meet something."""
    if problem.batch == 1:
        return None
    problem.machine.record.methods.add("quadrature")
    return by_members(problem, _settled)


def _settled(part: Problem, order: Integral, sums: Sums) -> Sums:
    return improved(part, order, counted(part, part.plan(order), sums), TOGETHER)


def along_cuts(problem: Problem) -> Sums:
    """Iterated quadrature, in the first order of the variables that a trial settles, and in which no surface runs along
    the one that it cuts; where none does, the best of what is found with all evaluations."""
    machine, events = problem.machine, problem.events
    machine.record.methods.add("quadrature")
    plain = proved_beforehand(problem) if problem.batch == 1 else None
    if plain is not None:
        return plain
    most = trial(problem)
    stopped: list[Attempt] = []
    tables: list[Attempt] | None = None
    if most is not None and endless(problem) and machine.settings.max_evals >= PLENTY:
        tables = by_tables(problem)  # of infinite ranges iteration takes long in every order
    if tables and accurate(tables[0].sums, machine.rtol, machine):
        return tables[0].sums
    for order, allowed, at_once in tried(problem, most):
        found = attempted(problem, order, allowed)
        if found.stopped and allowed != most:
            continue
        if found.stopped and tables is None and many_variables(problem) and not found.events.every(Degenerate):
            tables = by_tables(problem)
            if tables and accurate(tables[0].sums, machine.rtol, machine):
                return tables[0].sums
        if at_once and most is not None and found.stopped and uncertainty(found.sums) < PROMISING:
            found = best((found, attempted(problem, order, LONGER * max(most, found.taken))))
        along = found.events.every(Degenerate)
        if not along and not found.stopped and (most is None or found.known):
            if most is not None:
                problem.known.ended = order, found.taken
            return finished(problem, found)
        if not along:
            stopped.append(found)
            if not worth_trials(problem):
                break
    if stopped:
        return _by_samples_instead(problem, best(stopped)) or with_all(problem, stopped, most, tables)
    events.take(found.events, np.arange(problem.batch))
    return _along_axes(problem, problem.plan(order), found.sums)


def by_tables(problem: Problem) -> list[Attempt]:
    """The integral with its variables eliminated; nothing where these are few, or can't be."""
    return eliminated(problem) if passes_on(problem) else []


def with_all(problem: Problem, tried: list[Attempt], most: int | None, tables: list[Attempt] | None) -> Sums:
    """The best answer where trials in some orders of the variables did not come to an end, or to no bound: in the order
    of which most is known, or by tables, with more and more evaluations.

    most: the evaluations that each trial took. tables: what they came to; None if they were not tried.
    """
    machine, longer = problem.machine, list[Attempt]()
    if machine.overdrawn():  # so many cuts that the first nodes of a trial are more than there are
        return finished(problem, best(tried))
    for known in sorted(tried, key=lambda attempt: uncertainty(attempt.sums)):
        found = known
        if most is not None and known.stopped and known.most == most:
            bounded = passes_on(problem) or worth_trials(problem)
            found = attempted(problem, known.order, LONGER * most if bounded else None)
        if found.events.every(Degenerate):
            continue
        longer.append(found)
        if machine.exhausted() or found.stopped or accurate(found.sums, machine.rtol, machine):
            break  # those that are not accurate though they came to an end may be in another order
    if not longer or not longer[-1].stopped:
        return finished(problem, best((*tried, *longer)))
    if tables is None:
        tables = by_tables(problem)
        if tables and accurate(tables[0].sums, max(ACCURATE, machine.rtol), machine):
            return tables[0].sums
    if len(longer) == 1:
        longer.append(attempted(problem, longer[0].order, None))
    return finished(problem, best((*tried, *tables, *longer)))


def _by_samples_instead(problem: Problem, found: Attempt) -> Sums | None:
    """What samples tell of many variables, where no trial promises anything and they tell more."""
    if not many(problem) or uncertainty(found.sums) <= PROMISING:
        return None
    apart = problem.apart()
    drawn = _drawn(apart)
    if uncertainty(drawn) >= uncertainty(found.sums):
        return None
    problem.events.take(apart.events, np.arange(problem.batch))
    return drawn


def finished(problem: Problem, found: Attempt) -> Sums:
    """The sums of an attempt, made better by whatever may help; the problem has met what it met."""
    problem.events.take(found.events, np.arange(problem.batch))
    if found.tabled:
        return found.sums
    own = problem.changed(term=found.order)
    sums = counted(own, own.plan(), found.sums)
    if not problem.outermost:
        return improved(own, found.order, sums, INSIDE)
    return unbounded(problem, improved(own, found.order, sums, ALONE))


def _along_axes(problem: Problem, plan: Plan, sums: Sums) -> Sums:
    """Surfaces run along every variable: each direction by itself, or beside the parameters."""
    machine, events = problem.machine, problem.events
    if problem.outermost and machine.directions > 1:
        return by_directions(problem)
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
    """The sums, with no bound for members of which a part was not seen: rules on panels that lack cuts tell nothing."""
    blind = _blind(problem)
    if blind.size:
        sums.e[:, blind], sums.et[:, :, blind] = np.inf, np.inf
    return sums


def _blind(problem: Problem) -> Ints:
    """The members of which a part was not seen."""
    mask = np.zeros(problem.batch, dtype=bool)
    for shortfall, members in problem.events.every(Shortfall):
        if shortfall.blind:
            mask |= mask_of(members, problem.batch)
    return np.nonzero(mask)[0]


# Improvers


def improved(problem: Problem, order: Integral, sums: Sums, improvers: Sequence[Improver]) -> Sums:
    for improve in improvers:
        sums = improve(problem, order, sums)
    return sums


ALONE = (by_less, by_more, beside_another, on_both_sides, at_folds, in_another_order, by_differences)
TOGETHER = (beside_another, on_both_sides, at_folds, in_another_order)
INSIDE = (beside_another,)
