"""Recursions under an integral that has deltas: written out before these are looked for.

Owns `in_sight` and `alone_in_sight`. How deep a recursion goes is seen at the values of its parameters.
"""

from __future__ import annotations

from itertools import chain

import numpy as np

from potto.calculus.inlining.recursions import recursions_unrolled
from potto.core.terms import (
    Branch,
    Delta,
    Deriv,
    Integral,
    Lam,
    Prim,
    Term,
    bound_names,
    lam,
    postorder,
    reached,
    with_integrand,
)
from potto.kernels.cells import Cell, Env, Value
from potto.kernels.making import making
from potto.kernels.tape import Node
from potto.runtime.evaluation.machine import Machine
from potto.runtime.evaluation.reach import Reach
from potto.runtime.integration.preparation.arrays import whole
from potto.runtime.integration.preparation.uncounted import not_found


def in_sight(machine: Machine, term: Integral, env: Env) -> Integral:
    """An equal integral for the values at hand; the same one where its recursions go deeper than a term is worth, or
    what ends them is not known. Raises Differ, where they go to different depths for the members of a batch."""
    reach = machine.linker.reach
    hidden = reach.deltas(term.body) or Delta in reach.kinds(term.body)
    if not hidden or not reach.recursions(term.body):
        return term
    body = _unrolled(machine, term.body, env)
    return term if body is term.body else with_integrand(term, body)


def alone_in_sight(machine: Machine, function: Lam) -> Lam:
    """An equal function, in which constants say how deep the recursions under its integrals go. Raises PottoError
    (P0510) where they don't, and deltas depend on it."""
    if not any(_hides(node.body, machine.linker.reach) for node in _integrals(machine, function.body)):
        return function
    body = _unrolled(machine, function.body, {})
    reach = machine.linker.reach
    for node in _integrals(machine, body):
        if any(reach.kinds(name) & {Delta, Deriv} for name in reach.recursions(node.body)) or any(
            isinstance(part, Delta) and any(map(reach.recursions, part.coordinates)) for part in postorder(node.body)
        ):
            raise not_found("a recursion places them, and how deep it goes is not known before it is called")
    return lam(function.params, body)


def _integrals(machine: Machine, term: Term) -> list[Integral]:
    nodes = chain.from_iterable(reached(term, resolve=machine.linker.reach.resolve))
    return [node for node in nodes if isinstance(node, Integral)]


def _unrolled(machine: Machine, term: Term, env: Env) -> Term:
    reach = machine.linker.reach
    bound = {name for node in postorder(term) for name in bound_names(node)}
    still = {name for name in env if name not in bound and _stands_still(env[name])}

    def decide(plain: Term) -> float | None:
        return whole(machine, plain, env) if plain.free <= still else None

    with making:
        return recursions_unrolled(term, reach.resolve, decide) or term


def _hides(integrand: Term, reach: Reach) -> bool:
    """Whether there may be surfaces in a recursion."""
    return bool(reach.recursions(integrand) and reach.kinds(integrand) & {Branch, Delta, Prim})


def _stands_still(value: Value) -> bool:
    """Whether a number does not move: where it does, what it decides changes with it, and is told of."""
    return isinstance(value, Cell) and all(t is None or (not isinstance(t, Node) and not np.any(t)) for t in value.t)
