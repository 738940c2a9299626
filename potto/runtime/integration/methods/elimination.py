"""Integrals over many variables by eliminating these one after the other, where that does.

Owns `step_by_step` and `eliminated`. What eliminates is loaded when there is something to eliminate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from potto.calculus.decomposition.elimination import eliminable
from potto.integrate.events import SurfaceFold
from potto.integrate.pieces import Sums
from potto.runtime.integration.methods.attempts import Attempt, accurate
from potto.runtime.integration.problem import Problem

if TYPE_CHECKING:
    from potto.integrate.elimination.step_plans import Eliminated

# How accurate the answer must be, relatively, instead of that of iteration, and instead of that of samples.
ACCURATE, WORTH = 1e-8, 1e-4


def step_by_step(problem: Problem, limit: float) -> Sums | None:
    """The integrals of a batch, where each variable hands one number on; None where errors are larger than `limit`, or
    one of them takes more evaluations than can be afforded."""
    rows = []
    for i in range(problem.batch):
        alone = problem.member(i)
        found = eliminated(alone)
        if not found or not accurate(found[0].sums, max(limit, alone.machine.rtol), alone.machine):
            return None
        rows.append(found[0].sums)
    problem.machine.record.methods.add("quadrature")
    return Sums.joined(rows)


def eliminated(problem: Problem) -> list[Attempt]:
    """What one integral, or each of its summands, comes to where each variable hands one number on; nothing where none
    does, where it takes more evaluations than can be afforded, or something was met that tables do not tell."""
    apart, rows = problem.apart(), []
    for term in eliminable(problem.term):
        own = apart if term is problem.term else apart.changed(term=term)
        known = own.steps()
        row = None if known is None else _member(known, own)
        if row is None:
            return []
        rows.append(row)
    return [] if not rows or apart.events else [Attempt(problem.term, _added(rows), apart.events, tabled=True)]


def _added(rows: list[Sums]) -> Sums:
    total, *others = rows
    for row in others:
        total = Sums(total.v + row.v, total.e + row.e, total.t + row.t, total.et + row.et)
    return total


def _member(known: Eliminated, problem: Problem) -> Sums | None:
    """One integral, looked at from both sides where a surface folds in the outermost variable."""
    from potto.integrate.elimination.recursion import AFFORDABLE, one_by_one
    from potto.runtime.integration.derivatives.one_sided import beside_folds

    def tabled(there: Problem) -> Sums:
        rows = []
        for i in range(there.batch):
            found = one_by_one(known, problem.plan(), there.machine, there.picked(np.array([i])).env)
            if found is None:
                raise _NotEvaluated
            rows.append(found)
        return Sums.joined(rows)

    row = one_by_one(known, problem.plan(), problem.machine, problem.env, AFFORDABLE)
    folds = problem.events.every(SurfaceFold)
    if row is None or not folds or not all(_outermost(fold, known) for fold, _ in folds):
        return row
    try:
        beside_folds(problem.changed(solver=tabled), known.plans[0], row)
    except _NotEvaluated:
        return None
    return row


def _outermost(fold: SurfaceFold, known: Eliminated) -> bool:
    """Whether a fold is one of a surface that cuts the outermost variable: the steps have cuts of their own."""
    level = known.plans[0].levels[0]
    own = {number for number, cut in enumerate(level.level.cuts) if cut.surface is fold.cause.surface}
    return fold.cause.variable == level.variable and all(not spot.number and spot.cut in own for spot in fold.spots)


class _NotEvaluated(Exception):
    """A step has no table."""
