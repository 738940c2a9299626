"""An integral that was taken apart into a sum of integrals: one-sided derivatives of parts are not those of the whole.

Owns `summed`. A surface on the bound of one part lies inside of the whole where another part begins there.
"""

from __future__ import annotations

from potto.core.terms import Term, function_of
from potto.kernels.cells import Value
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.sides import as_a_whole


def summed(machine: Machine, term: Term, env: dict[str, Value]) -> Value:
    """The value of the sum that an integral is equal to, with the derivatives of the whole."""
    return as_a_whole(machine, term, lambda own: own.evaluate(function_of(term), env, None))
