"""Integrals of tangents, evaluated as tangents of integrals (`calculus/differentiation/directional`).

Owns `stepped`. Where the derivatives by the step differ on its two sides because two surfaces coincide and move apart,
a delta stood right where its factor jumps: that has no meaning. What is noted otherwise is about surfaces as they are
without the step.
"""

from __future__ import annotations

from dataclasses import replace

from potto.calculus.differentiation.deltas import PRODUCT_OF_DELTAS
from potto.calculus.differentiation.directional import STEP
from potto.core.printer import format_term
from potto.core.terms import ZERO, Term, substitute
from potto.diagnostics import PottoError
from potto.integrate.events import TwoSided
from potto.kernels import errors
from potto.kernels.cells import Value
from potto.runtime.evaluation.machine import Machine


def stepped(machine: Machine, term: Term, env: dict[str, Value]) -> Value:
    """The value of a term that `shifted` made. Raises PottoError (P0505)."""
    edges = machine.record.edges
    before = len(edges)
    value = machine.term(term, env)
    for place, edge in enumerate(edges[before:], before):
        edges[place] = replace(edge, cause=_without_step(edge.cause))
    return value


def _without_step(what: TwoSided) -> TwoSided:
    surface, other = (None if at is None else _still(at) for at in (what.surface, what.other))
    if surface is what.surface and other is what.other:
        return what
    if other is not None and surface is not None:
        raise PottoError([PRODUCT_OF_DELTAS(
            errors.NOWHERE, f"`delta({format_term(surface)})` stands right where its factor jumps",
            help="a delta takes the value of its factor on its surface, and there it has two",
        )])  # fmt: skip
    return replace(what, surface=surface, other=other)


def _still(surface: Term) -> Term:
    return substitute(surface, {name: ZERO for name in surface.free if name.startswith(STEP)})
