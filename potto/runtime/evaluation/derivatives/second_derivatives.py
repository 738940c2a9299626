"""Derivatives of derivatives: the inner one taken as a term.

Owns `dual_function`. One derivative is carried by kernels as tangents; for a further one the function is first
replaced by its symbolic dual, whose boundary terms are ordinary terms, and that is differentiated in its turn.
"""

from __future__ import annotations

from potto.calculus.differentiation.derivative import NotSmooth
from potto.calculus.differentiation.dual import dual_function as symbolic
from potto.calculus.inlining.joint_sums import with_joint_sums
from potto.calculus.solving.pivots import NoClosedForm
from potto.core.terms import Global, Lam, Term, lam
from potto.diagnostics import PottoError
from potto.kernels import errors
from potto.runtime.evaluation.functions import Closure, Derivative, Paired
from potto.runtime.evaluation.machine import Machine
from potto.runtime.integration.preparation.recursions import alone_in_sight
from potto.runtime.integration.preparation.uncounted import NOT_COUNTED


def dual_function(machine: Machine, function: Closure) -> Closure:
    """The dual of a function as a function on pairs; the values that it has captured stand still."""
    if isinstance(function, Paired):
        raise PottoError([errors.WRONG_CALL(
            errors.NOWHERE, "a second derivative of a derivative that was written by hand is not known",
        )])  # fmt: skip
    primal = dual_function(machine, function.primal) if isinstance(function, Derivative) else function
    return Closure(_dual(machine, primal.lam), primal.captured, primal.inexact, None)


def _dual(machine: Machine, function: Lam) -> Lam:
    known = machine.linker.duals.get((function, machine.frozen))
    if known is None:

        def resolve(name: Global) -> Term | None:
            return machine.linker.term(name.module, name.name)

        try:
            found = symbolic(alone_in_sight(machine, function), resolve, machine.frozen)
        except (NoClosedForm, NotSmooth) as reason:
            raise PottoError([NOT_COUNTED(
                errors.NOWHERE, f"no second derivative was found: {reason}", help="differentiate only once",
            )]) from None  # fmt: skip
        known = lam(found.params, with_joint_sums(found.body))
        machine.linker.duals[function, machine.frozen] = known
    return known
