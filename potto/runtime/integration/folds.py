"""Integrals looked at a second time, where a surface that is searched for may have folds.

Owns `beside_another`.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from potto.core.terms import Integral
from potto.integrate.events import Degenerate
from potto.integrate.pieces import Sums
from potto.kernels.cells import Array
from potto.runtime.integration.choices import TRIAL, orders
from potto.runtime.integration.problem import Problem
from potto.runtime.integration.quadrature import iterated, within

OTHER_NODES = 14  # in other places than those of the first time


def beside_another(problem: Problem, order: Integral, sums: Sums) -> Sums:
    """The sums with errors as wide as another order of the variables, or other nodes, lead elsewhere.

    Where a surface that is searched for folds, the variables further out are not cut there, and refinement may miss it.
    """
    other = _in_another_order(problem, order)
    if other is None:
        other = iterated(problem.plan(order), problem.machine.apart(), problem.env, problem.batch, OTHER_NODES)
    return replace(
        sums,
        e=_covering(sums.v - other.v, sums.e, other.e),
        et=_covering(sums.t - other.t, sums.et, other.et),
    )


def _covering(gap: Array, own: Array, others: Array) -> Array:
    """Errors that cover what two answers differ by more than they admit."""
    gap = np.abs(gap)
    return np.where(gap > own + others, np.maximum(own, 2 * gap), own)


def _in_another_order(problem: Problem, order: Integral) -> Sums | None:
    """The sums with another variable innermost; None where that tells nothing, or costs too much."""
    for turned in itertools.islice(orders(order), 1, None):
        part = problem.apart()
        other = within(TRIAL, part.plan(turned), part.machine, part.env, part.batch)
        known = other is not None and np.isfinite(other.e).all() and np.isfinite(other.et).all()
        if known and not part.events.every(Degenerate):
            return other
    return None
