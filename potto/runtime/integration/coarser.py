"""Fewer digits that are known instead of many that are not: what a spent budget leaves.

Owns `by_less`. Refinement that runs out of evaluations has spent them where it then stood, and left the rest as it was.
Asked for less accuracy it does reach the end, at a small part of the cost. So asking for more never gives less.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from potto.integrate.events import Degenerate, Fold, TwoSided
from potto.integrate.pieces import Sums
from potto.integrate.plan import Plan
from potto.runtime.integration.problem import Problem
from potto.runtime.integration.quadrature import in_parts

ENOUGH = 1e-3  # a relative error from which on it is tried
TOLERANCES = (1e-6, 1e-3)  # that are asked for instead, one after the other, until one is reached
EXTRA = 0.125  # the part of the budget that each may take beyond it


def by_less(problem: Problem, plan: Plan, sums: Sums) -> Sums:
    """The sums, or better ones that were found by asking for less, where the budget ran out with few digits.

    Not where the integrand calls for integrals, which would go far beyond any budget once more.
    """
    machine = problem.machine
    if not machine.exhausted() or (sums.e <= ENOUGH * np.abs(sums.v)).all() or machine.inexact(plan.term.body):
        return sums
    for rtol in TOLERANCES:
        most = math.ceil(machine.record.spent + EXTRA * machine.settings.max_evals)
        settings = replace(machine.settings, rtol=max(rtol, machine.rtol), max_evals=most)
        loose = replace(machine.apart(), settings=settings)
        other = in_parts(plan, loose, problem.env, problem.batch)
        met = loose.events.touched(problem.batch, TwoSided, Fold, Degenerate).any()
        if (other.e < sums.e).all() and (other.et <= sums.et).all() and not met:
            sums = other
        if (sums.e <= rtol * np.abs(sums.v)).all():
            break
    return sums
