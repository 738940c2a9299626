"""Integrals over many variables by eliminating these one after the other, where that does.

Owns `step_by_step`.
"""

from __future__ import annotations

import numpy as np

from potto.integrate.elimination.recursion import AFFORDABLE, Eliminated, one_by_one
from potto.integrate.events import Fold
from potto.integrate.pieces import Sums
from potto.runtime.evaluation.machine import Machine
from potto.runtime.integration.one_sided import beside_folds
from potto.runtime.integration.problem import Problem

# How accurate the answer must be, relatively, instead of that of iteration, and instead of that of samples.
ACCURATE, WORTH = 1e-8, 1e-4


def step_by_step(problem: Problem, limit: float, affordable: int = AFFORDABLE) -> Sums | None:
    """The integrals of a batch, where each variable hands one number on; None where errors are larger than `limit`, or
    one of them takes more evaluations than can be afforded."""
    known = problem.steps()
    if known is None:
        return None
    rows = []
    for i in range(problem.batch):
        alone = problem.member(i)
        row = _member(known, alone, affordable)
        if row is None or alone.events or not accurate(row, max(limit, alone.machine.rtol), alone.machine):
            return None
        rows.append(row)
    problem.machine.record.methods.add("quadrature")
    return Sums.joined(rows)


def _member(known: Eliminated, problem: Problem, affordable: int) -> Sums | None:
    """One integral, looked at from both sides where a surface folds in the outermost variable."""

    def tabled(there: Problem) -> Sums:
        found = one_by_one(known, there.machine, there.env)
        if found is None:
            raise _NotEvaluated
        return found

    row = one_by_one(known, problem.machine, problem.env, affordable)
    folds = problem.events.every(Fold)
    if row is None or not folds or any(fold.number for fold, _ in folds):
        return row
    try:
        beside_folds(problem.changed(solver=tabled), known.plans[0], row)
    except _NotEvaluated:
        return None
    return row


class _NotEvaluated(Exception):
    """A step has no table."""


def accurate(sums: Sums, limit: float, machine: Machine) -> bool:
    """Whether the errors are within a relative limit."""
    fine = sums.e <= np.maximum(limit * np.abs(sums.v), machine.atol)
    size = np.maximum(np.abs(sums.t), np.abs(sums.v)[:, None])  # a rate may be 0
    return bool(fine.all() and (sums.et <= np.maximum(limit * size, machine.atol)).all())
