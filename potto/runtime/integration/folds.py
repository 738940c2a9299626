"""Integrals looked at a second time, where a surface that is searched for may have folds.

Owns `beside_another`.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from potto.core.terms import Integral
from potto.integrate.pieces import Sums
from potto.kernels.cells import Value
from potto.runtime.integration.choices import TRIAL, orders
from potto.runtime.integration.plans import Linked, plan_for
from potto.runtime.integration.quadrature import iterated, within

if TYPE_CHECKING:
    from potto.runtime.evaluation.machine import Machine

OTHER_NODES = 14  # in other places than those of the first time


def beside_another(machine: Machine, term: Integral, linked: Linked, env: dict[str, Value], batch: int,
                   sums: Sums) -> None:  # fmt: skip
    """Widen the errors by how far another order of the variables, or other nodes, lead elsewhere than they allow for.

    Where a surface that is searched for folds, the variables further out are not cut there, and refinement may miss it.
    """
    other = _in_another_order(machine, term, linked, env, batch)
    if other is None:
        plan = plan_for(machine, term, linked)
        with machine.books.apart():
            other = iterated(plan, machine, plan.environment(env, linked.env), batch, OTHER_NODES)
    for name, error in (("v", "e"), ("t", "et")):
        gap, own = np.abs(getattr(sums, name) - getattr(other, name)), getattr(sums, error)
        setattr(sums, error, np.where(gap > own + getattr(other, error), np.maximum(own, 2 * gap), own))


def _in_another_order(
    machine: Machine, term: Integral, linked: Linked, env: dict[str, Value], batch: int
) -> Sums | None:
    """The sums with another variable innermost; None where that tells nothing, or costs too much."""
    for order in itertools.islice(orders(term), 1, None):
        plan = plan_for(machine, order, linked)
        with machine.books.apart() as met:
            other = within(TRIAL, plan, machine, plan.environment(env, linked.env), batch)
        if other is not None and not met.degenerate and np.isfinite(other.e).all() and np.isfinite(other.et).all():
            return other
    return None
