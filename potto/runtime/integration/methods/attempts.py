"""Answers to one integral by several ways, of which the best one counts.

Owns `proved_beforehand`, `Attempt`, `attempted`, `uncertainty`, `accurate` and `best`. An order of the variables that
runs into roots that merge, or into kinks at places that nobody knows, takes a hundred times what another one takes. So
each is tried with few evaluations before any of them gets all, and what was found on the way is kept: no way makes an
answer worse that another one had.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from potto.core.terms import Integral
from potto.integrate.events import BUDGET_SPENT, Events, OneSidedDerivatives, Shortfall
from potto.integrate.fixed.proved_sums.a_priori import Crowded, beside_bounds, certain
from potto.integrate.fixed.proved_sums.on_bounds import Tied
from potto.integrate.pieces import Sums
from potto.runtime.evaluation.derivatives.sides import SAME
from potto.runtime.evaluation.machine import Machine
from potto.runtime.integration.methods.choices import preferred
from potto.runtime.integration.methods.quadrature import in_parts
from potto.runtime.integration.problem import Problem


def proved_beforehand(problem: Problem) -> Sums | None:
    """By the rule of the first order of the variables in which the cuts are apart, if there is a proof for it; by that
    of the first one where in none they are, and some lie on bounds."""
    crowded = []
    for order in preferred(problem):
        rule = problem.plan(order).straight
        if rule is None:
            return None
        try:
            return certain(rule, problem.machine, problem.env)
        except Crowded:
            crowded.append(rule)
    tied = beside_bounds(crowded[0], problem.machine, problem.env) if crowded else None
    return None if tied is None else _told_apart(problem, tied)


def _told_apart(problem: Problem, tied: Tied) -> Sums:
    """What cuts that lie on bounds make of an integral, with a note where its derivatives to both sides differ."""
    sums, back, on = tied.whole, tied.backward, tied.forward
    off = np.maximum(back.et, on.et)
    if (np.abs(on.t - back.t) <= SAME * (np.abs(on.t) + np.abs(back.t)) + back.et + on.et).all():
        return replace(sums, t=on.t, et=off)
    for cause in tied.causes:
        problem.machine.note(OneSidedDerivatives(cause, back.t, on.t, back.et, on.et), np.arange(1))
    return sums


class Attempt(Struct, frozen=True):
    """An answer by an order of the variables, with what was met on the way to it.

    most: how many evaluations a member it was given, None for all. taken: how many it took: nodes are evaluated many at
    once. stopped: whether it had to stop for want of them. tabled: whether it comes from variables eliminated.
    """

    order: Integral
    sums: Sums
    events: Events
    most: int | None = None
    stopped: bool = False
    tabled: bool = False
    taken: int = 0

    @property
    def known(self) -> bool:
        """Whether there is a bound of how far off it is; where no cell has anything in it, it is 0 exactly."""
        empty = not self.taken and not self.sums.e.any() and not self.sums.et.any()
        return empty or uncertainty(self.sums) < math.inf


def attempted(problem: Problem, order: Integral, most: int | None) -> Attempt:
    """What quadrature in an order of the variables comes to with so many evaluations a member; None: with all."""
    machine = problem.machine.apart()
    before = machine.record.spent
    limit = math.inf if most is None else before + most
    bounded = limit < machine.settings.max_evals
    if bounded:
        machine = machine.changed(settings=replace(machine.settings, max_evals=math.ceil(limit)))
    sums = in_parts(problem.plan(order), machine, problem.env, problem.batch)
    stopped = most is not None and machine.exhausted() and BUDGET_SPENT in dict(machine.events.every(Shortfall))
    return Attempt(order, sums, machine.events, most, stopped, taken=math.ceil(machine.record.spent - before))


def uncertainty(sums: Sums) -> float:
    """The largest error of values and derivatives, each as a part of the largest of them; infinite where one is not
    known."""
    size = np.maximum(np.abs(sums.v), np.abs(sums.t).max(axis=1, initial=0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.maximum(sums.e, sums.et.max(axis=1, initial=0.0)) / size
    return float(np.where(np.isfinite(parts), parts, np.inf).max(initial=0.0))


def accurate(sums: Sums, limit: float, machine: Machine) -> bool:
    """Whether the errors are within a relative limit."""
    fine = sums.e <= np.maximum(limit * np.abs(sums.v), machine.atol)
    size = np.maximum(np.abs(sums.t), np.abs(sums.v)[:, None])  # a rate may be 0
    return bool(fine.all() and (sums.et <= np.maximum(limit * size, machine.atol)).all())


def best(attempts: Sequence[Attempt]) -> Attempt:
    """The one of which most is known; of equals the last one."""
    return min(reversed(attempts), key=lambda attempt: uncertainty(attempt.sums))
