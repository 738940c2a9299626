"""An integral that was taken apart into sums and products of integrals, with the one-sided derivatives of the whole.

Owns `together`. A surface on the bound of one part lies inside of the whole where another part begins there, and what
the other factors of a product come to counts as well.
"""

from __future__ import annotations

from potto.core.terms import Term, function_of
from potto.kernels.cells import Value
from potto.runtime.evaluation.derivatives.sides import as_a_whole
from potto.runtime.evaluation.machine import Machine


def together(machine: Machine, term: Term, env: dict[str, Value]) -> Value:
    """The value of what an integral is equal to, with the derivatives of the whole."""
    function, given = function_of(term), tuple(env[name] for name in sorted(term.free))

    def run(own: Machine, values: Value) -> Value:
        return own.run(function, list(values), None)  # type: ignore[arg-type]

    return as_a_whole(machine, term, given, run, part=True)
