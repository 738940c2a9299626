"""Integrals looked at a second time, where a surface that is searched for may have folds.

Owns `beside_another`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from potto.core.terms import Integral
from potto.integrate.pieces import Sums
from potto.kernels.cells import Value
from potto.runtime.choices import orders
from potto.runtime.plans import Linked, plan_for

if TYPE_CHECKING:
    from potto.runtime.machine import Machine

OTHER_ORDER = 14  # nodes in other places than those of the first time
Iterated = Callable[..., Sums]


def beside_another(
    machine: Machine, term: Integral, linked: Linked, env: dict[str, Value], batch: int, sums: Sums,
    iterated: Iterated,
) -> None:  # fmt: skip
    """Widen the errors by how far another order of the variables, or other nodes, lead elsewhere.

    Where a surface that is searched for folds, the variables further out are not cut there, and refinement may miss it.
    """
    other = None
    for order in itertools.islice(orders(term), 1, None):
        plan = plan_for(machine, order, linked)
        with machine.books.apart() as met:
            other = iterated(plan, machine, plan.environment(env, linked.env), batch)
        if not met.degenerate:
            break
        other = None
    if other is None:
        plan = plan_for(machine, term, linked)
        with machine.books.apart():
            other = iterated(plan, machine, plan.environment(env, linked.env), batch, OTHER_ORDER)
    sums.e = np.maximum(sums.e, 2 * np.abs(sums.v - other.v))
    sums.et = np.maximum(sums.et, 2 * np.abs(sums.t - other.t))
